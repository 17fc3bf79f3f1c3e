"""Parts of a material's light by blurs of an environment, against what they are known to be."""

from __future__ import annotations

import numpy as np
import pytest

import velatura as vt
from velatura.model import named
from velatura.shader import blurs, prefiltered
from velatura.shader.prefiltered import Prefiltered
from velatura.stack import Material


def parts(*layers: vt.stack.Layer) -> Prefiltered:
    return prefiltered.prefiltered(Material.of(vt.Stack(list(layers))), named("velatura"))


@pytest.fixture
def few_cosines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Brushed materials are looked at from 8 cosines, in place of 32."""
    monkeypatch.setattr(prefiltered, "PLANE", (8, 17))


def test_the_widest_blur_is_the_cosine() -> None:
    """Expected: Lambert's density, and a variance of 1/4 along a tangent; less for every lower alpha."""
    versine = np.linspace(0, 1, 11)
    np.testing.assert_allclose(blurs.density(versine, np.array(1.0)), (1 - versine) / np.pi, rtol=1e-6)
    assert blurs.VARIANCES[-1] == pytest.approx(0.25, abs=1e-4)
    assert np.all(np.diff(blurs.VARIANCES) > 0)


@pytest.mark.parametrize("alpha", [0.03, 0.3, 0.98, 0.9999])
def test_a_blur_is_a_density(alpha: float) -> None:
    """Expected: an integral of 1 over the hemisphere about its direction."""
    versine = np.concatenate([[0.0], np.geomspace(1e-7, 1.0, 20000)])
    assert 2 * np.pi * np.trapezoid(blurs.density(versine, np.array(alpha)), versine) == pytest.approx(1, abs=1e-4)


def test_blurs_are_found_again() -> None:
    """Expected: two blurs that samples are drawn of, from others to begin with; without noise, as ratios are exact."""
    drawn = np.array([[[0.05, 0.0, 0.3, 0.6], [0.3, 0.0, 0.6, 0.4]]])
    sine, start = np.array([0.6]), np.array([[[0.0, 0.0, 0.35, 0.5], [0.2, 0.0, 0.7, 0.5]]])
    rng = np.random.default_rng(2)
    z, phi = rng.random(4000), 2 * np.pi * rng.random(4000)
    w = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z])[:, None]
    uniform = np.full((1, 4000), 1 / (2 * np.pi))
    ratio = blurs.mixed(drawn, sine, w) / uniform
    found = blurs.fitted(start, sine, w, ratio, uniform)
    np.testing.assert_allclose(found, drawn, atol=0.02)


def test_a_diffuse_base_is_its_irradiance() -> None:
    """Expected: its albedo about the normal, by the widest blur."""
    found = parts(vt.Diffuse(albedo=(0.6, 0.4, 0.2)))
    assert [blur.shape for blur in found.blurs] == [(1, 64, 1, 4)] and not any(found.passes)
    np.testing.assert_allclose(found.energy[0, :, 0], np.tile([0.6, 0.4, 0.2], (64, 1)), rtol=1e-3)
    sine = np.sqrt(1 - (np.arange(64) / 63) ** 4)
    np.testing.assert_allclose(found.blurs[0][0, 8:, 0, 0], sine[8:], atol=0.03)
    np.testing.assert_allclose(found.blurs[0][0, :, 0, 2], 1, atol=0.03)


def test_a_smooth_metal_is_a_mirror_and_a_brushed_one_is_longer_across(few_cosines: None) -> None:
    """Expected: the mirror's direction, and narrow blurs; by brushing along y, light near the normal goes to places
    that lie apart along x, which is across the short axis."""
    [mirror] = parts(vt.Interface(conductor="mirror", alpha=0.01)).blurs
    mean = (mirror[0, 20:-2] * mirror[0, 20:-2, :, 3:]).sum(axis=1)
    np.testing.assert_allclose(mean[:, :2], 0, atol=0.01)
    assert np.max(mean[:, 2] ** 2) < 0.02
    [brushed] = parts(vt.Interface(conductor="mirror", alpha=[0.3, 0.05])).blurs
    at_normal = brushed[0].reshape(8, 17, -1, 4)[-1, 8]
    along, across = (at_normal[:, k] ** 2 @ at_normal[:, 3] for k in range(2))
    assert along > 0.05 > 20 * across


