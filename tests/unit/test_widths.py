"""Widths of lobes: exact limits, turning, and random walks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import velatura as vt
from velatura import Interface, Medium, Stack, kernel
from velatura.model import DEFAULT, named
from velatura.model.rough_interface import Facets
from velatura.model.solved.energies import brushing
from velatura.model.solved.energies.adding import Part, parts
from velatura.model.solved.lobes import refracted_lobe, widths
from velatura.model.solved.lobes.refracted_lobe import RefractedLobe
from velatura.model.variance import Roughness
from velatura.optics import fresnel
from velatura.optics.phase import HenyeyGreenstein
from velatura.stack import Material

Array = NDArray[np.floating]

COSINES = np.array([1.0, 0.7, 0.35])


def found(*layers: Any) -> list[Part]:
    return parts(Material.of(Stack(list(layers))))


def roughnesses(layers: list[Part], cosines: Array, phi: Array, energies: Array) -> list[Roughness]:
    return [tensor.roughness(phi) for tensor in widths.tensors(layers, cosines, phi, energies)]


def smooth_energies(*layers: Any) -> Array:
    """Of lobes of interfaces that are smooth, without what goes back and forth, (K, 3)."""
    share, energies = np.ones(3), []
    n = 1.0
    for layer in layers:
        cosine = np.sqrt(1 - (1 - COSINES**2) / n**2)
        eta = layer.eta / n
        r = fresnel.dielectric(cosine, eta) if layer.k is None else fresnel.conductor(cosine, eta, layer.k / n)
        energies.append(share * r)
        share, n = share * (1 - r) ** 2, layer.eta
    return np.array(energies)


def test_the_first_lobe_has_the_roughness_of_its_interface() -> None:
    only = found(Interface(eta=1.5, alpha=(0.1, 0.4), rotation=25))
    (lobe,) = roughnesses(only, COSINES, np.array([0.0, 1.0, 2.0]), np.full((1, 3), 0.1))
    np.testing.assert_allclose([lobe.alpha_u, lobe.alpha_v], np.array([[0.4], [0.1]]).repeat(3, 1), rtol=1e-9)
    np.testing.assert_allclose(np.cos(2 * (lobe.rotation - np.radians(115))), 1)


@pytest.mark.parametrize("coat", [Interface(eta=1.0, alpha=0.4), Interface(eta=1.0001, alpha=0.4)])
def test_a_coat_of_the_index_outside_changes_nothing(coat: Interface) -> None:
    layers = coat, Interface(eta=0.2, k=3.0, alpha=(0.3, 0.1), rotation=70)
    _, lobe = roughnesses(found(*layers), COSINES, 0 * COSINES, smooth_energies(*layers))
    np.testing.assert_allclose(lobe.alpha_u, 0.3, rtol=3e-3)
    np.testing.assert_allclose(lobe.alpha_v, 0.1, rtol=3e-3)
    np.testing.assert_allclose(np.cos(2 * (lobe.rotation - np.radians(70))), 1)


def test_a_tinted_medium_leaves_the_width_of_a_lobe_alone() -> None:
    """What absorbs single colours is no light that bounces: as wide as without the medium, to rounding."""
    coat, metal = Interface(eta=1.5, alpha=0.1), Interface(eta=0.2, k=3.0, alpha=0.2)
    tint = Medium(depth=1.0, sigma_a=(0.1, 0.5, 2.0))
    energies = smooth_energies(coat, metal)
    inside = np.sqrt(1 - (1 - COSINES**2) / 1.5**2)
    kept = np.exp(-2 * np.array(tint.sigma_a)[:, None] / inside).mean(axis=0)
    clear = roughnesses(found(coat, metal), COSINES, 0 * COSINES, energies)
    tinted = roughnesses(found(coat, tint, metal), COSINES, 0 * COSINES, energies * [1 + 0 * kept, kept])
    np.testing.assert_allclose(tinted[1], clear[1], rtol=1e-9)


def test_turning_all_layers_turns_all_lobes() -> None:
    """At the normal too, where lobes do not depend on the azimuth from which they are lit."""

    def tensors(turn: float, phi: float) -> Array:
        coat = Interface(eta=1.5, alpha=(0.1, 0.3), rotation=20 + turn)
        base = Interface(eta=0.2, k=3.0, alpha=(0.4, 0.05), rotation=-50 + turn)
        azimuths = np.full(3, np.radians(phi))
        lobe = roughnesses(found(coat, base), COSINES, azimuths, np.array([[0.05] * 3, [0.6] * 3]))[1]
        tensor = widths.Tensor.turned(lobe.alpha_u, lobe.alpha_v, lobe.rotation - np.radians(turn))
        return np.array([tensor.xx, tensor.xy, tensor.yy])

    np.testing.assert_allclose(tensors(0, 0), tensors(33, 33), rtol=1e-9)
    np.testing.assert_allclose(tensors(0, 0)[:, 0], tensors(0, 40)[:, 0], rtol=1e-9)
    assert np.abs(tensors(0, 0)[:, 2] - tensors(0, 40)[:, 2]).max() > 1e-3


@pytest.mark.parametrize(("rotation", "azimuth"), [(30, 0.0), (70, 0.0), (70, 0.5), (30, 1.2)])
def test_a_smooth_coat_does_not_turn_the_lobe_of_long_facets(rotation: float, azimuth: float) -> None:
    """Facets whose slopes lie along a line move momentum along it, however often light meets them."""
    layers = found(Interface(eta=1.5), Interface(eta=0.3, k=3.0, alpha=(0.3, 0.025), rotation=rotation))
    cosines = np.array([1.0, 0.35, 0.08])
    energies = np.array([[0.05, 0.1, 0.5], [0.8, 0.7, 0.3]])
    _, lobe = roughnesses(layers, cosines, np.full(3, azimuth), energies)
    np.testing.assert_allclose(np.degrees(lobe.rotation), rotation, atol=0.8)


def test_widths_are_finite_at_the_ends() -> None:
    """Smooth and rough, equal indices, total reflection, an air gap, grazing and normal, no energy."""
    cosines = np.array([1.0, 0.5, 1e-4])
    for alpha in (0.0, 0.3, 1.0):
        for eta in (1.0, 0.7, 2.5):
            layers = found(
                Interface(eta=1.6, alpha=alpha), Interface(eta=eta, alpha=alpha), Interface(eta=1.6, alpha=0.0)
            )
            for energy in (0.0, 0.3):
                for lobe in roughnesses(layers, cosines, 0 * cosines, np.full((3, 3), energy)):
                    assert all(np.isfinite(x).all() for x in lobe)
                    assert np.all(np.maximum(lobe.alpha_u, lobe.alpha_v) <= 1)


def test_events_of_a_veil_are_those_that_turn_light_by_little() -> None:
    """Shares and half the median angle of draws from Henyey and Greenstein's function."""
    u = (np.arange(100_000) + 0.5) / 100_000
    for g in (0.5, 0.9, 0.98):
        s = (1 - g * g) / (1 - g + 2 * g * u)
        angle = np.arccos((1 + g * g - s * s) / (2 * g))
        assert widths.nearly_straight(HenyeyGreenstein(g)) == pytest.approx(
            np.mean(angle < widths.NEARLY_STRAIGHT), abs=2e-4
        )
        layers = found(Interface(eta=1.5), Medium(sigma_s=0.1, g=g), Interface(conductor="mirror"))
        narrow = widths.Tensor(*(np.full(3, x) for x in (1e-8, 0.0, 1e-8)))
        veil = widths.veil(layers, 1, COSINES, narrow)
        events = 2 * widths.nearly_straight(HenyeyGreenstein(g)) * 0.1 / np.sqrt(1 - (1 - COSINES**2) / 1.5**2)
        median = np.median(angle[angle < widths.NEARLY_STRAIGHT])
        np.testing.assert_allclose(veil.size, 0.5 * median * events / (1 - np.exp(-events)), rtol=5e-3)
    assert widths.nearly_straight(HenyeyGreenstein(0.0)) == widths.nearly_straight(HenyeyGreenstein(-0.5)) == 0


