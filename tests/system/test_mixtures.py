"""Mixtures in the plugins: values, densities and samples, weights and their gradients, textures, smooth parts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.renderer.packets import aligned
from velatura.stack import dumps

mi = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

pytestmark = pytest.mark.usefixtures("one_thread")

PLUGINS = ("velatura", "belcour2018", "weidlich_wilkie")
PAINT = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Diffuse(albedo=[0.5, 0.1, 0.1])])
METAL = vt.Stack([vt.Interface(eta=0.2, k=3.9, alpha=[0.3, 0.15], rotation=20)])
GLASS = vt.Stack([vt.Interface(eta=1.5, alpha=0.35)])
WORN = vt.Mix([(0.3, PAINT), (None, METAL)])
NESTED = vt.Mix([(0.2, METAL), (None, vt.Mix([(0.6, PAINT), (None, GLASS)]))])
RNG = np.random.default_rng(11)
COUNT = 200


def interactions(count: int = COUNT, lowest: float = 0.05) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi, si.uv = directions(count, lowest), mi.Point2f(*(mi.Float(aligned(RNG.random(count))) for _ in "uv"))
    return si


def directions(count: int = COUNT, lowest: float = 0.05) -> Any:
    z, phi = RNG.uniform(lowest, 1, count), RNG.uniform(0, 2 * np.pi, count)
    sine = np.sqrt(1 - z * z)
    return mi.Vector3f(*(mi.Float(aligned(x)) for x in (sine * np.cos(phi), sine * np.sin(phi), z)))


def context(component: int | None = None) -> Any:
    asked = mi.BSDFContext()
    if component is not None:
        asked.component = component
    return asked


def found(bsdf: Any, si: Any, wo: Any, component: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    value, pdf = bsdf.eval_pdf(context(component), si, wo)
    return np.array(value), np.array(pdf)


@pytest.mark.parametrize("plugin", PLUGINS)
@pytest.mark.parametrize("stack", [PAINT, METAL, GLASS], ids=["paint", "metal", "glass"])
def test_a_mixture_of_equal_stacks_is_that_stack(plugin: str, stack: vt.Stack) -> None:
    mixed, alone = (vt.bsdf(each, plugin) for each in (vt.Mix([(0.35, stack), (None, stack)]), stack))
    si, wo = interactions(lowest=-1), directions(lowest=-1)
    for a, b in zip(found(mixed, si, wo), found(alone, si, wo)):
        assert np.allclose(a, b, rtol=1e-6, atol=1e-6)
    u = RNG.random((3, COUNT))
    bs, weight = mixed.sample(context(), si, mi.Float(aligned(u[0])), mi.Point2f(u[1:]))
    value, pdf = found(alone, si, bs.wo)
    assert np.allclose(bs.pdf, pdf, rtol=1e-4, atol=1e-6)
    assert np.allclose(np.array(weight * bs.pdf), value, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("plugin", PLUGINS)
@pytest.mark.parametrize("mix", [WORN, NESTED], ids=["one", "nested"])
def test_values_and_densities_and_albedos_are_weighted_sums(plugin: str, mix: vt.Mix) -> None:
    mixed, parts = vt.bsdf(mix, plugin), [(share, vt.bsdf(stack, plugin)) for share, stack in mix.weighted("")]
    si, wo = interactions(), directions(lowest=-1)
    each = [found(part, si, wo) for _, part in parts]
    value, pdf = found(mixed, si, wo)
    assert np.allclose(value, sum(share * v for (share, _), (v, _) in zip(parts, each)), rtol=1e-5, atol=1e-7)
    assert np.allclose(pdf, sum(share * p for (share, _), (_, p) in zip(parts, each)), rtol=1e-5, atol=1e-7)
    albedo = np.array(mixed.eval_diffuse_reflectance(si))
    sums = sum(share * np.array(part.eval_diffuse_reflectance(si)) for share, part in parts)
    assert np.allclose(albedo, sums, rtol=1e-5, atol=1e-6)


def test_components_are_those_of_all_parts() -> None:
    mixed, parts = vt.bsdf(NESTED), [(share, vt.bsdf(stack)) for share, stack in NESTED.weighted("")]
    counts = [part.component_count() for _, part in parts]
    assert mixed.component_count() == sum(counts)
    si, wo, k = interactions(), directions(lowest=-1), 0
    total = np.zeros((3, COUNT))
    for (share, part), count in zip(parts, counts):
        for own in range(count):
            assert mixed.flags(k) == part.flags(own)
            value, pdf = found(mixed, si, wo, k)
            value_alone, pdf_alone = found(part, si, wo, own)
            assert np.allclose(value, share * value_alone, rtol=1e-5, atol=1e-7)
            assert np.allclose(pdf, pdf_alone, rtol=1e-5, atol=1e-7)
            total, k = total + value, k + 1
    assert np.allclose(total, found(mixed, si, wo)[0], rtol=1e-5, atol=1e-6)
    u = RNG.random((3, COUNT))
    bs, _ = mixed.sample(context(), si, mi.Float(aligned(u[0])), mi.Point2f(u[1:]))
    shares, part_of = [share for share, _ in parts], np.repeat(range(len(parts)), counts)
    chosen = np.searchsorted(np.cumsum(shares)[:-1], u[0], side="right")
    assert np.array_equal(part_of[np.array(bs.sampled_component)], chosen)


@pytest.mark.parametrize("form", ["forward", "symmetric"])
@pytest.mark.parametrize("mix", [vt.Mix([(0.35, METAL), (None, METAL)]), WORN, NESTED], ids=["equal", "worn", "nested"])
def test_samples_follow_the_density(mix: vt.Mix, form: str) -> None:
    """By chi-square. Each alarms falsely in one of 1000 seeds, and the seed is fixed."""
    bsdf = vt.bsdf(mix, form=form)
    wi = dr.normalize(mi.Vector3f(0.5, 0.2, 0.85))

    def at(count: int) -> Any:
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi = wi
        return si

    def sample(u: Any) -> Any:
        bs, _ = bsdf.sample(context(), at(dr.width(u)), u[0], mi.Point2f(u[1], u[2]))
        return bs.wo, dr.select(bs.pdf > 0, 1.0, 0.0)

    test = mi.chi2.ChiSquareTest(
        domain=mi.chi2.SphericalDomain(),
        sample_func=sample,
        pdf_func=lambda wo: bsdf.pdf(context(), at(dr.width(wo)), wo),
        sample_dim=3,
        ires=16,
        seed=3,
    )
    assert test.run(significance_level=0.001)


# Weights -------------------------------------------------------------------------------------------------------------


def test_gradients_of_weights_and_of_values_in_parts_are_those_of_differences() -> None:
    bsdf, si, wo = vt.bsdf(NESTED), interactions(64), directions(64)
    parameters = mi.traverse(bsdf)
    for name, step in (("part0_weight", 0.05), ("part1_part0_weight", 0.05), ("part1_part0_layer1_albedo", 0.05)):

        def total(x: Any, name: str = name) -> Any:
            parameters[name] = x
            parameters.update()
            return dr.sum(bsdf.eval(context(), si, wo), axis=None)

        start = parameters[name] + 0
        ends = [float(total(start + sign * step)[0]) for sign in (-1, 1)]
        x = type(start)(start)
        dr.enable_grad(x)
        dr.backward(total(x))
        slope = float(dr.sum(dr.grad(x), axis=None)[0]) if dr.depth_v(x) > 1 else float(dr.grad(x)[0])
        assert slope == pytest.approx((ends[1] - ends[0]) / (2 * step), rel=0.01)
        total(start)


def image(texels: Any) -> dict[str, Any]:
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.asarray(texels, np.float32)),
        "raw": True,
        "filter_type": "nearest",
    }


def plugin_of(mix: vt.Mix | vt.Stack, **others: Any) -> dict[str, Any]:
    vt.register()
    return {"type": "layered", "material": dumps(mix, "json"), **others}


def test_a_texture_weighs_point_by_point() -> None:
    mask = RNG.random((4, 4, 1)).astype(np.float32)
    mixed = mi.load_dict(plugin_of(WORN, part0_weight=image(mask)))
    assert all(mi.has_flag(mixed.flags(k), mi.BSDFFlags.SpatiallyVarying) for k in range(mixed.component_count()))
    si, wo = interactions(), directions()
    weight = np.array(mi.load_dict(image(mask)).eval_1(si))
    paint, metal = (found(vt.bsdf(stack), si, wo) for stack in (PAINT, METAL))
    for got, a, b in zip(found(mixed, si, wo), paint, metal):
        assert np.allclose(got, weight * a + (1 - weight) * b, rtol=1e-4, atol=1e-6)
    assert np.allclose(mixed.eval_attribute_1("part0_weight", si), weight)


def test_a_mask_of_a_file_weighs_as_well(tmp_path: Path) -> None:
    mi.Bitmap(np.array([[0, 255], [255, 0]], np.uint8)[..., None]).write(str(tmp_path / "mask.png"))
    (tmp_path / "worn.yaml").write_text(
        f"mix:\n- weight: {{texture: mask.png}}\n  material: {dumps(PAINT, 'json')}\n- material: coated-gold\n"
    )
    si, wo = interactions(2), directions(2)
    si.uv = mi.Point2f([0.25, 0.75], [0.25, 0.25])
    mixed = vt.bsdf(tmp_path / "worn.yaml")
    values = [found(vt.bsdf(stack), si, wo)[0] for stack in (PAINT, "coated-gold")]
    got = found(mixed, si, wo)[0]
    where = np.array(mixed.eval_attribute_1("part0_weight", si))
    assert set(where) == {0.0, 1.0}
    assert np.allclose(got, where * values[0] + (1 - where) * values[1], rtol=1e-5, atol=1e-7)


def test_textures_inside_parts_are_looked_up() -> None:
    rough = RNG.uniform(0.1, 0.4, (4, 4, 1))
    mixed = mi.load_dict(plugin_of(WORN, part1_layer0_alpha=image(rough)))
    alone = mi.load_dict(plugin_of(METAL, layer0_alpha=image(rough)))
    si, wo = interactions(), directions()
    for got, a, b in zip(found(mixed, si, wo), found(vt.bsdf(PAINT), si, wo), found(alone, si, wo)):
        assert np.allclose(got, 0.3 * a + 0.7 * b, rtol=1e-4, atol=1e-6)


def test_flat_names_describe_a_whole_mixture() -> None:
    vt.register()
    flat = {"part0_weight": 0.3, "part0_layer0_eta": 1.5, "part0_layer0_alpha": 0.1, "part1_layer0_conductor": "Al"}
    bsdf = mi.load_dict({"type": "layered", **flat})
    assert bsdf.mixture.material == vt.Mix.from_flat(flat)
    with pytest.raises(vt.InvalidInput, match=r"^part 1: layer0_depth: layer 0 \(conductor\) has no depth, only"):
        kernel.load_dict({"type": "layered", **flat, "part1_layer0_depth": 1.0})


def test_a_weight_beyond_its_range_is_clamped_with_a_warning() -> None:
    bsdf = vt.bsdf(WORN)
    parameters = mi.traverse(bsdf)
    parameters["part0_weight"] = mi.Float(1.25)
    with pytest.warns(UserWarning, match=r"part0_weight: must lie in 0 to 1, got 1\.25"):
        parameters.update()
    si, wo = interactions(), directions()
    assert np.allclose(found(bsdf, si, wo)[0], found(vt.bsdf(PAINT), si, wo)[0], rtol=1e-5, atol=1e-7)


def test_only_what_changed_is_prepared_again() -> None:
    bsdf = vt.bsdf(WORN)
    before = [stack.bodies for stack in bsdf.stacks]
    parameters = mi.traverse(bsdf)
    parameters["part0_weight"] = mi.Float(0.5)
    parameters.update()
    assert [stack.bodies is kept for stack, kept in zip(bsdf.stacks, before)] == [True, True]
    parameters["part1_layer0_alpha_u"] = mi.Float(0.2)
    parameters.update()
    assert [stack.bodies is kept for stack, kept in zip(bsdf.stacks, before)] == [True, False]


# Parts of different kinds --------------------------------------------------------------------------------------------


def test_a_smooth_part_beside_a_rough_one_has_samples_and_no_value() -> None:
    mirror = vt.Stack([vt.Interface(conductor="mirror")])
    mixed, rough = vt.bsdf(vt.Mix([(0.25, mirror), (None, METAL)])), vt.bsdf(METAL)
    si, wo = interactions(), directions()
    for got, alone in zip(found(mixed, si, wo), found(rough, si, wo)):
        assert np.allclose(got, 0.75 * alone, rtol=1e-5, atol=1e-7)
    u = RNG.random((3, COUNT))
    bs, weight = mixed.sample(context(), si, mi.Float(aligned(u[0])), mi.Point2f(u[1:]))
    delta = u[0] < 0.25
    assert np.array_equal(np.array(mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)), delta)
    assert np.allclose(np.array(bs.wo)[:2, delta], -np.array(si.wi)[:2, delta], atol=1e-6)
    assert np.allclose(np.array(weight)[:, delta], 1) and np.allclose(np.array(bs.pdf)[delta], 0.25)
    # On average samples carry the albedo
    many = interactions(1)
    si = dr.gather(mi.SurfaceInteraction3f, many, dr.zeros(mi.UInt32, 200_000))
    u = RNG.random((3, 200_000))
    _, weight = mixed.sample(context(), si, mi.Float(aligned(u[0])), mi.Point2f(u[1:]))
    expected = 0.25 + 0.75 * np.array(rough.eval_diffuse_reflectance(many)).ravel()
    assert np.allclose(np.array(weight).mean(axis=1), expected, rtol=0.02)


def test_light_from_below_is_absorbed_by_parts_that_do_not_transmit() -> None:
    mixed, glass = vt.bsdf(vt.Mix([(0.4, METAL), (None, GLASS)])), vt.bsdf(GLASS)
    si, wo = interactions(), directions(lowest=-1)
    si.wi.z = -si.wi.z
    for got, alone in zip(found(mixed, si, wo), found(glass, si, wo)):
        assert np.allclose(got, 0.6 * alone, rtol=1e-5, atol=1e-7)
    assert "lossless" in mixed.exceptions and mixed.exceptions >= glass.exceptions


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_spectral", "llvm_ad_mono"])
def test_mixtures_in_other_variants_are_weighted_sums(variant: str) -> None:
    try:
        other = kernel.mitsuba(variant)
        mixed, parts = vt.bsdf(WORN), [vt.bsdf(stack) for stack in (PAINT, METAL)]
        si = dr.zeros(other.SurfaceInteraction3f)
        si.wi = other.Vector3f(0.36, 0.48, 0.8)
        si.wavelengths = type(si.wavelengths)(*(450.0, 500.0, 550.0, 600.0)[: len(si.wavelengths)])
        wo, ctx = other.Vector3f(-0.48, -0.36, 0.8), other.BSDFContext()
        values = [np.array(bsdf.eval_pdf(ctx, si, wo)[0]).ravel() for bsdf in (mixed, *parts)]
        assert np.allclose(values[0], 0.3 * values[1] + 0.7 * values[2], rtol=1e-5)
        for u in (0.1, 0.6, 0.95):
            bs, weight = mixed.sample(ctx, si, u, other.Point2f(0.3, 0.6))
            value, pdf = mixed.eval_pdf(ctx, si, bs.wo)
            assert np.allclose(np.array(weight).ravel() * np.array(pdf), np.array(value).ravel(), rtol=1e-4)
    finally:
        kernel.mitsuba("llvm_ad_rgb")


# Around the plugins --------------------------------------------------------------------------------------------------


def test_walks_through_a_mixture_agree_with_its_lobes_and_with_the_plugin() -> None:
    """Albedos within .004, of which the model's own error is the most; 6 standard errors of the walk are .003."""
    mix = vt.Mix([(0.4, PAINT), (None, vt.Stack([vt.Interface(eta=0.2, k=3.9, alpha=0.3)]))])
    found = vt.compare(mix, ["velatura", "reference"], [0.7], paths=2**18)
    assert found.lobe_names == ("part0 R1", "part0 D", "part1 R1")
    modelled = vt.lobes(mix, 0.7)
    total = sum(modelled.energy) + modelled.remainder
    assert np.allclose(found.models["velatura"].albedo, total, atol=1e-6)
    assert np.allclose(found.truth.albedo, total, atol=0.004)
    assert np.allclose(found.models["reference"].evaluated, found.truth.albedo, atol=0.004)
    assert found.total_variation["velatura"][0] < 0.05
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(0.51**0.5, 0, 0.7)
    assert np.allclose(np.array(vt.bsdf(mix).eval_diffuse_reflectance(si)), total, atol=0.002)
    walks = vt.bsdf(mix, "reference", microsurface=True)
    many = dr.gather(mi.SurfaceInteraction3f, si, dr.zeros(mi.UInt32, 2**18))
    u = RNG.random((3, 2**18))
    _, weight = walks.sample(context(), many, mi.Float(aligned(u[0])), mi.Point2f(u[1:]))
    assert np.allclose(np.array(weight).mean(axis=1), found.truth.albedo[:, 0], atol=0.006)


