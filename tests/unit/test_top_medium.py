"""What a medium without a step of the index above it scatters back: closed forms, samples, energies and limits."""

from __future__ import annotations

from math import factorial, pi
from typing import Any

import numpy as np
import pytest

from velatura.media.of_material import phase_of, two_lobes
from velatura.model import named
from velatura.model.context import Context
from velatura.model.solved import solve
from velatura.model.solved.bsdf import Solved
from velatura.model.solved.lobes import top_medium
from velatura.model.variance import variance_kind
from velatura.stack import Diffuse, Film, Interface, Material, Medium, SlabValues, Stack

METAL = Interface(eta=0.2, k=3.0, alpha=0.2)
TURN = np.linspace(0, 2 * pi, 9)[:-1]


def body(layers: list[Any], form: str = "forward") -> Solved:
    material = Material.of(Stack(layers)).solid()
    return solve.solve(material, named("velatura", form=form), variance_kind(material), Context())


def directions(cosine: float | np.ndarray, phi: float | np.ndarray) -> tuple[np.ndarray, ...]:
    z = np.broadcast_to(cosine, np.broadcast_shapes(np.shape(cosine), np.shape(phi))).astype(float)
    s = np.sqrt(1 - z * z)
    return s * np.cos(phi), s * np.sin(phi), z


@pytest.mark.parametrize("g", [-0.4, 0.0, 0.6, 0.9])
def test_a_thin_dark_medium_scatters_once(g: float) -> None:
    """Expected: the closed form, to the order of the depth and the albedo."""
    albedo, depth = 0.02, 0.05
    found = body([Medium(depth=depth, sigma_s=albedo, sigma_a=1 - albedo, g=g), Diffuse(albedo=0.0)])
    for z_i, z_o in ((0.8, 0.9), (0.3, 0.5), (0.5, 0.2)):
        wi, wo = directions(z_i, 0 * TURN), directions(z_o, TURN)
        cosine = -sum(a * b for a, b in zip(wi, wo))
        phase = (1 - g * g) / (4 * pi * (1 + g * g - 2 * g * cosine) ** 1.5)
        once = albedo * phase * -np.expm1(-depth * (1 / z_i + 1 / z_o)) / (z_i + z_o)
        np.testing.assert_allclose(found.eval_pdf(wi, wo)[0][0] / z_o, once, rtol=0.05, atol=0.02 * once.max())


@pytest.mark.parametrize("g", [-0.4, 0.0, 0.6, 0.9])
def test_a_thin_dark_medium_alone_passes_what_it_scatters_once(g: float) -> None:
    """Expected: the closed form, as above; equal slants are its limit."""
    albedo, depth = 0.02, 0.05
    found = body([Medium(depth=depth, sigma_s=albedo, sigma_a=1 - albedo, g=g), Interface(eta=1.0)])
    for z_i, z_o in ((0.8, 0.9), (0.3, 0.5), (0.5, 0.2), (0.6, 0.6 + 1e-9)):
        wi, (x, y, z) = directions(z_i, 0 * TURN), directions(z_o, TURN[1:-1] + 0.2)
        wi = wi[0][1:-1], wi[1][1:-1], wi[2][1:-1]
        cosine = -(wi[0] * x + wi[1] * y) + wi[2] * z
        phase = (1 - g * g) / (4 * pi * (1 + g * g - 2 * g * cosine) ** 1.5)
        once = albedo * phase * (np.exp(-depth / z_o) - np.exp(-depth / z_i)) / (z_o - z_i)
        np.testing.assert_allclose(found.eval_pdf(wi, (x, y, -z))[0][0] / z_o, once, rtol=0.05, atol=0.02 * once.max())