WALKED = {
    "rough base": [Interface(eta=1.6, alpha=0.15), Interface(eta=0.3, k=3.0, alpha=0.35)],
    "rough coat": [Interface(eta=1.4, alpha=0.35), Interface(eta=0.3, k=3.0, alpha=0.05)],
    "two coats": [Interface(eta=1.8, alpha=0.2), Interface(eta=1.3, alpha=0.2), Interface(eta=0.3, k=3.0, alpha=0.2)],
    "brushed": [Interface(eta=1.5, alpha=(0.05, 0.3), rotation=30), Interface(eta=0.3, k=3.0, alpha=(0.3, 0.1))],
    "lacquered": [Interface(eta=1.5, alpha=0.1), Interface(eta=0.3, k=3.0, alpha=(0.3, 0.04), rotation=60)],
    "glass": [Interface(eta=1.5, alpha=0.2), Interface(eta=2.0, alpha=0.2)],
}
PARTED = {
    "a smooth coat": [Interface(eta=1.5), Interface(eta=0.5, k=5.0, alpha=(0.4, 0.05), rotation=120)],
    "a rough coat": [Interface(eta=1.5, alpha=0.17), Interface(eta=0.5, k=5.0, alpha=(0.2, 0.02), rotation=80)],
    "a crossed coat": [
        Interface(eta=1.4, alpha=(0.26, 0.06), rotation=90),
        Interface(eta=0.5, k=5.0, alpha=(0.2, 0.02)),
    ],
    "two crossed coats": [
        Interface(eta=1.65, alpha=(0.35, 0.04), rotation=5),
        Interface(eta=1.58, alpha=(0.35, 0.05), rotation=-75),
        Interface(eta=0.5, k=5.0, alpha=(0.34, 0.05), rotation=5),
    ],
}
ASTRAY = {"a smooth coat": 0.04, "a rough coat": 0.05, "a crossed coat": 0.06, "two crossed coats": 0.05}
FARTHEST = {"brushed": 0.045, "lacquered": 0.04}


