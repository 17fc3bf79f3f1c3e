"""What the plugins are by Mitsuba's protocol: components, flags, masks, attributes, albedo, and their own account."""

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

Flags = mi.BSDFFlags
RNG = np.random.default_rng(7)
SIDES = Flags.FrontSide | Flags.BackSide
ONE_WAY, REST = Flags.GlossyReflection | Flags.NonSymmetric, Flags.DiffuseReflection | Flags.NonSymmetric


def context(mask: Any = None, component: int | None = None) -> Any:
    asked = mi.BSDFContext()
    if mask is not None:
        asked.type_mask = +mask
    if component is not None:
        asked.component = component
    return asked


def interactions(wi: Any, count: int = 1) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = dr.normalize(mi.Vector3f(wi))
    dr.make_opaque(si.wi)  # one kernel for all angles
    si.sh_frame, si.n, si.uv = mi.Frame3f([0, 0, 1]), mi.Normal3f(0, 0, 1), mi.Point2f(0.3, 0.6)
    return si


def random_directions(count: int, lowest: float) -> Any:
    z, phi = RNG.uniform(lowest, 1, count), RNG.uniform(0, 2 * np.pi, count)
    sine = np.sqrt(1 - z * z)
    return mi.Vector3f(*(mi.Float(aligned(x)) for x in (sine * np.cos(phi), sine * np.sin(phi), z)))


def loaded(name: str, plugin: str = "layered", **options: Any) -> Any:
    vt.register()
    return mi.load_dict({"type": plugin, "material": name, **options})


# Components and their flags


@pytest.mark.parametrize(
    ("name", "kinds", "common"),
    [
        ("coated-gold", [ONE_WAY, ONE_WAY, REST], Flags.FrontSide | Flags.Anisotropic),
        ("frosted-metal", [ONE_WAY, ONE_WAY, REST], Flags.FrontSide),
        ("furnace", [Flags.DeltaReflection] * 6, Flags.FrontSide),
        ("glossy-plastic", [ONE_WAY, REST], Flags.FrontSide),
        (
            "frosted-glass",
            [ONE_WAY, ONE_WAY, REST, Flags.GlossyTransmission | Flags.NonSymmetric],
            SIDES,
        ),
    ],
    ids=["gold", "metal", "smooth", "paint", "pane"],
)
def test_every_lobe_is_a_component(name: str, kinds: list[Any], common: Any) -> None:
    bsdf = loaded(name)
    assert [bsdf.flags(k) for k in range(bsdf.component_count())] == [+(kind | common) for kind in kinds]
    assert bsdf.flags() == +np.bitwise_or.reduce([+(kind | common) for kind in kinds])
    # The symmetric form is reciprocal, but for the index of what passes
    symmetric = loaded(name, form="symmetric")
    for flag in (symmetric.flags(k) for k in range(symmetric.component_count())):
        assert mi.has_flag(flag, Flags.NonSymmetric) == mi.has_flag(flag, Flags.Transmission)


def test_merged_lobes_are_one_component() -> None:
    assert loaded("three-dielectrics-over-metal", model="realtime").component_count() == 3
    assert loaded("three-dielectrics-over-metal", model="belcour2018").component_count() == 4


def test_textures_vary_over_the_surface() -> None:
    texture = {"type": "checkerboard", "color0": 0.1, "color1": 0.3}
    bsdf = loaded("glossy-plastic", layer0_alpha=texture)
    assert all(mi.has_flag(bsdf.flags(k), Flags.SpatiallyVarying) for k in range(2))


# Masks


