"""What `vt.lobes` reports of a material that is solved as a whole, against exact limits, quadrature and walks."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import velatura as vt
from velatura.model.solved import equivalent_roughness
from velatura.model.solved.lobes import refracted_lobe
from velatura.model.solved.lobes.refracted_lobe import RefractedLobe
from velatura.model.variance import Roughness
from velatura.optics import fresnel
from velatura.reference import roughness
from velatura.stack import Interface, Medium, Stack

Array = NDArray[np.floating]

COSINES = np.array([1.0, 0.6, 0.2])
REFLECTANCES = ("fgd", "fgd-multi")


@pytest.mark.parametrize("reflectance", REFLECTANCES)
@pytest.mark.parametrize("eta", [1.1, 1.5, 0.7])
def test_a_smooth_interface_is_fresnel(reflectance: str, eta: float) -> None:
    found = vt.lobes(Stack([Interface(eta=eta)]), COSINES, reflectance=reflectance)
    expected = np.broadcast_to(fresnel.dielectric(COSINES, eta), (3, 3))
    np.testing.assert_allclose(found.energy[0], expected, atol=1e-6)
    np.testing.assert_allclose(found.passed, 1 - expected, atol=1e-6)
    assert found.transmitted is not None
    assert not found.alpha[0].any() and not found.own_alpha[0].any() and not found.transmitted.alpha.any()
    assert np.abs(found.remainder).max() < 1e-6


@pytest.mark.parametrize("reflectance", REFLECTANCES)
def test_a_smooth_coat_over_a_mirror_is_a_geometric_series(reflectance: str) -> None:
    sigma = 0.4
    coat = [Interface(eta=1.5), Medium(sigma_a=sigma, depth=1.0), Interface(conductor="mirror")]
    found = vt.lobes(Stack(coat), COSINES, reflectance=reflectance)
    r, inside = fresnel.dielectric(COSINES, 1.5), np.sqrt(1 - (1 - COSINES**2) / 1.5**2)
    t = np.exp(-2 * sigma / inside)
    base = (1 - r) ** 2 * t / (1 - r * t)
    np.testing.assert_allclose(found.energy[1][0], base, atol=1e-6)
    np.testing.assert_allclose(found.absorbed[0], 1 - r - base, atol=1e-6)
    assert not found.alpha[1].any()


@pytest.mark.parametrize("name", ["coated-gold", "frosted-glass", "opal-glass", "glossy-plastic"])
@pytest.mark.parametrize("model", ["velatura", "bati2021"])
def test_all_light_is_accounted_for(name: str, model: str) -> None:
    found = vt.lobes(name, COSINES, model=model)
    total = sum(found.energy) + found.remainder + found.passed + found.absorbed
    np.testing.assert_allclose(total, np.ones((3, 3)), atol=2e-3)
    assert all((energy >= 0).all() for energy in (found.remainder, found.passed, found.absorbed))
    if found.transmitted:
        np.testing.assert_array_equal(found.transmitted.energy, found.passed)
    assert (name in ("frosted-glass", "opal-glass")) == bool(found.passed.any())


def test_a_lossless_pane_absorbs_nothing() -> None:
    assert vt.lobes("frosted-glass", COSINES).absorbed.max() < 2e-3


@pytest.mark.parametrize("reflectance", REFLECTANCES)
@pytest.mark.parametrize("where", [0, 1, 2])
def test_an_interface_without_a_step_changes_nothing(where: int, reflectance: str) -> None:
    layers = [
        Interface(eta=1.5, alpha=0.2),
        Medium(sigma_a=0.1),
        Interface(conductor="Au", alpha=(0.1, 0.3), rotation=30),
    ]
    before = vt.lobes(Stack(layers), COSINES, 0.3, reflectance=reflectance)
    layers.insert(where, Interface(eta=1.5 if where else 1.0, alpha=0.4))
    after = vt.lobes(Stack(layers), COSINES, 0.3, reflectance=reflectance)
    k = min(where, 1)
    assert not after.energy[k].any()
    np.testing.assert_allclose(after.alpha[k], 0.4)
    for field in ("energy", "alpha", "own_alpha", "covariance"):
        others = [value for place, value in enumerate(getattr(after, field)) if place != k]
        np.testing.assert_allclose(others, getattr(before, field), rtol=1e-9)
    np.testing.assert_allclose(after.remainder, before.remainder, rtol=1e-9)


def test_a_last_interface_without_a_step_has_its_own_roughness() -> None:
    found = vt.lobes(Stack([Interface(eta=1.5, alpha=0.2), Interface(eta=1.5, alpha=1e-4)]), COSINES)
    alone = vt.lobes(Stack([Interface(eta=1.5, alpha=0.2)]), COSINES)
    np.testing.assert_array_equal(found.alpha[1], 1e-4)
    assert not found.energy[1].any()
    np.testing.assert_allclose(found.energy[0], alone.energy[0], rtol=1e-12)
    np.testing.assert_allclose(found.passed, alone.passed, rtol=1e-12)


def test_models_that_draw_lobes_outside_say_so() -> None:
    found = vt.lobes("glossy-plastic", COSINES, model="bati2021")
    np.testing.assert_array_equal(found.own_alpha, found.alpha)
    np.testing.assert_array_equal(found.own_rotation, found.rotation)
    assert found.remainder.min() > 0  # of the diffuse base


def test_refraction_spreads_narrow_lobes_by_the_index() -> None:
    """At the normal, slopes of half-vectors grow as angles do."""
    found = vt.lobes(Stack([Interface(eta=1.5), Interface(conductor="Au", alpha=0.02)]), 1.0)
    np.testing.assert_allclose(found.alpha[1], 1.5 * found.own_alpha[1], rtol=0.01)


# Equivalents outside


def leaving(cosine: Array) -> Array:
    return 1 - fresnel.dielectric(cosine, 1.6)


@pytest.mark.parametrize(("n", "alpha"), [(1.6, (0.1, 0.1)), (1.6, (0.3, 0.15)), (1.3, (0.1, 0.4))])
def test_equivalents_are_those_of_the_reference(n: float, alpha: tuple[float, float]) -> None:
    """Of many random samples, by medians and a search of the reference's own; its medians have steps."""
    lobe = RefractedLobe(1.0, Roughness(*alpha, 0.0), n, None, leaving)
    sine = np.sqrt(1 - COSINES**2)
    wi = sine, 0 * sine, COSINES
    each = RefractedLobe(1.0, Roughness(*(np.full(3, a) for a in (*alpha, 0.0))), n, None, leaving)
    found = equivalent_roughness.roughness(equivalent_roughness.of_lobe(each, wi), np.zeros(3))
    u1, u2 = np.random.default_rng(5).random((2, 200_000))
    for k, one in enumerate(np.stack(wi, axis=-1)):
        i = tuple(np.full(len(u1), x) for x in one)
        wo = refracted_lobe.sample(lobe, i, u1, u2)
        value, density = refracted_lobe.eval_pdf(lobe, i, wo)
        weight = np.divide(value, density, out=np.zeros_like(value), where=density > 0)
        above = weight > 0
        slopes = roughness.slopes(one, np.stack(wo)[:, above])
        target, _ = roughness.medians(slopes, weight[above], False)
        expected = roughness.matching(one, target, False)
        np.testing.assert_allclose([found.alpha_u[k], found.alpha_v[k]], expected, rtol=0.03)