def test_lobes_that_are_alike_share_blurs() -> None:
    """Expected: a sharp coat apart from rough copper, which the faint remainder joins and which has two blurs; together
    the energies of all lobes, to the noise of 1,024 samples."""
    stack = vt.Stack([vt.Interface(eta=1.5, alpha=0.02), vt.Interface(conductor="copper", alpha=0.4)])
    found = parts(*stack.layers)
    assert [blurs.shape for blurs in found.blurs] == [(1, 64, 1, 4), (1, 64, 2, 4)]
    lobes = vt.lobes(stack, (np.arange(64) / 63)[20::10] ** 2)
    expected = [lobes.energy[0], np.asarray(lobes.energy[1]) + np.asarray(lobes.remainder)]
    np.testing.assert_allclose(found.energy[0, 20::10].transpose(1, 2, 0), np.array(expected), atol=5e-3)


@pytest.mark.parametrize(("alpha", "turn"), [([0.05, 0.3], 30), ([0.3, 0.05], 120)])
def test_blurs_of_brushed_metal_change_their_places_at_the_ends_of_the_azimuth(
    alpha: list[float], turn: int, few_cosines: None
) -> None:
    """Expected: azimuths from the short axis; at their end, which is their beginning, the sharpest blur on the other
    side, to the noise of 256 samples; between them it goes there by steps."""
    found = parts(vt.Interface(conductor="mirror", alpha=alpha, rotation=30))
    assert found.turn == pytest.approx(np.radians(turn))
    sharpest = found.blurs[0].reshape(8, 17, -1, 4)[4:7, :, 0, :2]
    np.testing.assert_allclose(sharpest[:, -1], sharpest[:, 0] * [1, -1], atol=0.03)
    way = np.linalg.norm(sharpest[:, -1] - sharpest[:, 0], axis=-1)
    assert np.all(np.linalg.norm(np.diff(sharpest, axis=1), axis=-1).max(axis=1) < 0.5 * way)


def test_energies_are_those_of_lobes() -> None:
    """Expected: of each interface and of the remainder, to the noise of 1,024 samples."""
    stack = vt.preset("varnished-paint")
    found = prefiltered.prefiltered(Material.of(stack), named("velatura"))
    cosine = (np.arange(64) / 63) ** 2
    lobes = vt.lobes(stack, cosine[20::10])
    total = sum(np.asarray(energy) for energy in lobes.energy) + np.asarray(lobes.remainder)
    np.testing.assert_allclose(found.energy[0, 20::10].sum(axis=1).T, total, atol=5e-3)


@pytest.mark.parametrize(("shape", "sides"), [((64,), 1), ((32, 17), 2)])
def test_sums_give_the_numbers_back(shape: tuple[int, ...], sides: int) -> None:
    """Expected: energies and blurs that follow three smooth functions of direction, to rounding, by one texel; a
    fourth part of noise, within what it may displace, by more."""
    rng = np.random.default_rng(3)
    over = rng.random((sides, int(np.prod(shape)), 3)) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]

    def part(count: int, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        energy = 0.5 + 0.1 * over @ rng.uniform(-1, 1, (3, 3))
        seen = 0.3 + 0.05 * np.einsum("snk,kjm->snjm", over, rng.uniform(-1, 1, (3, count, 4)))
        return energy + noise * rng.random(energy.shape), seen + noise * rng.random(seen.shape)

    for noise, texels in ((0.0, 1), (0.1, 4)):
        energies, seen = zip(part(1), part(2, noise))
        found = Prefiltered(np.stack(energies, axis=2), seen, shape, [False, True], 0.0)
        sums = prefiltered.summed(found)
        assert len(sums.texels) == texels
        assert np.abs(sums.texels).max() <= 1 + 1e-9
        grid = sums.texels.reshape(len(sums.texels), sides, *shape[1:], shape[0], 4)
        of_nodes = np.moveaxis(grid, 0, -2).reshape(sides, -1, shape[0], 4 * len(sums.texels)).swapaxes(1, 2)
        of_nodes = of_nodes.reshape(sides, -1, of_nodes.shape[-1])
        for k, factors in enumerate(sums.factors):
            values = np.einsum("rcn,sin->sirc", factors[..., :-1], of_nodes) + factors[..., -1]
            expected = np.concatenate([np.pad(energies[k], ((0, 0), (0, 0), (0, 1)))[:, :, None], seen[k]], axis=2)
            light = 1 / 0.015  # of a blur of alpha .09, half an energy, a change by 1 displaces more than half of it
            np.testing.assert_allclose(values, expected, atol=2 / light if noise else 1e-9)