@pytest.mark.parametrize("form", ["forward", "symmetric"])
@pytest.mark.parametrize("name", ["coated-gold", "varnished-paint", "frosted-glass"])
def test_components_sum_to_the_whole_and_are_sampled_alone(name: str, form: str) -> None:
    """In a mean of 2 * 10^4 samples a component is the same as by itself, by 5 standard errors: 1 in 10^5 fails."""
    pane = name == "frosted-glass"
    bsdf, n = loaded(name, form=form, **({"layer1_alpha": 0.2} if pane else {})), 20_000
    si = interactions(random_directions(n, -1 if pane else 0.05), n)
    wo = random_directions(n, -1)
    contexts = [context(component=k) for k in range(bsdf.component_count())]
    values = [bsdf.eval_pdf(asked, si, wo) for asked in contexts]
    whole = bsdf.eval(mi.BSDFContext(), si, wo)
    dr.eval(values, whole)  # in one kernel
    np.testing.assert_allclose(np.sum([np.array(value) for value, _ in values], axis=0), whole, rtol=1e-4)

    # Sample each, and all
    u1, u2 = mi.Float(aligned(RNG.random(n))), mi.Point2f(RNG.random((2, n)))
    drawn = [bsdf.sample(asked, si, u1, u2) for asked in contexts]
    seen = [bsdf.eval_pdf(asked, si, bs.wo) for asked, (bs, _) in zip(contexts, drawn)]
    dr.eval(drawn, seen)
    for k, ((bs, weight), (value, pdf)) in enumerate(zip(drawn, seen)):
        assert np.all(np.array(bs.sampled_component) == k)
        assert np.all(np.array(bs.sampled_type) & bsdf.flags(k) == np.array(bs.sampled_type))
        np.testing.assert_allclose(bs.pdf, pdf, rtol=1e-4)
        np.testing.assert_allclose(np.array(weight) * np.array(pdf), value, rtol=1e-3, atol=1e-6)
        one, other = np.array(weight)[0], (np.array(values[k][0]) * (4 * np.pi))[0]
        error = np.hypot(one.std(), other.std()) / np.sqrt(n)
        # Both are 0 of a lobe whose light waves have
        assert abs(one.mean() - other.mean()) <= 5 * error


@pytest.mark.parametrize(
    ("name", "mask"),
    [("varnished-paint", Flags.DiffuseReflection), ("frosted-glass", Flags.GlossyReflection), ("coated-gold", 1)],
    ids=["base", "reflection of a pane", "second lobe"],
)
def test_a_masked_component_is_sampled_by_its_density(name: str, mask: Any) -> None:
    """Chi-square; three tests, false alarms 1 in 100 for the family (Sidak)."""
    asked = context(component=mask) if isinstance(mask, int) else context(mask)
    bsdf, wi = loaded(name), dr.normalize(mi.Vector3f(0.5, 0.2, -0.6 if "glass" in name else 0.6))

    def sample(u: Any) -> tuple[Any, Any]:
        bs, _ = bsdf.sample(asked, interactions(wi, dr.width(u)), u[0], mi.Point2f(u[1], u[2]))
        return bs.wo, dr.select(bs.pdf > 0, 1.0, 0.0)

    test = mi.chi2.ChiSquareTest(
        domain=mi.chi2.SphericalDomain(),
        sample_func=sample,
        pdf_func=lambda wo: bsdf.pdf(asked, interactions(wi, dr.width(wo)), wo),
        sample_dim=3,
        sample_count=200_000,
        res=101,
        ires=16,
        seed=3,
    )
    assert test.run(0.01, 3)