def test_a_lobe_outside_is_its_own_equivalent() -> None:
    sine = np.sqrt(1 - COSINES**2)
    lobe = RefractedLobe(1.0, Roughness(np.full(3, 0.3), np.full(3, 0.1), np.full(3, 0.5)))
    found = equivalent_roughness.roughness(equivalent_roughness.of_lobe(lobe, (sine, 0 * sine, COSINES)))
    np.testing.assert_allclose([found.alpha_u, found.alpha_v], [[0.3] * 3, [0.1] * 3], rtol=0.01)
    np.testing.assert_allclose(found.rotation, 0.5, atol=0.02)


@pytest.mark.parametrize("phi", [0.4, 2.0])
def test_an_isotropic_pane_is_alike_from_all_sides(phi: float) -> None:
    before, after = (vt.lobes("frosted-glass", COSINES, azimuth) for azimuth in (0.0, phi))
    for a, b in zip([*before.alpha, before.transmitted.alpha], [*after.alpha, after.transmitted.alpha]):  # type: ignore[union-attr]
        np.testing.assert_allclose(a, b, rtol=1e-9)


def test_roughnesses_are_those_of_walks() -> None:
    """Facets are met once: light of lobes is what walks sort by interface. Noise is below .01 in each roughness."""
    stack = Stack(
        [
            Interface(eta=1.5, alpha=(0.05, 0.15)),
            Medium(sigma_a=0.2, depth=1.0),
            Interface(conductor="Au", alpha=(0.3, 0.1)),
        ]
    )
    found = vt.lobes(stack, COSINES[:2], reflectance="fgd")
    truth = vt.reference.statistics(stack, COSINES[:2], paths=100_000, seed=2)
    np.testing.assert_allclose(found.energy[1], truth.energy[1], rtol=0.02)
    assert np.abs(np.log(found.alpha[1] / truth.alpha[1])).max() < 0.1


def test_the_roughness_of_what_a_pane_passes_is_that_of_walks() -> None:
    stack = Stack([Interface(eta=1.5, alpha=0.3)])
    found = vt.lobes(stack, COSINES[:2], reflectance="fgd").transmitted
    truth = vt.reference.statistics(stack, COSINES[:2], paths=100_000, seed=2).transmitted
    assert found is not None and truth is not None
    np.testing.assert_allclose(found.energy, truth.energy, rtol=0.01)
    assert abs(np.log(found.alpha.mean(axis=0) / truth.alpha[0])).max() < 0.1


def test_roughness_outside_has_no_steps() -> None:
    """Of a wide lobe in a dense medium, part of whose light is totally reflected: it grows steadily with its own."""
    alpha = np.linspace(0.22, 0.34, 61)
    lobe = RefractedLobe(1.0, Roughness(alpha, alpha, 0 * alpha), 2.15, None, leaving)
    found = equivalent_roughness.roughness(
        equivalent_roughness.of_lobe(lobe, (0 * alpha, 0 * alpha, 1 + 0 * alpha)), 0 * alpha
    )
    slopes = np.diff(found.alpha_u) / np.diff(alpha)
    assert slopes.min() > 0 and slopes.max() < 2
