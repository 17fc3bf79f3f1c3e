"""The plugin `weidlich_wilkie`: it samples what it evaluates, and is what the formula says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import velatura.plugins.weidlich_wilkie as plugin
from velatura import kernel
from velatura.optics import fresnel
from velatura.stack import Interface, Material, Medium, Stack, as_described, dumps, preset

mi = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

kernel.register()

DIRECTIONS = [(cos, phi) for cos in (0.95, 0.6, 0.25) for phi in (0.4, 2.5)]
ROUGH_PRESETS = ("coated-brushed-aluminium", "patinated-silver", "varnished-paint", "turned-brushing")


def material(stack: Stack) -> Any:
    return mi.load_dict({"type": "weidlich_wilkie", "material": dumps(stack, "json")})


def direction(cos_theta: float, phi: float) -> list[float]:
    sin_theta = np.sqrt(1 - cos_theta**2)
    return [float(sin_theta * np.cos(phi)), float(sin_theta * np.sin(phi)), float(cos_theta)]


def value_and_density(bsdf: Any, wi: list[float], wo: list[float]) -> tuple[np.ndarray, float]:
    si, towards = dr.zeros(mi.SurfaceInteraction3f), mi.Vector3f(*wo)
    si.wi = mi.Vector3f(*wi)
    dr.make_opaque(si.wi, towards)  # one kernel for all directions
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, towards)
    return value.numpy()[:, 0], float(pdf[0])


@pytest.mark.parametrize("name", ROUGH_PRESETS)
def test_sampling_follows_the_density(name: str) -> None:
    """Chi-square at six directions; false alarms 1 in 100 for all 24 tests together (Sidak)."""
    sample, pdf = _adapter(material(preset(name)))
    for cos_theta, phi in DIRECTIONS:
        wi = dr.normalize(mi.Vector3f(*direction(cos_theta, phi)))
        dr.make_opaque(wi)
        test = mi.chi2.ChiSquareTest(
            domain=mi.chi2.SphericalDomain(),
            sample_func=lambda u, wi=wi: sample(wi, u),
            pdf_func=lambda wo, wi=wi: pdf(wi, wo),
            sample_dim=3,
            sample_count=200_000,
            res=101,
            ires=8,
            seed=11,
        )
        assert test.run(0.01, len(ROUGH_PRESETS) * len(DIRECTIONS)), test.messages


def _adapter(bsdf: Any) -> tuple[Any, Any]:
    context = mi.BSDFContext()

    def at(wi: Any, count: int) -> Any:
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi = wi
        return si

    def sample(wi: Any, u: Any) -> Any:
        bs, _ = bsdf.sample(context, at(wi, dr.width(u)), u[0], mi.Point2f(u[1], u[2]))
        return bs.wo, dr.select(bs.pdf > 0, 1.0, 0.0)

    return sample, lambda wi, wo: bsdf.pdf(context, at(wi, dr.width(wo)), wo)


@pytest.mark.parametrize("alpha", [(0.1, 0.1), (0.4, 0.15)])
def test_one_conductor_is_roughconductor(alpha: tuple[float, float]) -> None:
    bsdf = material(Stack([Interface(eta=0.2, k=3.9, alpha=alpha)]))
    theirs = mi.load_dict(
        {
            "type": "roughconductor",
            "distribution": "ggx",
            "alpha_u": alpha[0],
            "alpha_v": alpha[1],
            "eta": {"type": "rgb", "value": 0.2},
            "k": {"type": "rgb", "value": 3.9},
        }
    )
    for wi in (direction(0.9, 0.3), direction(0.3, 0.3)):
        for wo in (direction(0.8, 3.0), direction(0.4, 2.0)):
            value, density = value_and_density(bsdf, wi, wo)
            truth, their_density = value_and_density(theirs, wi, wo)
            np.testing.assert_allclose(value, truth, rtol=1e-4)
            assert density == pytest.approx(their_density, rel=1e-4)


def test_two_layers_by_hand() -> None:
    """At the mirror direction the common normal is the surface's own, and every factor is plain."""
    sigma_a = (0.1, 0.5, 2.0)
    alphas, cos_i = (0.2, 0.3), 0.6
    layers = [
        Interface(eta=1.5, alpha=alphas[0]),
        Medium(depth=0.5, sigma_a=sigma_a, sigma_s=3.0),
        Interface(eta=0.2, k=3.9, alpha=alphas[1]),
    ]
    wi, wo = direction(cos_i, 0.0), direction(cos_i, np.pi)
    value, _ = value_and_density(material(Stack(layers)), wi, wo)
    # The formula, with Smith's G1 written out
    cos_t = float(np.sqrt(1 - (1 - cos_i**2) / 1.5**2))

    def g1(cosine: float, alpha: float) -> float:
        return float(2 / (1 + np.sqrt(1 + alpha**2 * (1 / cosine**2 - 1))))

    r_12, r_23 = fresnel.dielectric(cos_i, 1.5), fresnel.conductor(cos_t, 0.2 / 1.5, 3.9 / 1.5)
    g_1, g_2 = g1(cos_i, alphas[0]) ** 2, g1(cos_t, alphas[1]) ** 2
    f_1 = r_12 * g_1 / (np.pi * alphas[0] ** 2 * 4 * cos_i**2)
    f_2 = r_23 * g_2 / (np.pi * alphas[1] ** 2 * 4 * cos_t**2)
    a = np.exp(-0.5 * np.array(sigma_a) * 2 / cos_t)
    t = (1 - g_1) + (1 - r_12) * g_1
    np.testing.assert_allclose(value, (f_1 + (1 - r_12) * a * t * f_2) * cos_i, rtol=1e-5)


@pytest.mark.parametrize("name", ROUGH_PRESETS)
def test_reciprocity(name: str) -> None:
    bsdf, a, b = material(preset(name)), direction(0.8, 0.3), direction(0.35, 2.0)
    there, back = value_and_density(bsdf, a, b)[0] / b[2], value_and_density(bsdf, b, a)[0] / a[2]
    np.testing.assert_allclose(there, back, rtol=1e-4)


def test_it_computes_with_floats_too() -> None:
    stack = Stack([Interface(eta=1.5, alpha=0.2), Interface(conductor="mirror", alpha=0.1)])
    wi, wo = direction(0.8, 0.3), direction(0.7, 3.2)
    by_hand = plugin.evaluate(Material.of(stack, as_described), tuple(wi), tuple(wo))
    np.testing.assert_allclose(value_and_density(material(stack), wi, wo)[0], by_hand, rtol=1e-4)


def test_a_pane_reflects_at_its_last_interface_what_the_index_outside_says() -> None:
    """A thin pane has the exterior below it, as a solid that ends in an interface to that index."""
    layers = [Interface(eta=1.5, alpha=0.2), Interface(eta=1.5, alpha=0.1)]
    wi, wo = direction(0.8, 0.3), direction(0.7, 3.2)
    pane = value_and_density(material(Stack(layers, thin=True)), wi, wo)
    solid = value_and_density(material(Stack([layers[0], Interface(eta=1.0, alpha=0.1)])), wi, wo)
    np.testing.assert_allclose(pane[0], solid[0], rtol=1e-6)
    assert pane[1] == pytest.approx(solid[1])
