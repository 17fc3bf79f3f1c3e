"""Metals whose index was measured, in the RGB variants of the plugins."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.optics import fresnel
from velatura.renderer.packets import aligned
from velatura.stack import Named, Stack, dumps, rgb, spectrum, srgb_weights

mi = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

pytestmark = pytest.mark.usefixtures("one_thread")

COAT, COPPER = vt.Interface(eta=1.5, alpha=0.1), vt.Interface(conductor="Cu", alpha=0.3)
COATED = Stack([COAT, COPPER])
PLAIN = {f"layer1_{part}": rgb(Named("Cu", part)) for part in ("eta", "k")}
WI, WO = (0.5, 0.2, 0.8), (-0.45, -0.25, 0.75)


def value(bsdf: Any) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = dr.normalize(mi.Vector3f(*WI))
    dr.make_opaque(si)
    return bsdf.eval(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(*WO)))


def albedo(bsdf: Any, cosine: float, count: int = 1) -> np.ndarray:
    """The mean weight of samples."""
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(float(np.sqrt(1 - cosine**2)), 0.0, cosine)
    dr.make_opaque(si.wi)  # one kernel for all angles
    u = np.random.default_rng(5).random((3, count))
    return np.array(bsdf.sample(mi.BSDFContext(), si, mi.Float(aligned(u[0])), mi.Point2f(u[1:]))[1]).mean(axis=1)


def test_a_metal_is_measured_until_its_index_is_set() -> None:
    """Expected: other values may change; a set eta makes it one of colours, and its first one measured again."""
    bsdf, plain = vt.bsdf(COATED), vt.bsdf(COATED.replace(**PLAIN))
    measured = np.array(value(bsdf))
    assert not np.allclose(measured, value(plain), rtol=0.01)
    parameters = mi.traverse(bsdf)
    parameters["layer0_alpha_u"] = parameters["layer0_alpha_v"] = 0.2
    parameters.update()
    expected = value(vt.bsdf(COATED.replace(layer0_alpha=0.2)))
    np.testing.assert_allclose(value(bsdf), expected, rtol=1e-5)
    parameters["layer0_alpha_u"] = parameters["layer0_alpha_v"] = 0.1
    first, changed = mi.Color3f(parameters["layer1_eta"]), mi.Color3f(0.3, 0.8, 1.1)
    parameters["layer1_eta"] = changed
    parameters.update()
    expected = value(vt.bsdf(COATED.replace(**{**PLAIN, "layer1_eta": (0.3, 0.8, 1.1)})))
    np.testing.assert_allclose(value(bsdf), expected, rtol=1e-5)
    parameters["layer1_eta"] = first
    parameters.update()
    np.testing.assert_allclose(value(bsdf), measured, rtol=1e-5)


def test_a_metal_that_is_differentiated_is_one_of_colours() -> None:
    """Expected: value and slopes of the same metal in numbers, and again its spectrum once it is not."""
    found = []
    for bsdf in (vt.bsdf(COATED), vt.bsdf(COATED.replace(**PLAIN))):
        parameters = mi.traverse(bsdf)
        dr.enable_grad(parameters["layer1_k"])
        parameters.update()
        seen = value(bsdf)
        dr.backward(dr.sum(seen))
        slope = np.array(dr.grad(parameters["layer1_k"]))
        dr.disable_grad(parameters["layer1_k"])
        parameters.update()
        found.append((np.array(seen), slope, np.array(value(bsdf))))
    (seen, slope, again), (expected, expected_slope, same) = found
    np.testing.assert_allclose(seen, expected, rtol=1e-5)
    np.testing.assert_allclose(slope, expected_slope, rtol=1e-4)
    assert np.all(slope != 0) and not np.allclose(again, same, rtol=0.01)


def test_a_smooth_stack_reflects_the_spectrum() -> None:
    """Expected: Fresnel's laws over all bounces at every wavelength, and no more than all light of a bare mirror of
    gold, whose red lies outside sRGB; the walk has that, too."""
    nm, weights = srgb_weights()
    eta, k = (np.interp(nm, *spectrum(Named("Au", part))) for part in ("eta", "k"))
    cosine = 0.7
    inside = float(fresnel.cos_transmitted(cosine, 1.5))
    above, metal = fresnel.dielectric(cosine, 1.5), fresnel.conductor(inside, eta / 1.5, k / 1.5)
    expected = weights @ (above + (1 - above) ** 2 * metal / (1 - above * metal))
    gold = vt.Interface(conductor="Au")
    coated, bare = Stack([vt.Interface(eta=1.5), gold]), Stack([gold])
    np.testing.assert_allclose(albedo(vt.bsdf(coated), cosine), np.minimum(expected, 1), rtol=0.01)
    np.testing.assert_allclose(albedo(vt.bsdf(coated, "reference"), cosine, 200_000), expected, rtol=0.01)
    mirror = weights @ fresnel.conductor(cosine, eta, k)
    np.testing.assert_allclose(albedo(vt.bsdf(bare), cosine), np.minimum(mirror, 1), rtol=5e-3)
    np.testing.assert_allclose(albedo(vt.bsdf(bare, "reference"), cosine), mirror, rtol=5e-3)


def test_a_texture_above_a_metal_leaves_its_spectrum() -> None:
    """Expected: albedos within .005 of those of the uniform roughness, which is the same at every texel; again so once
    an index has been differentiated."""
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(np.full((2, 2, 1), 0.2, np.float32)), "raw": True}
    varying = {"type": "bitmap", "bitmap": mi.Bitmap(np.float32([[[0.2], [0.2]], [[0.2], [0.3]]])), "raw": True}
    expected = albedo(vt.bsdf(COATED.replace(layer0_alpha=0.2)), 0.7, 20_000)
    for given in (texture, varying):
        bsdf = mi.load_dict({"type": "layered", "material": dumps(COATED, "json"), "layer0_alpha": given})
        np.testing.assert_allclose(albedo(bsdf, 0.7, 20_000), expected, atol=5e-3)
    parameters = mi.traverse(bsdf)
    dr.enable_grad(parameters["layer1_k"])
    parameters.update()
    assert np.abs(albedo(bsdf, 0.7, 20_000) - expected).max() > 0.02
    dr.disable_grad(parameters["layer1_k"])
    parameters.update()
    np.testing.assert_allclose(albedo(bsdf, 0.7, 20_000), expected, atol=5e-3)


def test_in_one_channel_it_has_the_luminance_of_its_colours() -> None:
    """Expected: that of the three channels, within 1 %, of the model and of the walk."""
    found = vt.lobes(COATED, 0.7)
    expected = np.array([0.212671, 0.715160, 0.072169]) @ (sum(found.energy) + found.remainder)
    try:
        kernel.mitsuba("llvm_ad_mono")
        vt.register()
        for model in ("velatura", "reference"):
            options = {"microsurface": True} if model == "reference" else {}
            np.testing.assert_allclose(albedo(vt.bsdf(COATED, model, **options), 0.7, 100_000), expected, rtol=0.01)
    finally:
        kernel.mitsuba("llvm_ad_rgb")


def test_a_walk_estimates_by_its_samples_and_by_its_values() -> None:
    """Expected: `eval`, summed over directions, is what samples carry, within 1.5 %: below a medium whose channels
    differ, of gold, which has them negative in single estimates."""
    medium = vt.Medium(sigma_a=(0.1, 0.2, 0.3))
    bsdf = vt.bsdf(Stack([COAT, medium, vt.Interface(conductor="Au", alpha=0.3)]), "reference", microsurface=True)
    count, rng = 400_000, np.random.default_rng(9)
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(0.6, 0.0, 0.8)
    wo = mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.random((2, count))))
    si.uv = mi.Point2f(rng.random((2, count)))
    values = np.array(bsdf.eval(mi.BSDFContext(), si, wo) / mi.warp.square_to_cosine_hemisphere_pdf(wo)).mean(axis=1)
    np.testing.assert_allclose(values, albedo(bsdf, 0.8, 200_000), rtol=0.015)


def test_scalar_variants_walk_and_solve_as_others_do() -> None:
    """Expected: the value of the model to rounding, and finite walks."""
    expected = np.array(value(vt.bsdf(COATED)))
    try:
        kernel.mitsuba("scalar_rgb")
        vt.register()
        si = mi.SurfaceInteraction3f()
        si.wi, wo = (mi.Vector3f(w) / np.linalg.norm(w) for w in (WI, WO))
        found = np.array(vt.bsdf(COATED).eval(mi.BSDFContext(), si, wo))
        walked = np.array(vt.bsdf(COATED, "reference").eval(mi.BSDFContext(), si, wo))
    finally:
        kernel.mitsuba("llvm_ad_rgb")
    np.testing.assert_allclose(found, expected.ravel(), rtol=1e-4)
    assert walked.shape == (3,) and np.isfinite(walked).all()