@pytest.mark.parametrize("plugin", ["layered_reference", "weidlich_wilkie"])
def test_components_of_the_other_plugins_sum_to_the_whole(plugin: str) -> None:
    """By eval, of which the reference makes an estimate from the same random numbers, and by 10^4 samples each."""
    bsdf, n = loaded("glossy-plastic", plugin), 10_000
    kinds = {+Flags.GlossyReflection: 0.05, +Flags.DiffuseReflection: 0.3}
    assert [bsdf.flags(k) & +(Flags.Glossy | Flags.Diffuse) for k in range(bsdf.component_count())] == list(kinds)
    si, wo = interactions([0.6, 0, 0.8], n), random_directions(n, 0.05)
    u1, u2 = mi.Float(aligned(RNG.random(n))), mi.Point2f(RNG.random((2, n)))
    whole, parts = np.array(bsdf.eval(mi.BSDFContext(), si, wo)), np.zeros((3, n))
    for k, (kind, least) in enumerate(kinds.items()):
        asked = context(component=k)
        value = np.array(bsdf.eval(asked, si, wo))
        np.testing.assert_array_equal(value, bsdf.eval(context(kind), si, wo))
        parts = parts + value
        bs, weight = bsdf.sample(asked, si, u1, u2)
        counts = np.array(weight).any(axis=0)
        assert np.all(np.array(bs.sampled_type)[counts] == kind) and np.all(np.array(bs.sampled_component)[counts] == k)
        one, other = np.array(weight)[0], value[0] * 2 * np.pi * 0.95
        assert abs(one.mean() - other.mean()) < 5 * np.hypot(one.std(), other.std()) / np.sqrt(n) + 0.003
        assert least < one.mean() < 2 * least
    np.testing.assert_allclose(parts, whole, rtol=1e-4)


@pytest.mark.parametrize("name", ["furnace", "frosted-glass"])
def test_smooth_and_rough_light_of_the_reference_are_components(name: str) -> None:
    bsdf, n = loaded(name, "layered_reference"), 10_000
    si, u1, u2 = interactions([0.6, 0, 0.8], n), mi.Float(aligned(RNG.random(n))), mi.Point2f(RNG.random((2, n)))
    _, whole = bsdf.sample(mi.BSDFContext(), si, u1, u2)
    parts = [bsdf.sample(context(component=k), si, u1, u2)[1] for k in range(bsdf.component_count())]
    np.testing.assert_allclose(np.sum([np.array(part) for part in parts], axis=0), whole, rtol=1e-6)


def test_the_component_that_was_drawn_is_as_frequent_as_its_share_of_energy() -> None:
    bsdf, n = loaded("varnished-paint"), 50_000
    si = interactions([0.6, 0, 0.8], n)
    bs, _ = bsdf.sample(mi.BSDFContext(), si, mi.Float(aligned(RNG.random(n))), mi.Point2f(RNG.random((2, n))))
    drawn = np.bincount(np.array(bs.sampled_component), minlength=bsdf.component_count()) / n
    means = []
    for k in range(bsdf.component_count()):
        _, weight = bsdf.sample(
            context(component=k), si, mi.Float(aligned(RNG.random(n))), mi.Point2f(RNG.random((2, n)))
        )
        means.append(np.array(weight).mean())
    # By 5 standard errors, and what lobes lose below the horizon
    np.testing.assert_allclose(drawn, np.array(means) / sum(means), atol=0.015)


def test_a_smooth_stack_is_masked_lobe_by_lobe() -> None:
    bsdf = loaded("furnace")
    si, u = interactions([0.5, 0, 0.8]), mi.Point2f(0.2, 0.7)
    weights = []
    for k in range(bsdf.component_count()):
        bs, weight = bsdf.sample(context(component=k), si, 0.5, u)
        assert np.all(np.array(bs.sampled_component) == k) and np.all(np.array(bs.pdf) == 1)
        weights.append(np.array(weight).ravel())
    np.testing.assert_allclose(sum(weights), 1, atol=1e-5)
    _, weight = bsdf.sample(context(Flags.GlossyReflection), si, 0.5, u)
    assert np.all(np.array(weight) == 0)
    # A pane reflects and passes, from either side
    pane = loaded("tinted-plate", layer0_alpha=0.0, layer2_alpha=0.0)
    for z in (0.8, -0.8):
        si = interactions([0.5, 0, z])
        for mask, side in ((Flags.DeltaReflection, 1), (Flags.DeltaTransmission, -1)):
            bs, weight = pane.sample(context(mask), si, 0.3, u)
            assert np.all(np.array(bs.wo.z * si.wi.z * side) > 0) and np.all(np.array(weight) > 0)


