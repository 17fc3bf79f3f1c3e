"""The plugin `layered_reference` against Mitsuba's own plugins, against itself, and in a renderer.

Averages are compared at 4.5 standard errors (a false alarm in 150 000), in some hundred comparisons; the chi-square
tests below fail by chance once in 10^4 each. The seeds are fixed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

import velatura.reference  # noqa: F401  (declares the plugin)
from velatura import kernel
from velatura.stack import Diffuse, Interface, Medium, Stack, dumps

mi = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

pytestmark = pytest.mark.usefixtures("one_thread")

kernel.register()

SIGMAS = 4.5
CHI2_FALSE_ALARM = 1e-4


def reference(layers: list, **options: Any) -> Any:
    material = dumps(Stack(layers), "json")
    return mi.load_dict({"type": "layered_reference", "material": material, **options})


def direction(cos_theta: float, phi: float) -> Any:
    sin_theta = np.sqrt(1 - cos_theta**2)
    w = mi.Vector3f(float(sin_theta * np.cos(phi)), float(sin_theta * np.sin(phi)), cos_theta)
    dr.make_opaque(w)  # one kernel for all directions
    return w


def interactions(wi: Any, count: int) -> Any:
    """`count` points that see the same direction, and differ in their uv so that their random numbers do."""
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi, si.uv = dr.normalize(wi), mi.Point2f(dr.arange(mi.Float, count) / count, 0.5)
    return si


def average(bsdf: Any, wi: Any, wo: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
    values = bsdf.eval(mi.BSDFContext(), interactions(wi, count), wo).numpy().astype(float)
    return values.mean(axis=1), values.std(axis=1) / np.sqrt(count) + 1e-6


def albedos(bsdf: Any, wi: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Means and standard errors of the weights of reflected and transmitted samples, first channel."""
    wo, weight, _ = draw(bsdf, wi, count)
    sides = np.stack([np.where(side, weight, 0) for side in (wo[2] > 0, wo[2] <= 0)])
    return sides.mean(axis=1), sides.std(axis=1) / np.sqrt(count) + 1e-6