@pytest.mark.parametrize("n", [1, 2, 4])
@pytest.mark.parametrize("slants", [(0.3, 0.8), (0.5, 0.51), (0.7, 0.7), (0.05, 0.9)])
def test_depths_between_slants(n: int, slants: tuple[float, float]) -> None:
    """Expected: the quadrature of exp(-x) x^(n-1) / (n-1)! over the depths between those of both slants, over n."""
    depth, (z_i, z_o) = 1.3, slants
    u, weights = np.polynomial.legendre.leggauss(200)
    x = depth / z_o + (0.5 + 0.5 * u) * (depth / z_i - depth / z_o)
    mean = 0.5 * np.sum(weights * np.exp(-x) * x ** (n - 1)) / factorial(n - 1)
    found = top_medium.passing(depth, z_i, z_o)[[1, *top_medium.ORDERS].index(n)]
    assert found == pytest.approx(depth / (z_i * z_o) * mean / n, rel=1e-5)


@pytest.mark.parametrize("form", ["forward", "symmetric"])
@pytest.mark.parametrize("below", [[Interface(eta=1.0)], [Diffuse(albedo=0.4)], [METAL]], ids=["fog", "base", "metal"])
def test_samples_have_the_values_over_their_density(below: list[Any], form: str) -> None:
    """Expected: their mean weight is the energy, within 4.5 standard errors (a false alarm in 150 000, 24 of them) and
    what the light of a lobe at the horizon loses; none is heavier than 2.9. Fog passes light, too."""
    found = body([Medium(sigma_s=(0.9, 0.7, 0.5), sigma_a=0.1, g=0.8), *below], form)
    u = np.random.default_rng(7).random((3, 20_000))
    for cosine in (0.9, 0.2):
        wi = directions(cosine, np.full(u.shape[1], 0.3))
        wo, _ = found.sample(wi, *u)
        value, density = found.eval_pdf(wi, wo)
        weights = np.where(density > 0, value / np.maximum(density, 1e-12), 0.0)
        error = weights.std(axis=1) / np.sqrt(u.shape[1])
        albedo = np.broadcast_to(found.albedo(wi), weights.shape)[:, 0]
        assert np.all(np.abs(weights.mean(axis=1) - albedo) < 0.004 + 4.5 * error)
        assert weights.max() < 2.9


def test_light_that_is_thrown_straight_back_is_kept() -> None:
    """Expected: a peak backwards, of g -.9, is sampled: no weight is cut, and energies are near to .01 of the light."""
    found = body([Medium(sigma_s=1.0, g=-0.9), Diffuse(albedo=0.3)])
    u = np.random.default_rng(7).random((3, 20_000))
    for cosine in (0.9, 0.2):
        wi = directions(cosine, np.zeros(u.shape[1]))
        wo, _ = found.sample(wi, *u)
        value, density = found.eval_pdf(wi, wo)
        weights = np.where(density > 0, value / np.maximum(density, 1e-12), 0.0)
        assert np.all(np.abs(weights.mean(axis=1) - np.ravel(found.albedo(wi))[0]) < 0.01)


def test_densities_of_reflected_samples_sum_to_one() -> None:
    found = body([Medium(sigma_s=0.9, sigma_a=0.1, g=0.7), Diffuse(albedo=0.4)])
    z, phi = (np.arange(400) + 0.5) / 400, (np.arange(200) + 0.5) * (2 * pi / 200)
    wo = directions(*(x.ravel() for x in np.meshgrid(z, phi)))
    for cosine in (0.9, 0.3):
        wi = directions(cosine, 0 * wo[0])
        assert found.eval_pdf(wi, wo)[1].mean() * 2 * pi == pytest.approx(1, abs=2e-3)


def test_light_from_listed_directions_alone_is_that_of_the_material() -> None:
    """To what is interpolated between directions."""
    material = Material.of(Stack([Medium(sigma_s=0.9, sigma_a=0.1, g=0.7), METAL]))
    model, wi, wo = named("velatura"), directions(0.8, 0 * TURN), directions(0.4, TURN)
    found = model.lit(material, (wi[0][:1], wi[1][:1], wi[2][:1]))(np.zeros(len(TURN), int))
    known = model.body(material, variance_kind(material), Context())
    np.testing.assert_allclose(found.eval_pdf(wi, wo)[0], known.eval_pdf(wi, wo)[0], rtol=2e-3)