def test_the_diffuse_part_is_that_of_plastic() -> None:
    """A smooth coat over paint, whose base Mitsuba's `plastic` knows in closed form: within 2 %."""
    stack = vt.Stack([vt.Interface(eta=1.5), vt.Diffuse(albedo=(0.8, 0.5, 0.1))])
    plastic = {"type": "plastic", "int_ior": 1.5, "ext_ior": 1.0, "nonlinear": True}
    plastic["diffuse_reflectance"] = {"type": "rgb", "value": [0.8, 0.5, 0.1]}
    ours, theirs, asked = vt.bsdf(stack), mi.load_dict(plastic), context(Flags.DiffuseReflection)
    for z in (0.9, 0.5):
        si, wo = interactions([float(np.sqrt(1 - z * z)), 0, z], 50), random_directions(50, 0.2)
        np.testing.assert_allclose(ours.eval(asked, si, wo), theirs.eval(asked, si, wo), rtol=0.02)


@pytest.mark.parametrize("plugin", ["layered", "layered_reference", "weidlich_wilkie"])
def test_what_is_not_asked_for_is_dark(plugin: str) -> None:
    bsdf, si = loaded("coated-gold", plugin), interactions([0.5, 0, 0.8])
    for asked in (context(Flags.Transmission), context(Flags.Delta), context(component=9)):
        assert np.all(np.array(bsdf.eval(asked, si, mi.Vector3f(-0.5, 0, 0.8))) == 0)
        assert np.all(np.array(bsdf.pdf(asked, si, mi.Vector3f(-0.5, 0, 0.8))) == 0)
        _, weight = bsdf.sample(asked, si, 0.3, mi.Point2f(0.2, 0.7))
        assert np.all(np.array(weight) == 0)


def test_twosided_masks_either_side() -> None:
    front = loaded("glossy-plastic")
    both = mi.load_dict({"type": "twosided", "bsdf": front})
    assert both.component_count() == 4
    above, below = interactions([0.5, 0, 0.8]), interactions([0.5, 0, -0.8])
    up, down = mi.Vector3f(-0.5, 0.1, 0.8), mi.Vector3f(-0.5, 0.1, -0.8)
    expected = np.array(front.eval(context(Flags.DiffuseReflection), above, up))
    for si, wo in ((above, up), (below, down)):
        np.testing.assert_allclose(both.eval(context(Flags.DiffuseReflection), si, wo), expected, rtol=1e-5)


# Albedo


@pytest.mark.parametrize("plugin", ["layered", "layered_reference", "weidlich_wilkie"])
@pytest.mark.parametrize("name", ["coated-gold", "glossy-plastic", "frosted-glass", "furnace"])
def test_albedo_for_denoisers_lies_within_0_and_1(plugin: str, name: str) -> None:
    si = interactions(random_directions(200, 0.01), 200)
    albedo = np.array(loaded(name, plugin).eval_diffuse_reflectance(si))
    assert np.all(albedo >= 0) and np.all(albedo <= 1) and albedo.max() > 0.05


def test_albedo_is_what_leaves() -> None:
    """By 10^5 samples, within 1 %."""
    for name in ("coated-gold", "varnished-paint", "frosted-glass"):
        bsdf, n = loaded(name), 100_000
        si = interactions([0.6, 0, 0.8], n)
        asked = mi.BSDFContext(mi.TransportMode.Importance)
        _, weight = bsdf.sample(asked, si, mi.Float(aligned(RNG.random(n))), mi.Point2f(RNG.random((2, n))))
        found = np.array(bsdf.eval_diffuse_reflectance(interactions([0.6, 0, 0.8]))).ravel()
        np.testing.assert_allclose(found, np.array(weight).mean(axis=1), rtol=0.01, atol=2e-3)