@pytest.mark.usefixtures("few_samples")
@pytest.mark.parametrize("mix", [WORN, NESTED], ids=["worn", "nested"])
def test_mixtures_keep_the_laws(mix: vt.Mix) -> None:
    """One report in 1000 is a false alarm, and seeds are fixed."""
    report = vt.check(mix)
    assert report.passed, report.broken
    assert not report["energy"].declared or mix is NESTED


def test_the_inverse_refuses_in_one_line(run: Any, tmp_path: Path) -> None:
    vt.save(WORN, tmp_path / "worn.yaml")
    path = str(tmp_path / "worn.yaml")
    status, out, err = run("coat", path, "--eta", "1.5", "--alpha", "0.1")
    assert status == 2 and not out
    assert err.count("\n") == 1 and err.endswith("takes a single stack, not a mixture\n"), err


def test_a_texture_of_weights_is_recovered_from_a_picture() -> None:
    """A square of soot and metal by a mask of 4 x 4 texels, seen from above under a grey sky."""
    sooty = vt.Mix(
        [(0.5, vt.Stack([vt.Diffuse(albedo=0.05)])), (None, vt.Stack([vt.Interface(eta=0.2, k=3.9, alpha=0.3)]))]
    )
    true = np.random.default_rng(5).random((4, 4, 1)).astype(np.float32)

    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
    view = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "prb", "max_depth": 2},
            "sensor": {"type": "perspective", "fov": 28, "to_world": view, "film": film},
            "sky": {"type": "constant", "radiance": 1.0},
            "square": {"type": "rectangle", "bsdf": plugin_of(sooty, part0_weight=image(true))},
        }
    )
    target = mi.render(scene, spp=256, seed=1000)
    parameters, key = mi.traverse(scene), "square.bsdf.part0_weight.data"
    optimiser = mi.ad.Adam(lr=0.2, beta_1=0.5, params={"weight": mi.TensorXf(np.full((4, 4, 1), 0.5, np.float32))})
    for step in range(12):
        optimiser["weight"] = dr.clip(optimiser["weight"], 0, 1)
        parameters[key] = optimiser["weight"]
        parameters.update()
        picture = mi.render(scene, parameters, spp=16, seed=step)
        dr.backward(dr.mean(dr.square(picture - target), axis=None))
        optimiser.set_learning_rate(0.2 * 0.8**step)
        optimiser.step()
    off = np.abs(np.array(optimiser["weight"]) - true)
    assert off.max() < 0.05 and np.abs(0.5 - true).max() > 0.4
