"""The plugin `layered` where light passes through: both sides, both hemispheres, radiance and its adjoint."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.renderer.packets import aligned

mi = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

pytestmark = pytest.mark.usefixtures("one_thread")

GLASS = vt.Stack([vt.Interface(eta=1.5)])
PANE = vt.Stack([vt.Interface(eta=1.5), vt.Interface(eta=1.5)], thin=True)
ROUGH = vt.Stack([vt.Interface(eta=1.5, alpha=0.02)])
PLAIN = {"model": "belcour2018", "reflectance": "fresnel", "tir": "off"}


def interaction(cos_theta: Any, count: int = 1) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    cosine = mi.Float(cos_theta)
    dr.make_opaque(cosine)  # one kernel for all angles
    si.wi = mi.Vector3f(dr.sqrt(1 - cosine * cosine), 0, cosine)
    si.sh_frame, si.n = mi.Frame3f([0, 0, 1]), mi.Normal3f(0, 0, 1)
    return si


def sampled(bsdf: Any, cos_theta: float, count: int = 2**17, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3) and energies (n,) in green; radiance times squared index is energy."""
    u = np.random.default_rng(seed).random((3, count))
    si = interaction(cos_theta, count)
    bs, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(aligned(u[0])), mi.Point2f(u[1:]))
    return np.array(bs.wo).T, np.array(weight[1] * bs.eta * bs.eta)