def binned(lobe: RefractedLobe, cosine: float, bins: int) -> Array:
    """Light of a lobe on a grid over the projected disc, of energy 1."""
    fine = 8
    x, y = np.meshgrid(*[(np.arange(bins * fine) + 0.5) / (0.5 * bins * fine) - 1] * 2, indexing="ij")
    z = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    wi = np.full(x.shape, np.sqrt(1 - cosine**2)), np.zeros(x.shape), np.full(x.shape, cosine)
    value, _ = refracted_lobe.eval_pdf(lobe, wi, (x, y, z))
    light = np.where(z > 0, value / np.maximum(z, 1e-6), 0).reshape(bins, fine, bins, fine).sum(axis=(1, 3))
    return np.asarray(light / light.sum())


@pytest.mark.parametrize("name", WALKED)
def test_lobes_are_as_wide_as_walks(name: str) -> None:
    """Total variation over 20 x 20 bins, with energies as walked: .05, or `FARTHEST`, of which walks make .01."""
    kernel.require_llvm()
    layers, bins, cosines = WALKED[name], 20, COSINES[1:]
    walked = vt.reference.statistics(Stack(layers), cosines, 0.0, 100_000, 1)
    truth = vt.reference.distribution(Stack(layers), cosines, 0.0, 400_000, 1, bins=bins).reflected.mean(axis=0)
    energies = np.array([energy.mean(axis=0) for energy in walked.energy])
    layers_found = found(*layers)
    shapes = roughnesses(layers_found, cosines, 0 * cosines, energies)
    for i, cosine in enumerate(cosines):
        light = np.zeros((bins, bins))
        n = 1.0
        for k, (layer, shape) in enumerate(zip(layers, shapes)):
            eta = float(np.mean(layer.eta)) / n

            def facets(cos2: Any, eta: float = eta) -> Any:
                return fresnel.dielectric(np.sqrt(cos2), eta)

            def leaving(c: Any) -> Any:
                return 1 - fresnel.dielectric(c, layers[0].eta)

            roughness = Roughness(*(np.broadcast_to(x, cosines.shape)[i] for x in shape))
            lobe = RefractedLobe(1.0, roughness, n, None if layer.k else facets, leaving if k else None)
            light += energies[k, i] * binned(lobe, cosine, bins)
            n *= eta
        if name not in FARTHEST:
            truth[i] = 0.5 * (truth[i] + truth[i][:, ::-1])
        assert 0.5 * np.abs(light - truth[i]).sum() < FARTHEST.get(name, 0.05) * truth[i].sum()


