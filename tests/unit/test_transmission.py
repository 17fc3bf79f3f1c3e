"""All light that passes, with energies of its own: what is asked for comes out, and samples are good."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import velatura as vt
from velatura import kernel
from velatura.model.solved.sample_allocation import Demand
from velatura.model.solved.transmission import combined, direct
from velatura.model.solved.transmission.combined import Parts
from velatura.model.solved.transmission.direct import Transmission
from velatura.model.variance import variance_kind
from velatura.optics import fresnel, ggx
from velatura.shader.recorder import symbol
from velatura.stack import Material
from velatura.stack.flat_names import Address

Array = NDArray[np.floating]
Direction = tuple[Array, Array, Array]

ROUGH = vt.Stack([vt.Interface(eta=1.5, alpha=0.3)])
INSIDE = vt.Stack([vt.Interface(eta=1.0, alpha=0.4)], exterior=1.5)
PANE = vt.Stack([vt.Interface(eta=1.5, alpha=0.15), vt.Interface(eta=1.0, alpha=0.3)])
MILK = vt.Stack(
    [
        vt.Interface(eta=1.5, alpha=(0.1, 0.3), rotation=30),
        vt.Medium(sigma_s=1.5, sigma_a=(0, 0.1, 0.2), g=0.9),
        vt.Interface(eta=1.0, alpha=0.2),
    ]
)
#: Energies straight through, bounced, of all that passes, and reflected.
ENERGIES = {
    "pane": (PANE, 0.55, 0.1, 0.7, 0.2),
    "milk": (MILK, 0.15, 0.05, 0.6, 0.3),
    "glass": (ROUGH, 0.85, 0.0, 0.9, 0.05),
}


def passage_of(stack: vt.Stack) -> Transmission:
    material = Material.of(stack)
    return direct.transmission(material, variance_kind(material))


def at(cos_theta: float, count: int = 1) -> Direction:
    sine = np.sqrt(1 - cos_theta**2)
    return np.full(count, sine * np.cos(0.5)), np.full(count, sine * np.sin(0.5)), np.full(count, cos_theta)


def parts_of(transmission: Transmission, cos_theta: float, *energies: float) -> Parts:
    straight, bounced, passing, back = (np.full((3, 1), energy) for energy in energies)
    return combined.parts(transmission, at(cos_theta), straight, bounced, passing, Demand.of(back, back, back))[0]


@pytest.mark.parametrize("cos_theta", [0.9, 0.5])
@pytest.mark.parametrize("name", ENERGIES)
def test_samples_carry_the_energy_that_is_asked_for(name: str, cos_theta: float) -> None:
    """Within .005 of it and 4 standard errors; no sample weighs more than three."""
    stack, *energies = ENERGIES[name]
    transmission, rng, count = passage_of(stack), np.random.default_rng(1), 100_000
    of = parts_of(transmission, cos_theta, *energies)
    wi = at(cos_theta, count)
    wo = combined.sample(transmission, of, wi, *rng.random((3, count)))
    value, density = combined.eval_pdf(transmission, of, wi, wo)
    weight = np.where(density > 0, value / np.maximum(density, 1e-30), 0)
    assert weight.max() < 3
    error = 4 * weight[0].std() / np.sqrt(count) + 0.005
    assert abs(of.share[0] * weight[0].mean() - energies[2]) < error


@pytest.mark.parametrize("name", ENERGIES)
def test_the_density_is_that_of_samples(name: str) -> None:
    """Of the cosine, on both sides, in 20 bins of the sphere: within 5 standard errors of either and 1 %."""
    stack, *energies = ENERGIES[name]
    transmission, rng, count = passage_of(stack), np.random.default_rng(2), 200_000
    of, wi = parts_of(transmission, 0.6, *energies), at(0.6, count)
    z = combined.sample(transmission, of, wi, *rng.random((3, count)))[2]
    found, _ = np.histogram(z[z != 0], 20, (-1, 1))
    cosine, phi = rng.uniform(-1, 1, count), rng.uniform(0, 2 * np.pi, count)
    sine = np.sqrt(1 - cosine**2)
    _, density = combined.eval_pdf(transmission, of, wi, (sine * np.cos(phi), sine * np.sin(phi), cosine))
    each = 4 * np.pi * density / of.share[0]
    expected, _ = np.histogram(cosine, 20, (-1, 1), weights=each)
    squares, _ = np.histogram(cosine, 20, (-1, 1), weights=each**2)
    np.testing.assert_array_less(np.abs(found - expected), 5 * np.sqrt(found + squares) + 0.01 * found + 1)


@pytest.mark.parametrize("stack", [ROUGH, INSIDE], ids=["rough", "inside"])
def test_a_rough_dielectric_is_sampled_as_mitsuba_samples_it(stack: vt.Stack) -> None:
    """One interface whose facets are met once: nothing else is sampled, and weights, reflected ones included, are G1 of
    where light goes: as noisy as Mitsuba's to 1 %."""
    mi = kernel.mitsuba("llvm_ad_rgb")
    import drjit as dr

    transmission, rng, count = passage_of(stack), np.random.default_rng(3), 2**16
    alpha, eta = np.ravel(stack.interfaces[0].alpha)[0], 1.5 if stack is ROUGH else 1 / 1.5
    glass = {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha, "int_ior": eta, "ext_ior": 1.0}
    theirs = mi.load_dict(glass)
    for cos_theta in (0.9, 0.3):
        straight, *_ = direct.integrals(transmission, at(cos_theta))
        nothing = Demand.of(0 * straight, 0 * straight, 0 * straight)
        of, _ = combined.parts(transmission, at(cos_theta), straight, 0 * straight, straight, nothing)
        np.testing.assert_allclose(of.share, 1)
        wi, u = at(cos_theta, count), rng.random((3, count))
        wo = combined.sample(transmission, of, wi, *u)
        value, density = combined.eval_pdf(transmission, of, wi, wo)
        h = ggx.normalize((wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]))
        f = fresnel.dielectric(np.clip(ggx.dot(wi, h), 0, 1), eta)
        reflected = f * ggx.ndf(h, alpha, alpha) * ggx.masking(wi, alpha, alpha) * ggx.masking(wo, alpha, alpha)
        lit = value[0] + np.where(wo[2] > 0, reflected / (4 * wi[2]), 0)
        weight = np.where(density > 0, lit / np.maximum(density, 1e-30), 0)
        assert weight.max() < 1.001
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi = mi.Vector3f(*wi)
        context = mi.BSDFContext(mi.TransportMode.Importance)
        _, known = theirs.sample(context, si, mi.Float(u[0]), mi.Point2f(u[1:]))
        known = np.array(known)[0]
        assert abs(weight.mean() - known.mean()) < 0.01
        assert weight.std() < known.std() + 0.01


