"""Light that passes after bounces and scattering: densities, integrals, and limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import velatura as vt
from velatura.model.solved.lobes import refracted_lobe
from velatura.model.solved.transmission import direct, internal_reflections
from velatura.model.solved.transmission.direct import Transmission
from velatura.model.solved.transmission.internal_reflections import Rest
from velatura.model.variance import variance_kind
from velatura.stack import Material

Array = NDArray[np.floating]
Direction = tuple[Array, Array, Array]

ROUGH = vt.Stack([vt.Interface(eta=1.5, alpha=0.3)])
PANE = vt.Stack([vt.Interface(eta=(1.4, 1.5, 1.6), alpha=(0.1, 0.3)), vt.Interface(eta=1.0, alpha=0.2)])


def milk(g: float, depth: float, cut: int = 1) -> vt.Stack:
    parts: list[Any] = [vt.Interface(eta=1.5), vt.Medium(sigma_s=depth / cut, g=g)] * cut
    return vt.Stack([vt.Interface(eta=1.5, alpha=0.1), *parts[1:], vt.Interface(eta=1.2, alpha=0.2)])


def passage_of(stack: vt.Stack) -> Transmission:
    material = Material.of(stack)
    return direct.transmission(material, variance_kind(material))


def at(cos_theta: float, count: int = 1) -> Direction:
    sine = np.sqrt(1 - cos_theta**2)
    return np.full(count, sine * np.cos(0.5)), np.full(count, sine * np.sin(0.5)), np.full(count, cos_theta)


@pytest.mark.parametrize(
    "stack",
    [ROUGH, PANE, milk(0.9, 1), milk(0.5, 1.5), milk(0.2, 3)],
    ids=["rough", "pane", "forwards", "diffuse in part", "diffuse"],
)
def test_the_rest_has_the_energy_and_the_share_of_its_densities(stack: vt.Stack) -> None:
    """Sampled, against the quadrature of the energy and a mean of the density over the sphere: within 5 standard
    errors and 0.005."""
    transmission, rng, count = passage_of(stack), np.random.default_rng(1), 100_000
    for cos_theta in (0.9, 0.4):
        wi = at(cos_theta, count)
        found, i = internal_reflections.rest(transmission, wi), internal_reflections.seen_below(transmission, wi)
        o = internal_reflections.sample_rest(found, i, *rng.random((3, count)))
        value, density = internal_reflections.eval_pdf_rest(found, i, o)
        weight = np.atleast_2d(np.where(density > 0, value / np.maximum(density, 1e-30), 0))
        wi = at(cos_theta)
        energy = internal_reflections.integral_rest(
            internal_reflections.rest(transmission, wi), internal_reflections.seen_below(transmission, wi)
        )
        error = 5 * weight.std(1) / np.sqrt(count) + 0.005
        assert np.all(np.abs(weight.mean(1) - energy[:, 0]) < error)
        z, phi = rng.uniform(0, 1, count), rng.uniform(0, 2 * np.pi, count)
        r = np.sqrt(1 - z * z)
        _, density = internal_reflections.eval_pdf_rest(found, i, (r * np.cos(phi), r * np.sin(phi), z))
        share = 2 * np.pi * density
        assert abs(share.mean() - np.mean(o[2] > 0)) < 5 * share.std() / np.sqrt(count) + 0.005


def test_scattering_becomes_diffuse_without_a_jump() -> None:
    """By depth, and by direction: the share of diffuse light changes by less than a hundredth where depth and cosine
    change by a thousandth, and has all values."""
    depths, shares = np.geomspace(0.9, 6, 1900), []
    for depth in depths:
        shares.append(float(np.mean(internal_reflections.rest(passage_of(milk(0.6, depth)), at(0.7)).diffuse)))
    assert shares[0] == 0 and shares[-1] > 0.999
    assert np.diff(shares).max() < 0.01 and np.diff(shares).min() >= 0
    cosine = np.linspace(0.1, 1, 900)
    wi = np.sqrt(1 - cosine**2), 0 * cosine, cosine
    around = np.asarray(internal_reflections.rest(passage_of(milk(0.6, 2)), wi).diffuse)
    assert np.ptp(around) > 0.1 and np.abs(np.diff(around)).max() < 0.01


def test_light_that_bounces_is_about_the_direction_that_light_goes_on_in() -> None:
    """Brightest for a pane where light goes straight on; a single interface has none."""
    assert internal_reflections.bounced(passage_of(ROUGH), at(0.7)) is None
    transmission = passage_of(PANE)
    wi = at(0.7)
    lobe = internal_reflections.bounced(transmission, wi)
    assert lobe
    np.testing.assert_allclose(internal_reflections.seen_below(transmission, wi), wi, atol=1e-12)
    z, phi = (x.ravel() for x in np.meshgrid(np.linspace(0.01, 1, 200), np.linspace(0, 2 * np.pi, 201)))
    r = np.sqrt(1 - z * z)
    wo = r * np.cos(phi), r * np.sin(phi), z
    value, _ = refracted_lobe.eval_pdf(lobe, at(0.7, z.size), wo)
    brightest = np.argmax(value[1] / z)
    assert np.hypot(wo[0][brightest] + wi[0], wo[1][brightest] + wi[1]) < 0.1
    assert lobe.roughness.alpha_u < lobe.roughness.alpha_v


def test_scattering_widens_until_it_is_diffuse() -> None:
    """By asymmetry, and by depth; a medium cut in four is the same, and none scatters nothing."""

    def found(stack: vt.Stack) -> Rest:
        rest = internal_reflections.rest(passage_of(stack), at(0.8))
        assert isinstance(rest, Rest)
        return rest

    def alpha(stack: vt.Stack) -> float:
        lobe = found(stack).lobe
        assert lobe
        return float(lobe.roughness.alpha_u[0])

    assert alpha(milk(0.99, 1)) < alpha(milk(0.95, 1)) < alpha(milk(0.95, 6)) < alpha(milk(0.8, 6))
    assert found(milk(0.99, 1)).diffuse == 0 and found(milk(0.1, 1)).diffuse == found(milk(-0.5, 1)).diffuse == 1
    np.testing.assert_allclose(alpha(milk(0.9, 2, cut=4)), alpha(milk(0.9, 2)), rtol=1e-12)
    assert found(PANE).lobe is None and found(PANE).diffuse == 1
    np.testing.assert_allclose(alpha(milk(0.9, 1e-9)), alpha(milk(0.9, 1e-4)), rtol=1e-3)


def test_light_of_the_pane_leaves_within_the_cone_of_its_rarest_medium() -> None:
    """From 1.5 into 2, through a smooth interface below the last rough one: up to a sine of 0.75, none beyond."""
    stack = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(eta=2.0, alpha=0)])
    material = Material.of(stack)
    transmission = direct.transmission(material, variance_kind(material), rough=0)
    sine = np.array([0.2, 0.74, 0.76, 0.99])
    wi, o = at(0.5, 4), (sine, 0 * sine, np.sqrt(1 - sine * sine))
    value, density = internal_reflections.eval_pdf_rest(
        internal_reflections.rest(transmission, wi), internal_reflections.seen_below(transmission, wi), o
    )
    assert ((value > 0) == [True, True, False, False]).all() and ((density > 0) == (value > 0)).all()


def test_grazing_light_and_light_beyond_the_critical_angle_is_finite() -> None:
    for stack in (PANE, milk(0.9, 1), vt.Stack([vt.Interface(eta=1.0, alpha=0.2)], exterior=1.5)):
        transmission = passage_of(stack)
        for cos_theta in (1e-6, 0.1, 0.5, 1.0):
            wi = at(cos_theta)
            found, i = internal_reflections.rest(transmission, wi), internal_reflections.seen_below(transmission, wi)
            assert np.isfinite(internal_reflections.integral_rest(found, i)).all()
            for o in (at(1e-6), at(0.5), at(1.0)):
                assert all(np.isfinite(x).all() for x in internal_reflections.eval_pdf_rest(found, i, o))