@pytest.mark.parametrize("name", PARTED)
def test_light_of_brushed_metals_goes_where_walks_go(name: str) -> None:
    """Total variation over 20 x 20 bins, of which walks make .01; .079 and .057 below isotropic coats with
    one lobe of the metal, and .068 and .069 below crossed ones."""
    kernel.require_llvm()
    stack, bins, cosine, phi = Stack(PARTED[name]), 20, 0.5, 0.2
    truth = vt.reference.distribution(stack, cosine, phi, 200_000, 1, True, bins=bins).reflected.mean(axis=(0, 1))
    fine = 8
    axis = (np.arange(bins * fine) + 0.5) / (0.5 * bins * fine) - 1
    x, y = (each.ravel() for each in np.meshgrid(axis, axis, indexing="ij"))
    up = x * x + y * y < 1
    wo = x[up], y[up], np.sqrt(1 - x[up] ** 2 - y[up] ** 2)
    sine = np.sqrt(1 - cosine**2)
    wi = tuple(np.array([w]) for w in (sine * np.cos(phi), sine * np.sin(phi), cosine))
    value, _ = named(DEFAULT).lit(Material.of(stack), wi)(np.zeros(up.sum(), int)).eval_pdf(wi, wo)
    light = np.zeros(len(up))
    light[up] = np.mean(value, axis=0) / wo[2] / (0.5 * bins * fine) ** 2
    light = light.reshape(bins, fine, bins, fine).sum(axis=(1, 3))
    if name == "a smooth coat":  # whose mirrored light is narrower than these points
        middle = (np.arange(bins) + 0.5) / (0.5 * bins) - 1
        light, truth = (x * (np.hypot(middle[:, None] + wi[0], middle + wi[1]) > 0.12) for x in (light, truth))
    assert 0.5 * np.abs(light - truth).sum() < ASTRAY[name] * truth.sum()


def test_lobes_are_parted_as_far_as_facets_cross() -> None:
    """A lobe is whole below parallel facets, isotropic ones, and such as make no step of the index."""

    def crossing(eta: float = 1.5, alpha: Any = (0.3, 0.05), rotation: float = 90) -> float:
        coat = Interface(eta=eta, alpha=alpha, rotation=rotation)
        layers = found(coat, Interface(eta=0.2, k=3.0, alpha=(0.2, 0.04)))
        return brushing.crossing([part for part in layers if isinstance(part, Facets)])

    assert crossing(rotation=0) == crossing(alpha=0.2) == crossing(eta=1.0) == 0
    assert crossing(alpha=(0.05, 0.3), rotation=0) == pytest.approx(crossing())
    assert 0 < crossing(rotation=20) < crossing(rotation=45) < crossing() <= 1


def test_light_that_coats_throw_back_is_apart_for_long_facets_alone() -> None:
    """Lobes of isotropic metals are whole, and those below coats that make no step of the index; crossed facets part
    the lobe otherwise."""

    def apart(eta: float = 1.5, across: float = 0.02, coat: Any = 0.1, **base: Any) -> float:
        metal = Interface(**({"eta": 0.2, "k": 3.0} | base), alpha=(0.2, across))
        return brushing.thrown_back(
            [part for part in found(Interface(eta=eta, alpha=coat), metal) if isinstance(part, Facets)]
        )

    assert apart(eta=1.0) == apart(across=0.2) == apart(k=None) == 0
    assert 0 < apart(across=0.17) < apart(across=0.13) < apart(across=0.1) < apart() < 1
    assert 0 < apart(coat=(0.02, 0.2)) < 0.1 * apart() < apart(coat=(0.2, 0.02))