def draw(bsdf: Any, wi: Any, count: int, seed: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions, weights of the first channel, and whether the sample is no delta."""
    rng = mi.PCG32(count, seed)
    u = [rng.next_float32() for _ in range(3)]
    bs, weight = bsdf.sample(mi.BSDFContext(), interactions(wi, count), u[0], mi.Point2f(u[1], u[2]))
    kind = np.broadcast_to(bs.sampled_type.numpy(), count)
    return bs.wo.numpy(), weight.numpy()[0].astype(float), (kind & int(mi.BSDFFlags.Delta)) == 0


# Against Mitsuba

CONDUCTOR = {"eta": {"type": "rgb", "value": 0.2}, "k": {"type": "rgb", "value": 3.9}}


@pytest.mark.parametrize("alpha", [(0.05, 0.05), (0.3, 0.1)])
@pytest.mark.parametrize("cos_theta", [0.95, 0.4])
def test_one_conductor_is_roughconductor(alpha: tuple, cos_theta: float) -> None:
    bsdf = reference([Interface(eta=0.2, k=3.9, alpha=alpha)])
    theirs = {"type": "roughconductor", "distribution": "ggx", "alpha_u": alpha[0], "alpha_v": alpha[1], **CONDUCTOR}
    _compare(bsdf, mi.load_dict(theirs), direction(cos_theta, 0.4), random=False)


@pytest.mark.parametrize("cos_theta", [0.95, 0.4, -0.9, -0.4])
def test_one_dielectric_is_roughdielectric(cos_theta: float) -> None:
    bsdf = reference([Interface(eta=1.5, alpha=0.3)])
    theirs = {"type": "roughdielectric", "distribution": "ggx", "alpha": 0.3, "int_ior": 1.5, "ext_ior": 1.0}
    _compare(bsdf, mi.load_dict(theirs), direction(cos_theta, 0.4), random=False)


@pytest.mark.parametrize("cos_theta", [0.95, 0.4])
def test_smooth_coat_over_diffuse_is_plastic(cos_theta: float) -> None:
    albedo = [0.9, 0.5, 0.1]
    bsdf = reference([Interface(eta=1.5), Diffuse(albedo=tuple(albedo))])
    theirs = {"type": "plastic", "nonlinear": True, "int_ior": 1.5, "ext_ior": 1.0}
    colour = {"diffuse_reflectance": {"type": "rgb", "value": albedo}}
    _compare(bsdf, mi.load_dict({**theirs, **colour}), direction(cos_theta, 0.4))


def _compare(ours: Any, theirs: Any, wi: Any, random: bool = True) -> None:
    sides = (1, -1) if ours.flags() & int(mi.BSDFFlags.Transmission) else (1,)
    # Values, which are exact for a single interface
    for cos_theta, phi in [(0.9, 0.2), (0.5, 2.5), (0.4, 3.5)]:
        for side in sides:
            wo = direction(side * cos_theta, phi)
            truth = theirs.eval(mi.BSDFContext(), interactions(wi, 1), wo).numpy()[:, 0]
            value, error = average(ours, wi, wo, 40_000 if random else 1)
            assert np.all(np.abs(value - truth) < SIGMAS * error + 1e-5 * truth)
    # Albedos
    (value, error), (truth, noise) = (albedos(bsdf, wi, 100_000) for bsdf in (ours, theirs))
    assert np.all(np.abs(value - truth) < SIGMAS * np.hypot(error, noise))


# Against itself

STACKS = {
    "coated metal": [Interface(eta=1.5, alpha=0.2), Interface(eta=0.2, k=3.9, alpha=0.3)],
    "turned": [
        Interface(eta=1.5, alpha=0.3),
        Interface(eta=(1.2, 1.3, 1.5), alpha=(0.5, 0.2), rotation=40),
        Interface(conductor="Au", alpha=(0.2, 0.5), rotation=20),
    ],
    "smooth on top": [Interface(eta=1.5), Interface(eta=2.0), Interface(eta=1.3, alpha=0.4), Interface(conductor="Ag")],
    "smooth within": [Interface(eta=1.5, alpha=0.3), Interface(eta=2.0), Interface(conductor="Ag", alpha=0.3)],
    "cloudy pane": [
        Interface(eta=1.5, alpha=0.3),
        Medium(sigma_s=(0.5, 1.0, 1.5), sigma_a=(0.1, 0.3, 0.0), g=0.5),
        Interface(eta=1.0, alpha=0.3),
    ],
    "cloudy smooth pane": [Interface(eta=1.5), Medium(sigma_s=1.0, sigma_a=0.1, g=-0.5), Interface(eta=1.0)],
    "mist above": [
        Medium(sigma_s=1.0, g=0.3),
        Interface(eta=1.5, alpha=0.3),
        Medium(sigma_s=(0.5, 1.0, 1.5), g=0.6),
        Diffuse(albedo=(0.9, 0.5, 0.2)),
    ],
}
CASES = [(name, cos, False) for name in STACKS for cos in (0.7, -0.7) if cos > 0 or name == "cloudy pane"]
CASES += [("smooth within", 0.7, True), ("cloudy pane", -0.7, True)]


@pytest.mark.parametrize(("name", "cos_theta", "microsurface"), CASES)
def test_eval_averages_to_the_histogram_of_sample(name: str, cos_theta: float, microsurface: bool) -> None:
    """Chi-square over 4 x 6 cells of a hemisphere, in the first channel."""
    bsdf, wi, count = reference(STACKS[name], microsurface=microsurface), direction(cos_theta, 0.3), 150_000
    # Sample
    wo, weight, glossy = draw(bsdf, wi, count)
    sampled, sampled_error = _histogram(wo, np.where(glossy, weight, 0))
    # Evaluate at uniform directions
    rng = mi.PCG32(count, 5)
    wo = mi.warp.square_to_uniform_sphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
    value = bsdf.eval(mi.BSDFContext(), interactions(wi, count), wo).numpy()[0].astype(float)
    evaluated, evaluated_error = _histogram(wo.numpy(), value * 4 * np.pi)
    # Compare where there is enough to tell the errors
    told = (sampled > 20 * sampled.sum() / count) & (evaluated_error < 0.2 * evaluated)
    z = ((sampled - evaluated) / np.hypot(sampled_error, evaluated_error))[told]
    assert told.sum() >= 12
    assert sampled[~told].sum() < 0.05 * sampled.sum()
    assert stats.chi2.sf((z**2).sum(), len(z)) > CHI2_FALSE_ALARM


def _histogram(wo: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    height = np.clip((wo[2] + 1) * 4, 0, 7).astype(int)
    azimuth = np.clip((np.arctan2(wo[1], wo[0]) / (2 * np.pi) % 1) * 6, 0, 5).astype(int)
    count = len(weight)
    first, second = (np.bincount(height * 6 + azimuth, weight**power, 48) / count for power in (1, 2))
    return first, np.sqrt((second - first**2) / count) + 1e-12


@pytest.mark.parametrize(
    ("name", "microsurface"), [("turned", False), ("cloudy pane", False), ("mist above", False), ("cloudy pane", True)]
)
def test_reciprocity(name: str, microsurface: bool) -> None:
    """f(a, b) / n_b^2 = f(b, a) / n_a^2, and both sides of these stacks lie in air; eval holds the outgoing cosine."""
    bsdf = reference(STACKS[name], microsurface=microsurface)
    a, b = direction(0.8, 0.3), direction(0.4, 2.5)
    pairs = [(a, b), (a, -b)] if "pane" in name else [(a, b)]
    for wi, wo in pairs:
        (there, error), (back, error_back) = average(bsdf, wi, wo, 50_000), average(bsdf, wo, wi, 50_000)
        scale = abs(wo.z[0]), abs(wi.z[0])
        difference = there / scale[0] - back / scale[1]
        assert np.all(np.abs(difference) < SIGMAS * np.hypot(error / scale[0], error_back / scale[1]))


@pytest.mark.parametrize("name", ["coated metal", "smooth within", "cloudy smooth pane"])
def test_the_density_is_one(name: str) -> None:
    """Or a little less, as Mitsuba's own are: facets at a slant would send some of it through the surface."""
    bsdf, count = reference(STACKS[name]), 100_000
    rng = mi.PCG32(count, 7)
    wo = mi.warp.square_to_uniform_sphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
    density = bsdf.pdf(mi.BSDFContext(), interactions(direction(0.8, 0.3), count), wo).numpy().astype(float)
    assert np.all(density >= 0) and 0.7 < density.mean() * 4 * np.pi < 1.02


def test_transmission_squeezes_radiance_and_tells_the_index() -> None:
    bsdf, wi = reference([Interface(eta=1.5)]), direction(0.8, 0.0)
    context = mi.BSDFContext()
    bs, weight = bsdf.sample(context, interactions(wi, 1), 0.5, mi.Point2f(0.5, 0.5))
    theirs = mi.load_dict({"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0})
    truth, truth_weight = theirs.sample(context, interactions(wi, 1), 0.5, mi.Point2f(0.5, 0.5))
    assert np.allclose(bs.wo, truth.wo, atol=1e-6) and np.allclose(bs.eta, truth.eta)
    assert np.allclose(weight, truth_weight, rtol=1e-5)
    assert int(bs.sampled_type[0]) == int(mi.BSDFFlags.DeltaTransmission)


# In a renderer


def test_the_path_integrator_finds_the_albedo() -> None:
    """A floor under an even sky, which is found by sampling the sky and the BSDF both: radiance is albedo.

    This holds only if the density is the same for both strategies.
    """
    bsdf = reference(STACKS["coated metal"])
    sensor = {
        "type": "orthographic",
        "to_world": mi.ScalarTransform4f().look_at([2, 0, 2], [0, 0, 0], [0, 1, 0]).scale(0.1),
        "film": {"type": "hdrfilm", "width": 64, "height": 64, "rfilter": {"type": "box"}},
    }
    scene = mi.load_dict(
        {
            "type": "scene",
            "sky": {"type": "constant"},
            "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(10), "bsdf": bsdf},
            "sensor": sensor,
            "integrator": {"type": "path", "max_depth": 2},
        }
    )
    image = np.array(mi.render(scene, spp=16, seed=1)).astype(float)[..., 0]
    # The camera's azimuth is 0, and the floor's frame that of the world
    truth, noise = albedos(bsdf, direction(float(np.sqrt(0.5)), 0.0), 200_000)
    error = np.hypot(image.std() / 64, noise[0])
    assert abs(image.mean() - truth[0]) < SIGMAS * error
    assert error < 0.005


def test_the_same_seed_gives_the_same_values() -> None:
    wi, wo = direction(0.8, 0.3), direction(0.4, 2.5)
    values = [
        reference(STACKS["turned"], seed=seed).eval(mi.BSDFContext(), interactions(wi, 1000), wo).numpy()
        for seed in (1, 1, 2)
    ]
    assert np.array_equal(values[0], values[1])
    assert not np.array_equal(values[0], values[2])
    assert len(np.unique(values[0][0])) > 900  # and no two points the same


def test_parameters_change_it() -> None:
    bsdf, wi = reference(STACKS["coated metal"]), direction(0.8, 0.3)
    before = albedos(bsdf, wi, 10_000)[0][0]
    parameters = mi.traverse(bsdf)
    parameters["layer1_k"] = mi.Float(0.5)
    parameters["layer0_alpha_u"] = parameters["layer0_alpha_v"] = mi.Float(0.0)
    parameters.update()
    assert albedos(bsdf, wi, 10_000)[0][0] < 0.9 * before
    assert bsdf.flags() & int(mi.BSDFFlags.DeltaReflection)


def test_textures_are_looked_up() -> None:
    flat = {"layer0_eta": 1.5, "layer0_alpha_u": 0.1, "layer1_eta": 0.2, "layer1_k": 3.9, "layer1_alpha_v": 0.2}
    names = {**flat, "layer0_alpha_v": 0.1, "layer1_alpha_u": {"type": "checkerboard", "color0": 0.05, "color1": 0.5}}
    bsdf = mi.load_dict({"type": "layered_reference", **names})
    si = interactions(direction(0.8, 0.3), 2)
    si.uv = mi.Point2f([0.25, 0.75], [0.25, 0.25])
    value = bsdf.eval(mi.BSDFContext(), si, direction(0.8, 0.3 + np.pi)).numpy()[0]
    assert value.max() > 5 * value.min()


@pytest.mark.parametrize("option", [{"seed": -1}, {"max_depth": 0}, {"microsurface": 1}])
def test_bad_options_are_refused(option: dict) -> None:
    (name,) = option
    with pytest.raises(RuntimeError, match=f"{name}: must be"):
        reference(STACKS["coated metal"], **option)


def test_media_that_scatter_are_walked_in_monochromatic_variants() -> None:
    """Expected: what the walk of three equal channels reflects and transmits."""
    medium = Medium(depth=0.5, sigma_a=0.2, sigma_s=2.0, g=0.3)
    layers = [Interface(eta=1.5, alpha=0.2), medium, Interface(eta=1.0)]
    found = []
    try:
        for variant in ("llvm_ad_mono", "llvm_ad_rgb"):
            kernel.mitsuba(variant)
            kernel.register()
            found.append(albedos(reference(layers), direction(0.8, 0.0), 100_000))
    finally:
        kernel.mitsuba("llvm_ad_rgb")
    (mono, mono_error), (rgb, rgb_error) = found
    assert np.all(np.abs(mono - rgb) < SIGMAS * np.hypot(mono_error, rgb_error))


def test_media_that_scatter_are_walked_in_scalar_variants() -> None:
    """Expected: the same walk, of the same random numbers."""
    found = []
    try:
        for variant in ("scalar_rgb", "llvm_ad_rgb"):
            kernel.mitsuba(variant)
            kernel.register()
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wi = mi.Vector3f(0.6, 0.0, 0.8)
            value = reference(STACKS["cloudy pane"]).eval(mi.BSDFContext(), si, mi.Vector3f(0.0, 0.6, 0.8))
            found.append(np.array(value).ravel())
    finally:
        kernel.mitsuba("llvm_ad_rgb")
    assert np.all(found[0] > 0) and np.allclose(found[0], found[1], rtol=1e-3)