@pytest.mark.usefixtures("few_samples")
@pytest.mark.parametrize(
    ("name", "form"), [("frosted-glass", "forward"), ("opal-glass", "forward"), ("tinted-plate", "symmetric")]
)
def test_the_laws(name: str, form: str) -> None:
    """Energy, chi-square, normalisation, agreement in both hemispheres from both sides; false alarms 1 in 1000."""
    report = vt.check(name, form=form)
    assert report.passed, report.broken


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize("cos_theta", [1.0, 0.4, -0.9, -0.5])
def test_smooth_glass_is_dielectric(cos_theta: float, mode: str) -> None:
    """Directions, weights, indices and kinds, reflected and refracted, with total reflection at cosine -0.5."""
    ours, theirs = vt.bsdf(GLASS, **PLAIN), mi.load_dict({"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0})
    si = interaction(cos_theta)
    for kind in (mi.BSDFFlags.DeltaReflection, mi.BSDFFlags.DeltaTransmission, mi.BSDFFlags.All):
        ctx = mi.BSDFContext(getattr(mi.TransportMode, mode))
        ctx.type_mask = +kind
        for u in (0.01, 0.99):
            # Both pick by energy, each in an order of its own
            a, weight_a = ours.sample(ctx, si, mi.Float(1 - u), mi.Point2f(0.5, 0.5))
            b, weight_b = theirs.sample(ctx, si, mi.Float(u), mi.Point2f(0.5, 0.5))
            np.testing.assert_allclose(np.array(weight_a), np.array(weight_b), atol=1e-4)
            if np.max(np.array(weight_b)) > 0:
                np.testing.assert_allclose(np.array(a.wo), np.array(b.wo), atol=1e-4)
                np.testing.assert_allclose([a.eta[0], a.pdf[0]], [b.eta[0], b.pdf[0]], rtol=1e-3)
                assert a.sampled_type == b.sampled_type and a.sampled_component == b.sampled_component


@pytest.mark.parametrize("cos_theta", [1.0, 0.6, 0.3, -1.0, -0.9])
def test_nearly_smooth_glass_is_roughdielectric(cos_theta: float) -> None:
    """At alpha 0.02, of rough glass: energies to 0.015, the mean direction to 0.005; from inside at cosine 0.9."""
    glass = {"type": "roughdielectric", "distribution": "ggx", "alpha": 0.02, "int_ior": 1.5, "ext_ior": 1.0}
    means = []
    for bsdf in (vt.bsdf(ROUGH, **PLAIN), mi.load_dict(glass)):
        wo, energy = sampled(bsdf, cos_theta)
        through = energy * (wo[:, 2] * cos_theta < 0)
        means.append([energy.mean() - through.mean(), through.mean(), (through @ wo[:, 0]) / through.sum()])
    np.testing.assert_allclose(means[0][:2], means[1][:2], atol=0.015)
    np.testing.assert_allclose(means[0][2], means[1][2], atol=0.005)


@pytest.mark.parametrize("cos_theta", [1.0, 0.6])
def test_a_clear_slab_transmits_what_the_walk_does(cos_theta: float) -> None:
    """Tinted between two faces of alpha 0.03: energies within 0.02. (At cosine 0.3 the model transmits 0.43 for 0.34:
    it does not see that facets tilt light beyond the critical angle.)"""
    slab = [vt.Interface(eta=1.5, alpha=0.03), vt.Medium(sigma_a=(0.1, 0.3, 1.0)), vt.Interface(eta=1.0, alpha=0.03)]
    truth = vt.reference.statistics(vt.Stack(slab), cos_theta, 0.0, 40_000, seed=1)
    wo, energy = sampled(vt.bsdf(vt.Stack(slab), **PLAIN), cos_theta)
    assert truth.transmitted
    np.testing.assert_allclose(np.mean(energy * (wo[:, 2] < 0)), truth.transmitted.energy[1, 0], atol=0.02)


@pytest.mark.parametrize("stack", [GLASS, ROUGH], ids=["smooth", "rough"])
def test_a_ray_that_enters_and_leaves_keeps_its_radiance(stack: vt.Stack) -> None:
    """In and out along one path, radiance is scaled by the squared index there and back; its adjoint never is."""
    bsdf, scales = vt.bsdf(stack, **PLAIN), []
    for mode in (mi.TransportMode.Radiance, mi.TransportMode.Importance):
        ctx = mi.BSDFContext(mode)
        ctx.type_mask = +mi.BSDFFlags.Transmission
        down, weight_down = bsdf.sample(ctx, interaction(0.7), mi.Float(0.5), mi.Point2f(0.5, 0.01))
        si = interaction(0.7)
        si.wi = down.wo
        up, weight_up = bsdf.sample(ctx, si, mi.Float(0.5), mi.Point2f(0.5, 0.01))
        assert up.wo.z[0] > 0 and down.wo.z[0] < 0
        np.testing.assert_allclose(down.eta[0] * up.eta[0], 1, rtol=1e-5)
        scales.append(float(weight_down[1][0] * weight_up[1][0]))
    np.testing.assert_allclose(scales[0], scales[1], rtol=1e-4)
    assert 0.85 < scales[0] < 1


@pytest.mark.parametrize(
    ("stack", "shape", "least"),
    [
        (GLASS, "sphere", 0.999),
        (PANE, "rectangle", 0.999),
        (ROUGH, "sphere", 0.93),
        ("frosted-glass", "rectangle", 0.9),
    ],
)
def test_glass_is_not_seen_in_a_furnace(stack: Any, shape: str, least: float) -> None:
    """What reflects and transmits without absorbing is as bright as the light around it; rough glass loses a little."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 100, "rr_depth": 1000},
            "shape": {"type": shape, "bsdf": vt.bsdf(stack, **PLAIN)},
            "light": {"type": "constant", "radiance": 1.0},
            "sensor": {
                "type": "perspective",
                "fov": 20,
                "to_world": mi.ScalarTransform4f().look_at([0.5, 0.3, 5], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
            },
        }
    )
    found = float(np.mean(np.array(mi.render(scene, spp=1024))))
    assert least < found < 1.001, found


@pytest.mark.parametrize("form", ["forward", "symmetric"])
def test_gradients_of_transmission_are_finite_differences(form: str) -> None:
    """Of f with respect to a roughness, an index and a depth, from above and from below."""
    stack = vt.Stack([vt.Interface(eta=1.5, alpha=0.2), vt.Medium(sigma_a=0.3), vt.Interface(eta=1.2, alpha=0.15)])
    bsdf, si = vt.bsdf(stack, form=form, **PLAIN), interaction(mi.Float([0.8, -0.9]), 2)
    wo = dr.normalize(mi.Vector3f(mi.Float([-0.3, -0.4]), 0.1, mi.Float([-0.9, 0.8])))
    parameters = mi.traverse(bsdf)

    def brightness() -> Any:
        parameters.update()
        return dr.sum(bsdf.eval(mi.BSDFContext(), si, wo)[1])

    keys, slopes = ("layer0_alpha_u", "layer0_eta", "layer1_depth"), {}
    for key in keys:
        kind, value = type(parameters[key]), np.array(parameters[key])
        around = []
        for step in (-2e-3, 2e-3, 0.0):
            parameters[key] = kind((value + np.float32(step)).tolist())
            around.append(float(brightness()[0]))
        slopes[key] = (around[1] - around[0]) / 4e-3
    for key in keys:
        dr.enable_grad(parameters[key])
        parameters.set_dirty(key)
    dr.backward(brightness())
    for key in keys:
        found = np.array(dr.grad(parameters[key])).sum()
        assert np.isclose(found, slopes[key], rtol=0.03, atol=1e-4), (key, found, slopes[key])


@pytest.mark.parametrize(
    ("model", "alpha", "form"),
    [
        *((model.name, 0.2, form) for model in vt.MODELS if model.closed_form for form in ("forward", "symmetric")),
        ("velatura", 0.2, "forward"),
        ("velatura", (0.2, 0.4), "symmetric"),
    ],
)
def test_a_clear_medium_above_a_pane_changes_nothing(model: str, alpha: Any, form: str) -> None:
    """Reflected and transmitted shares from both sides."""
    bare = [vt.Interface(eta=1.5, alpha=alpha), vt.Interface(eta=1.0, alpha=0.3)]
    clear = [vt.Medium(depth=1.0, sigma_a=0.0), *bare]
    expected, found = (vt.bsdf(vt.Stack(layers), model=model, form=form) for layers in (bare, clear))
    for cos_theta in (1.0, 0.5, -0.9, -0.6):
        np.testing.assert_allclose(shares(found, cos_theta), shares(expected, cos_theta), atol=1e-5)


@pytest.mark.parametrize("model", [model.name for model in vt.MODELS])
def test_a_medium_above_a_pane_absorbs_by_its_law(model: str) -> None:
    """Light from above passes it once on its way through, and twice on its way back (Beer-Lambert): at the cosine at
    which it leaves, or in the models of the papers as it came."""
    bare = [vt.Interface(eta=1.5, alpha=0.2)]
    tinted = [vt.Medium(depth=1.0, sigma_a=0.4), *bare]
    expected, found = (vt.bsdf(vt.Stack(layers), model=model) for layers in (bare, tinted))
    for cos_theta in (1.0, 0.5):
        kept = np.exp(-0.4 / cos_theta)
        clear, passed = shares(expected, cos_theta)
        if model == "velatura":
            wo, energies = sampled(expected, cos_theta, count=2**15)
            clear = np.mean(energies * np.exp(-0.4 / np.maximum(wo[:, 2], 1e-3)) * (wo[:, 2] > 0)) / kept
        np.testing.assert_allclose(shares(found, cos_theta), (clear * kept * kept, passed * kept), atol=1e-3)


def shares(bsdf: Any, cos_theta: float) -> np.ndarray:
    """Of the light from one direction: what is reflected, and what is transmitted."""
    wo, energies = sampled(bsdf, cos_theta, count=2**15)
    passed = wo[:, 2] * cos_theta < 0
    return np.array([np.mean(energies * ~passed), np.mean(energies * passed)])