def test_the_albedo_of_a_picture() -> None:
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "aov", "aovs": "albedo:albedo"},
            "light": {"type": "constant"},
            "ball": {"type": "sphere", "bsdf": {"type": "twosided", "bsdf": loaded("coated-gold")}},
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at([0, -4, 0], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8},
            },
        }
    )
    albedo = np.array(mi.render(scene, spp=4))[..., -3:]
    assert np.all((albedo >= 0) & (albedo <= 1))
    red, green, blue = albedo[4, 4]
    assert red > 0.6 > green > blue


# Attributes, and what it calls itself


@pytest.mark.parametrize("plugin", ["layered", "layered_reference", "weidlich_wilkie"])
def test_every_value_is_an_attribute(plugin: str) -> None:
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(np.full((2, 2, 3), [0.2, 0.4, 0.6], np.float32)), "raw": True}
    bsdf = loaded("glossy-plastic", plugin, layer0_eta=1.5, layer1_albedo=texture, layer0_alpha_u=0.2)
    si = interactions([0, 0, 1])
    expected = {"exterior": 1, "layer0_eta": 1.5, "layer0_alpha_u": 0.2, "layer0_alpha_v": 0.08, "layer0_rotation": 0}
    every: dict[str, Any] = {**expected, "layer1_albedo": [0.2, 0.4, 0.6]}
    for name, value in every.items():
        assert bsdf.has_attribute(name)
        colour = np.broadcast_to(value, 3)
        np.testing.assert_allclose(np.array(bsdf.eval_attribute(name, si)).ravel(), colour, rtol=1e-5)
        np.testing.assert_allclose(np.array(bsdf.eval_attribute_3(name, si)).ravel(), colour, rtol=1e-5)
        grey = np.array(mi.luminance(mi.Color3f(*map(float, colour)))) if np.ndim(value) else value
        np.testing.assert_allclose(np.array(bsdf.eval_attribute_1(name, si)), grey, rtol=1e-4)
    assert not bsdf.has_attribute("layer0_ior")


@pytest.mark.parametrize("variant", ["llvm_ad_mono", "llvm_ad_spectral", "scalar_rgb"])
def test_attributes_in_other_variants(variant: str) -> None:
    """The colour of a value is that of the material file, seen under D65 where it is a spectrum."""
    try:
        other = kernel.mitsuba(variant)
        vt.register()
        bsdf = other.load_dict({"type": "layered", "material": "glossy-plastic", "layer0_eta": 1.5})
        si = dr.zeros(other.SurfaceInteraction3f)
        rgb = np.array([0.6, 0.05, 0.04])
        y = float(rgb @ [0.2126, 0.7152, 0.0722])
        found = np.array(bsdf.eval_attribute_3("layer1_albedo", si)).ravel()
        np.testing.assert_allclose(found, y if variant == "llvm_ad_mono" else rgb, atol=0.005)
        np.testing.assert_allclose(np.array(bsdf.eval_attribute_1("layer1_albedo", si)).ravel(), y, atol=0.005)
        np.testing.assert_allclose(np.array(bsdf.eval_attribute("layer0_eta", si)).ravel(), 1.5, rtol=1e-6)
        assert np.all(np.array(bsdf.eval_diffuse_reflectance(si)) <= 1)
    finally:
        kernel.mitsuba("llvm_ad_rgb")


@pytest.mark.parametrize("plugin", ["layered", "layered_reference", "weidlich_wilkie"])
def test_it_lists_its_values(plugin: str) -> None:
    texture = {"type": "checkerboard"}
    bsdf = loaded("glossy-plastic", plugin, layer0_eta=1.5, layer1_albedo=texture)
    parameters = mi.traverse(bsdf)
    parameters["layer0_alpha_v"] = 0.25
    parameters.update()
    text = str(bsdf)
    for line in ("kinds = dielectric, diffuse", "layer0_eta = 1.5", "layer0_alpha_u = 0.08", "layer0_alpha_v = 0.25"):
        assert f"\n  {line},\n" in text
    assert "layer1_albedo = Checkerboard[" in text
    assert "form = symmetric" in str(loaded("coated-gold", form="symmetric"))