def test_the_symmetric_form_is_reciprocal() -> None:
    found = body([Medium(sigma_s=0.9, sigma_a=0.1, g=0.7), METAL], "symmetric")
    there, back = directions(0.8, 0 * TURN), directions(0.3, TURN)
    f, f_back = found.eval_pdf(there, back)[0] / back[2], found.eval_pdf(back, there)[0] / there[2]
    np.testing.assert_allclose(f, f_back, rtol=1e-6)


@pytest.mark.parametrize(
    ("layers", "place"),
    [
        ([Medium(sigma_s=1.0), METAL], 0),
        ([Interface(eta=1.0), Medium(sigma_s=1.0), METAL], 1),
        ([Interface(eta=1.5), Medium(sigma_s=1.0), METAL], None),
        ([Interface(eta=1.0, films=[Film(eta=1.5, thickness_nm=300)]), Medium(sigma_s=1.0), METAL], None),
        ([Medium(sigma_a=1.0), METAL], None),
        ([METAL], None),
    ],
)
def test_a_medium_is_apart_where_nothing_above_it_refracts(layers: list[Any], place: int | None) -> None:
    assert solve.layout_of([Material.of(Stack(layers))]).top == place
    assert (body(layers).above.top is None) == (place is None)


def test_a_medium_seen_through_its_other_side_is_apart_on_one_side_alone() -> None:
    """Dust on a pane: from below it lies behind glass."""
    found = body([Medium(depth=0.3, sigma_s=1.0, g=0.6), Interface(eta=1.5), Interface(eta=1.0)])
    assert found.below and found.above.top and found.below.top
    assert np.max(found.above.top.albedo) == 1 and np.max(found.below.top.albedo) == 0


@pytest.mark.parametrize(
    ("layers", "alone"),
    [
        ([Medium(sigma_s=1.0), Interface(eta=1.0)], True),
        ([Interface(eta=1.0), Medium(sigma_s=1.0), Interface(eta=1.0, alpha=0.3)], True),
        ([Medium(sigma_s=1.0), Interface(eta=1.2)], False),
        ([Medium(sigma_s=1.0), Medium(sigma_a=1.0), Interface(eta=1.0)], False),
        ([Medium(sigma_s=1.0), Diffuse(albedo=0.5)], False),
        ([Medium(sigma_a=1.0), Interface(eta=1.0)], False),
    ],
)
def test_a_medium_is_alone_without_steps_of_the_index(layers: list[Any], alone: bool) -> None:
    assert solve.layout_of([Material.of(Stack(layers))]).alone == alone


def test_a_medium_alone_is_alike_from_both_sides() -> None:
    """Expected: values and densities of directions turned over; no interface of the slab has a step of the index."""
    found = body(
        [Interface(eta=1.0, alpha=0.1), Medium(sigma_s=(0.9, 0.7, 0.5), sigma_a=0.1, g=0.7), Interface(eta=1.0)]
    )
    wi = directions(0.6, 0 * TURN)
    for x, y, z in (directions(0.5, TURN + 0.1), directions(-0.7, TURN + 0.1)):
        above = found.eval_pdf(wi, (x, y, z))
        below = found.eval_pdf((wi[0], wi[1], -wi[2]), (x, y, -z))
        for a, b in zip(above, below):
            np.testing.assert_allclose(a, b, rtol=1e-9)


@pytest.mark.parametrize("phase", ["rayleigh", {"table": [(0, 3), (60, 0.3), (90, 0.1), (180, 0.2)]}])
def test_two_lobes_have_the_moments_of_a_phase_function(phase: Any) -> None:
    """Expected: the first three, or two of one that falls off as no lobe does, by quadrature of the densities."""
    layer = Material.of(Stack([Medium(sigma_s=1.0, phase=phase), METAL])).layers[0]
    assert isinstance(layer, SlabValues)
    own = phase_of(layer)
    x, weights = np.polynomial.legendre.leggauss(2000)
    for order in (1, 2, 3) if phase == "rayleigh" else (1, 2):
        moments = [
            2 * pi * np.sum(weights * f.density(x) * np.polynomial.legendre.legval(x, [0] * order + [1]))
            for f in (own, two_lobes(own))
        ]
        assert moments[1] == pytest.approx(moments[0], abs=2e-4)