def test_what_a_lobe_cannot_carry_goes_with_the_others() -> None:
    """Deep beyond the critical angle of a slab no single facet lets light out; all the energy passes nevertheless."""
    stack = vt.Stack([vt.Interface(eta=1.2, alpha=0.3), vt.Interface(eta=1.0, alpha=0.3)], exterior=1.5)
    transmission = passage_of(stack)
    energy, *_ = direct.integrals(transmission, at(0.5))
    assert energy.max() < 0.03
    of = parts_of(transmission, 0.5, 0.2, 0.0, 0.2, 0.8)
    assert np.all(of.straight <= combined.MAX_GAIN) and np.all(of.bounced <= combined.MAX_GAIN)
    rng, count = np.random.default_rng(4), 50_000
    wi = at(0.5, count)
    value, density = combined.eval_pdf(
        transmission, of, wi, combined.sample(transmission, of, wi, *rng.random((3, count)))
    )
    weight = np.where(density > 0, value / np.maximum(density, 1e-30), 0)[0]
    assert abs(of.share[0] * weight.mean() - 0.2) < 0.005


def test_drjit_agrees_with_numpy() -> None:
    """In single precision: value, density and samples, of a brushed and scattering pane."""
    mi = kernel.mitsuba("llvm_ad_rgb")

    def value_of(address: Address, value: Any) -> Any:
        return mi.Color3f(value) if address.colour else mi.Float(float(value))

    stack, *energies = ENERGIES["milk"]
    count, rng = 300, np.random.default_rng(5)
    wi, u = at(0.6, count), rng.random((3, count))
    material = Material.of(stack)
    kind = variance_kind(material)
    ours, theirs = (direct.transmission(m, kind) for m in (material, Material.of(stack, value_of)))
    of = replace(parts_of(ours, 0.6, *energies), even=0.9, grazing=0.5, once=0.8, twice=0.2)
    each = (np.ravel(x) for x in vars(of).values())
    of_theirs = Parts(*(mi.Color3f(*map(float, x)) if len(x) == 3 else mi.Float(x) for x in each))
    wi_theirs, u_theirs = (tuple(mi.Float(x) for x in w) for w in (wi, u))
    wo = combined.sample(ours, of, wi, *u)
    found = np.array(combined.sample(theirs, of_theirs, wi_theirs, *u_theirs))
    assert np.mean(np.abs(found - np.array(wo)).max(0) < 1e-3) > 0.99
    expected = combined.eval_pdf(ours, of, wi, wo)
    for a, b in zip(combined.eval_pdf(theirs, of_theirs, wi_theirs, tuple(mi.Float(x) for x in wo)), expected):
        np.testing.assert_allclose(np.array(a), b, rtol=5e-3, atol=1e-4)


def test_it_is_recorded_for_shaders() -> None:
    """Value, density and a sample of a brushed and scattering pane, from symbols; evaluated, they are checked with the
    shaders that read them."""

    def value_of(address: Address, value: Any) -> Any:
        return symbol.colour(address.name) if address.colour else symbol.number(address.name)

    transmission = direct.transmission(Material.of(MILK, value_of), variance_kind(Material.of(MILK)))
    colours, numbers = ([make(f"of.{make.__name__}{k}") for k in range(3)] for make in (symbol.colour, symbol.number))
    wi, wo, u = (tuple(symbol.number(f"{name}.{axis}") for axis in "xyz") for name in ("wi", "wo", "u"))
    of = Parts(*colours, *numbers)
    value, density = combined.eval_pdf(transmission, of, wi, wo)
    drawn = combined.sample(transmission, of, wi, *u)
    assert all(isinstance(x, symbol.Symbol) for x in (value, density, *drawn))
