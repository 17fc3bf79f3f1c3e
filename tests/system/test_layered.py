"""The plugin `layered`: it samples what it evaluates, agrees with Mitsuba where it must, and is differentiable."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.comparison import evaluated_lobes
from velatura.comparison.evaluated_lobes import account
from velatura.errors import InvalidInput
from velatura.model import named
from velatura.model.context import Context
from velatura.model.solved import solve
from velatura.model.variance import variance_kind
from velatura.renderer.packets import aligned
from velatura.stack import Material

mi = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

pytestmark = pytest.mark.usefixtures("one_thread")

SIX = (
    "coated-gold",
    "frosted-metal",
    "furnace-rough",
    "turned-brushing",
    "scattering-medium-over-gold",
    "varnished-paint",
)
DIRECTIONS = [(cos, phi) for cos in (0.98, 0.8, 0.6, 0.4, 0.2) for phi in (0.4, 2.5)]


def direction(cos_theta: float, phi: float) -> list[float]:
    sin_theta = np.sqrt(1 - cos_theta**2)
    return [float(sin_theta * np.cos(phi)), float(sin_theta * np.sin(phi)), float(cos_theta)]


def interaction(wi) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = dr.normalize(mi.Vector3f(*wi))
    dr.make_opaque(si.wi)  # one kernel for all directions
    si.sh_frame, si.n = mi.Frame3f([0, 0, 1]), mi.Normal3f(0, 0, 1)
    return si


@pytest.mark.parametrize("name", SIX)
def test_sampling_follows_the_density(name: str, tmp_path) -> None:
    """Chi-square at ten directions; 60 tests in all, false alarms 1 in 100 for the whole family (Sidak)."""
    bsdf = vt.bsdf(name)
    vt.register()
    for cos_theta, phi in DIRECTIONS:
        wi = interaction(direction(cos_theta, phi)).wi
        sample, pdf = _adapter(bsdf, wi)
        test = mi.chi2.ChiSquareTest(
            domain=mi.chi2.SphericalDomain(),
            sample_func=sample,
            pdf_func=pdf,
            sample_dim=3,
            sample_count=200_000,
            res=101,
            ires=16,
            seed=17,
        )
        passed = test.run(0.01, 60)
        if not passed:
            _keep_plot(test, tmp_path / f"{name}-{cos_theta}-{phi}.png")
        assert passed, f"{name} at cosine {cos_theta}, azimuth {phi}; plot in {tmp_path}"


def _adapter(bsdf, wi):
    ctx = mi.BSDFContext()

    def sample(u):
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(u))
        si.wi = wi
        bs, _ = bsdf.sample(ctx, si, u[0], mi.Point2f(u[1], u[2]))
        return bs.wo, dr.select(bs.pdf > 0, 1.0, 0.0)

    def pdf(wo):
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wo))
        si.wi = wi
        return bsdf.pdf(ctx, si, wo)

    return sample, pdf


def _keep_plot(test, path) -> None:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2)
    axes[0].imshow(np.array(test.histogram).reshape(test.res.y, -1))
    axes[1].imshow(np.array(test.pdf).reshape(test.res.y, -1))
    figure.savefig(path)


@pytest.mark.parametrize("name", SIX)
def test_eval_pdf_and_sample_agree(name: str) -> None:
    bsdf, ctx = vt.bsdf(name), mi.BSDFContext()
    rng = np.random.default_rng(3)
    n = 10_000
    cos_theta = rng.uniform(0.02, 1, n)
    phi = rng.uniform(0, 2 * np.pi, n)
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    sin_theta = np.sqrt(1 - cos_theta**2)
    wi = sin_theta * np.cos(phi), sin_theta * np.sin(phi), cos_theta
    si.wi = mi.Vector3f(*(mi.Float(aligned(x)) for x in wi))
    bs, weight = bsdf.sample(ctx, si, mi.Float(aligned(rng.random(n))), mi.Point2f(rng.random((2, n))))
    value, pdf = bsdf.eval_pdf(ctx, si, bs.wo)
    assert np.allclose(pdf, bs.pdf, rtol=1e-4)
    assert np.allclose(bsdf.eval(ctx, si, bs.wo), value, rtol=1e-5)
    assert np.allclose(bsdf.pdf(ctx, si, bs.wo), pdf, rtol=1e-5)
    assert np.allclose(np.array(weight) * np.array(pdf), value, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "model"), [*((name, "belcour2018") for name in SIX), ("coated-rough-metal", "velatura")]
)
def test_the_plugin_is_the_model_that_numpy_runs(name: str, model: str) -> None:
    """In single precision, with averages sampled once per material: within 1 % where the lobes are."""
    stack, ctx = vt.preset(name), mi.BSDFContext()
    material = Material.of(stack)
    body = named(model).body(material, variance_kind(material), Context())
    rng, n = np.random.default_rng(11), 2000
    cos_theta, phi = rng.uniform(0.05, 1, n), rng.uniform(0, 2 * np.pi, n)
    sin_theta = np.sqrt(1 - cos_theta**2)
    wi = (sin_theta * np.cos(phi), sin_theta * np.sin(phi), cos_theta)
    wo, _ = body.sample(wi, *rng.random((3, n)))
    value, pdf = body.eval_pdf(wi, wo)
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    si.wi = mi.Vector3f(*wi)
    found, found_pdf = vt.bsdf(stack, model=model).eval_pdf(ctx, si, mi.Vector3f(*wo))
    # Half an ulp of a direction moves the sharpest lobes by more than that, in few places
    for ours, theirs in ((np.array(found), value), (np.array(found_pdf), pdf)):
        off = np.abs(ours - theirs) > 0.01 * np.abs(theirs) + 1e-4
        assert off.mean() < 0.01


def test_one_metal_is_roughconductor() -> None:
    eta, k = (0.2, 0.92, 1.1), (3.9, 2.45, 2.14)
    stack = vt.Stack([vt.Interface(eta=eta, k=k, alpha=(0.1, 0.3))])
    ours = vt.bsdf(stack, model="belcour2018", reflectance="fresnel")
    theirs = mi.load_dict(
        {
            "type": "roughconductor",
            "distribution": "ggx",
            "alpha_u": 0.1,
            "alpha_v": 0.3,
            "eta": {"type": "rgb", "value": list(eta)},
            "k": {"type": "rgb", "value": list(k)},
        }
    )
    # At the mirror direction of a mean path, where the lobe's Fresnel is evaluated, both are the same
    si = interaction(direction(0.6, 0.8))
    wo = mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z)
    ctx = mi.BSDFContext()
    assert np.allclose(ours.eval(ctx, si, wo), theirs.eval(ctx, si, wo), rtol=1e-4)
    assert np.allclose(ours.pdf(ctx, si, wo), theirs.pdf(ctx, si, wo), rtol=1e-4)


def test_a_smooth_stack_is_a_mirror_of_all_its_lobes() -> None:
    bsdf, ctx = vt.bsdf("furnace", model="belcour2018", reflectance="fresnel"), mi.BSDFContext()
    si = interaction(direction(0.5, 0.3))
    bs, weight = bsdf.sample(ctx, si, 0.3, mi.Point2f(0.2, 0.7))
    assert mi.has_flag(bsdf.flags(), mi.BSDFFlags.DeltaReflection)
    assert np.allclose(weight, 1, atol=1e-5)
    assert np.allclose(bs.wo, mi.reflect(si.wi))
    assert np.all(np.array(bsdf.eval(ctx, si, bs.wo)) == 0)


def test_many_smooth_layers_are_a_mirror_without_loss() -> None:
    layers = [vt.Interface(eta=1.5 if k % 2 == 0 else 1.3) for k in range(15)]
    bsdf = vt.bsdf(vt.Stack([*layers, vt.Interface(conductor="mirror")]), model="belcour2018")
    si = interaction(direction(0.1, 0.3))
    _, weight = bsdf.sample(mi.BSDFContext(), si, 0.3, mi.Point2f(0.2, 0.7))
    assert np.allclose(weight, 1, atol=1e-3)


@pytest.mark.parametrize("form", ["forward", "symmetric"])
def test_paint_alone_is_diffuse(form: str) -> None:
    bsdf = vt.bsdf(vt.Stack([vt.Diffuse(albedo=(0.5, 0.3, 0.1))]), form=form)
    si = interaction(direction(0.6, 0.3))
    found, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(0, 0.6, 0.8))
    assert np.allclose(np.array(found).ravel() * np.pi, np.array([0.5, 0.3, 0.1]) * 0.8, rtol=1e-5)
    assert np.allclose(np.array(pdf) * np.pi, 0.8, rtol=1e-5)
    _, weight = bsdf.sample(mi.BSDFContext(), si, 0.3, mi.Point2f(0.2, 0.7))
    assert np.allclose(np.array(weight).ravel(), (0.5, 0.3, 0.1), rtol=1e-5)


def test_white_paint_under_a_smooth_coat_loses_nothing() -> None:
    """Albedo of the base and of the coat, by sampling; standard error 1e-3."""
    stack = vt.Stack([vt.Interface(eta=1.5), vt.Diffuse(albedo=1.0)])
    bsdf, n = vt.bsdf(stack), 200_000
    rng = np.random.default_rng(5)
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    si.wi = interaction(direction(0.6, 0.3)).wi
    _, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(aligned(rng.random(n))), mi.Point2f(rng.random((2, n))))
    assert abs(np.mean(np.array(weight)) - 1) < 5e-3


@pytest.mark.parametrize(
    "coats",
    [
        [vt.Interface(eta=1.5, alpha=0.3)],
        [vt.Interface(eta=2.0), vt.Medium(sigma_a=(0.05, 0.3, 1.0))],
        [vt.Interface(eta=1.2), vt.Medium(sigma_a=(0.05, 0.3, 1.0)), vt.Interface(eta=1.4)],
    ],
    ids=["rough", "absorbing", "two"],
)
def test_a_diffuse_base_has_the_albedo_of_the_walk(coats: list) -> None:
    """Of the base alone, within 2 %, for albedos up to 1; the walk's own standard error is 0.7 % at most."""
    stack = vt.Stack([*coats, vt.Diffuse(albedo=(1.0, 0.8, 0.3))])
    cosines = [1.0, 0.5]
    truth = vt.reference.statistics(stack, cosines, 0.0, 100_000, seed=2, microsurface=True)
    found = account(stack, cosines, named("belcour2018"))
    assert truth.standard_error is not None
    assert np.all(truth.standard_error.energy[-1] < 0.007 * truth.energy[-1])
    np.testing.assert_allclose(found.reflected[-1].energy, truth.energy[-1], rtol=0.02)


@pytest.mark.parametrize(
    "coats",
    [
        [vt.Interface(eta=2.0, alpha=0.4), vt.Interface(eta=1.4, alpha=0.4)],
        [vt.Interface(eta=1.5, alpha=0.6), vt.Medium(sigma_a=(0.1, 0.5, 1.5))],
        [vt.Interface(eta=1.4, alpha=0.2), vt.Medium(sigma_a=(0.0, 0.3, 0.6)), vt.Interface(eta=1.9, alpha=0.5)],
        [vt.Interface(eta=1.8, alpha=0.3), vt.Interface(eta=1.5, alpha=0.6), vt.Medium(sigma_a=(0.0, 0.4, 1.0))],
    ],
    ids=["back to a lower index", "absorbing", "absorbing between", "absorbing below"],
)
def test_a_diffuse_base_under_rough_interfaces_reflects_as_in_walks(
    coats: list, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All that is reflected, within 1 % and four standard errors: of 36 numbers, one in 400 runs fails by chance.

    The remainder of `velatura` holds the light of the base with that of facets which light meets again.
    """
    monkeypatch.setattr(evaluated_lobes, "LIT_SAMPLES", 2**14)  # on a lattice
    stack = vt.Stack([*coats, vt.Diffuse(albedo=(0.95, 0.5, 0.1))])
    cosines = [1.0, 0.5, 0.2]
    truth = vt.reference.statistics(stack, cosines, 0.0, 200_000, seed=4, microsurface=True)
    assert truth.standard_error is not None
    albedo, error = np.sum(truth.energy, axis=0), np.sum(truth.standard_error.energy, axis=0)
    found = account(stack, cosines, named("velatura")).albedo
    assert np.all(np.abs(found - albedo) < 0.01 * albedo + 4 * error)


def test_below_the_surface_there_is_nothing() -> None:
    bsdf, ctx = vt.bsdf("coated-gold"), mi.BSDFContext()
    si = interaction([0.1, 0.2, -0.9])
    for wo in (mi.Vector3f(0, 0, 1), mi.Vector3f(0, 0, -1)):
        value, pdf = bsdf.eval_pdf(ctx, si, wo)
        assert np.all(np.array(value) == 0) and np.all(np.array(pdf) == 0)
    assert np.all(np.array(bsdf.sample(ctx, si, 0.5, mi.Point2f(0.5, 0.5))[1]) == 0)


def test_flat_names_describe_what_a_file_describes() -> None:
    flat = {
        "type": "layered",
        "layer0_eta": 1.5,
        "layer0_alpha": 0.1,
        "layer1_depth": 0.5,
        "layer1_sigma_a": {"type": "rgb", "value": [0.1, 0.2, 0.3]},
        "layer2_eta": 0.2,
        "layer2_k": 3.9,
        "layer2_alpha_u": 0.2,
        "layer2_alpha_v": 0.1,
        "layer2_rotation": 30.0,
    }
    vt.register()
    by_names = mi.load_dict(flat)
    stack = vt.Stack(
        [
            vt.Interface(eta=1.5, alpha=0.1),
            vt.Medium(depth=0.5, sigma_a=(0.1, 0.2, 0.3)),
            vt.Interface(eta=0.2, k=3.9, alpha=(0.2, 0.1), rotation=30),
        ]
    )
    si, wo = interaction(direction(0.7, 0.5)), dr.normalize(mi.Vector3f(-0.4, -0.4, 0.8))
    ctx = mi.BSDFContext()
    assert np.allclose(by_names.eval(ctx, si, wo), vt.bsdf(stack).eval(ctx, si, wo), rtol=1e-4)


def test_in_a_scene_file(tmp_path) -> None:
    vt.register()
    scene = mi.load_string("""
        <scene version="3.0.0">
          <integrator type="path"/>
          <sensor type="perspective"><transform name="to_world"><lookat origin="0,-4,0" target="0,0,0" up="0,0,1"/>
            </transform><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
          </sensor>
          <emitter type="constant"/>
          <shape type="sphere"><bsdf type="layered"><string name="material" value="frosted-metal"/>
            <string name="model" value="belcour2018"/><float name="layer0_alpha" value="0.2"/>
            <string name="tir" value="off"/></bsdf></shape>
        </scene>""")
    image = np.array(mi.render(scene, spp=4))
    assert np.isfinite(image).all() and image.max() <= 1.01


def test_textures_vary_over_the_surface_and_take_gradients() -> None:
    vt.register()
    texels = np.linspace(0.05, 0.5, 16, dtype=np.float32).reshape(4, 4, 1)
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(texels), "raw": True, "filter_type": "nearest"}
    textured = mi.load_dict({"type": "layered", "material": "frosted-metal", "layer0_alpha": texture})
    ctx, si = mi.BSDFContext(), interaction(direction(0.8, 0.2))
    wo = mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z)
    for row, column in ((0, 0), (1, 3), (3, 2)):
        si.uv = mi.Point2f((column + 0.5) / 4, (row + 0.5) / 4)
        constant = vt.bsdf(vt.preset("frosted-metal").replace(layer0_alpha=float(texels[row, column, 0])))
        assert np.allclose(textured.eval(ctx, si, wo), constant.eval(ctx, si, wo), rtol=5e-3)
    parameters = mi.traverse(textured)
    key = next(name for name in list(parameters.keys()) if name.endswith("alpha_u.data"))
    dr.enable_grad(parameters[key])
    parameters.update()
    dr.backward(dr.sum(textured.eval(ctx, si, wo)))
    gradient = np.array(dr.grad(parameters[key])).ravel()
    assert gradient[3 * 4 + 2] != 0 and np.count_nonzero(gradient) == 1


def test_parameters_can_be_changed() -> None:
    bsdf, ctx = vt.bsdf("frosted-metal"), mi.BSDFContext()
    parameters = mi.traverse(bsdf)
    parameters["layer0_alpha_u"] = 0.3
    parameters["layer0_alpha_v"] = 0.3
    parameters["layer0_eta"] = 1.8
    parameters.update()
    si, wo = interaction(direction(0.7, 0.5)), dr.normalize(mi.Vector3f(-0.4, -0.4, 0.8))
    changed = vt.bsdf(vt.preset("frosted-metal").replace(layer0_alpha=0.3, layer0_eta=1.8))
    assert np.allclose(bsdf.eval(ctx, si, wo), changed.eval(ctx, si, wo), rtol=1e-4)


def test_gradients_of_a_pixel_are_finite_differences(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pixel under a directional light, where no noise hides the slope; one backward pass for all parameters.

    Lobes have as many normals as those of gradients. Brushed stacks are solved to 2e-4 of a brightness of .13, which
    moves slopes of roughness and index by up to .01.
    """
    monkeypatch.setattr(solve, "FINELY", (987, 1597))
    monkeypatch.setattr(solve, "NORMALS", dict.fromkeys(solve.NORMALS, solve.FINELY[1]))
    stack = vt.Stack(
        [
            vt.Interface(eta=1.5, alpha=(0.15, 0.25)),
            vt.Medium(depth=0.5, sigma_a=(0.1, 0.2, 0.3)),
            vt.Interface(eta=(0.2, 0.9, 1.1), k=(3.9, 2.4, 2.1), alpha=(0.3, 0.2), rotation=20),
        ]
    )
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "prb", "max_depth": 2},
            "shape": {"type": "rectangle", "bsdf": vt.bsdf(stack)},
            "light": {"type": "directional", "direction": [0.3, 0.2, -1], "irradiance": {"type": "rgb", "value": 1.0}},
            "sensor": {
                "type": "perspective",
                "fov": 1,
                "to_world": mi.ScalarTransform4f().look_at([-1.5, -1.2, 4], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
            },
        }
    )
    parameters = mi.traverse(scene)
    channels = {"layer1_sigma_a": 1, "layer2_eta": 0, "layer2_k": 1}
    scalars = ["layer0_alpha_u", "layer0_eta", "layer1_depth", "layer2_alpha_v", "layer2_rotation"]
    names = {key: f"shape.bsdf.{key}" for key in (*scalars, *channels)}

    def brightness():
        image = mi.render(scene, parameters, spp=64, seed=1).array
        red, green, blue = (dr.gather(mi.Float, image, c) for c in range(3))
        return 0.5 * red + 0.3 * green + 0.2 * blue

    def shifted(key: str, step: float) -> float:
        before = type(parameters[names[key]])(parameters[names[key]])
        after = type(before)(before)
        if key in channels:
            after[channels[key]] += step
        else:
            after += step
        parameters[names[key]] = after
        parameters.update()
        value = float(brightness()[0])
        parameters[names[key]] = before  # with the next update
        return value

    slopes = {}
    for key in names:
        step = 1.0 if key.endswith("rotation") else 0.01
        slopes[key] = (shifted(key, step) - shifted(key, -step)) / (2 * step)
    variables = {}
    for key, name in names.items():
        value = parameters[name]
        variables[key] = mi.Float(value[channels[key]]) if key in channels else value
        dr.enable_grad(variables[key])
        if key in channels:
            value[channels[key]] = variables[key]
        parameters[name] = value
    parameters.update()
    dr.backward(brightness())
    for key, variable in variables.items():
        found = float(np.sum(dr.grad(variable)))  # a step is one of all channels
        noise = 0.01 if key in ("layer0_alpha_u", "layer2_alpha_v", "layer0_eta") else 1e-5
        assert np.isclose(found, slopes[key], rtol=0.02, atol=noise), (key, found, slopes[key])


def test_what_the_plugin_refuses_is_one_line(tmp_path) -> None:
    (tmp_path / "text.png").write_text("no image")
    textured = vt.Stack([vt.Interface(eta=1.5, alpha=vt.Texture(texture=tmp_path / "text.png"))])
    with pytest.raises(InvalidInput, match=r"^layer0_alpha_u: the texture .*text\.png is no image"):
        vt.bsdf(textured)
    with pytest.raises(InvalidInput, match=r"^channels=separate: only for lobes and inverse, .*$"):
        vt.bsdf("coated-gold", model="belcour2018", channels="separate")


def test_the_reason_of_a_refusal_is_not_drowned(run, tmp_path) -> None:
    """By `mi.load_dict` it is the last line, below where it was asked; `velatura render` says it in one line."""
    vt.register()
    reason = "layer 0 (interface): eta: must lie in 0.001 to 1e4, got -2.0"
    with pytest.raises(RuntimeError) as error:
        mi.load_dict({"type": "layered", "material": "coated-gold", "layer0_eta": -2.0})
    *others, last = str(error.value).strip().splitlines()
    assert last == f"InvalidInput: {reason}"
    assert not any(f"velatura/{part}" in line for line in others for part in ("stack", "plugins", "binding"))

    scene = tmp_path / "scene.xml"
    scene.write_text("""<scene version="3.0.0"><integrator type="path"/><sensor type="perspective"/>
        <shape type="sphere"><bsdf type="layered" id="material"><string name="material" value="coated-gold"/>
        <float name="layer0_eta" value="-2"/></bsdf></shape></scene>""")
    status, _, message = run("render", "coated-gold", "--scene", str(scene), "-o", str(tmp_path / "o.png"))
    assert status == 2 and len(message.splitlines()) == 1
    assert message.startswith(f"velatura: {scene}: At ") and message.endswith(f": {reason}\n")


def test_the_scalar_variant_agrees() -> None:
    rng = np.random.default_rng(1)
    points = [(direction(c, p), direction(d, q)) for c, p, d, q in rng.uniform(0.1, 0.95, (4, 4))]
    ctx = mi.BSDFContext()
    expected = [
        np.array(vt.bsdf("coated-gold", model="belcour2018").eval(ctx, interaction(wi), mi.Vector3f(*wo))).ravel()
        for wi, wo in points
    ]
    try:
        scalar = kernel.mitsuba("scalar_rgb")
        bsdf, ctx = vt.bsdf("coated-gold", model="belcour2018"), scalar.BSDFContext()
        for (wi, wo), value in zip(points, expected):
            si = scalar.SurfaceInteraction3f()
            si.wi = dr.normalize(scalar.Vector3f(wi))
            found, pdf = bsdf.eval_pdf(ctx, si, scalar.Vector3f(wo))
            assert np.allclose(found, value, rtol=2e-3, atol=1e-6)
            _, weight = bsdf.sample(ctx, si, 0.4, scalar.Point2f(0.3, 0.6))
            assert np.isfinite(weight).all() and pdf >= 0
    finally:
        kernel.mitsuba("llvm_ad_rgb")


def test_the_spectral_variant_loads_and_renders() -> None:
    try:
        spectral = kernel.mitsuba("llvm_ad_spectral")
        vt.register()
        image = vt.render("coated-gold", spp=1, size=(16, 16))
        assert spectral.variant() == "llvm_ad_spectral"
        assert np.isfinite(image).all() and image.max() > 0
    finally:
        kernel.mitsuba("llvm_ad_rgb")


@pytest.mark.parametrize("name", vt.presets())
def test_every_preset_renders(name: str) -> None:
    image = vt.render(name, scene="sphere", spp=1, size=(16, 16))
    assert np.isfinite(image).all() and image.min() >= 0


ROUGH_PANE = vt.Stack([vt.Interface(eta=1.5, alpha=0.3), vt.Interface(eta=1.33, alpha=(0.1, 0.2))])


@pytest.mark.parametrize(
    "given",
    [
        {"model": "velatura"},
        {"model": "velatura", "form": "symmetric"},
        {"model": "belcour2018"},
        {"model": "weier2020"},
        {"model": "reference"},
    ],
    ids=lambda given: " ".join(given.values()),
)
def test_a_material_that_many_directions_have_queried_can_be_rendered(given: dict[str, str]) -> None:
    """Expected: a query of many directions, all of them active, leaves no array in the material. Dr.Jit refuses those
    in a rendering, of any material that exists, in use or not."""
    bsdf = vt.bsdf(ROUGH_PANE, **given)
    si = dr.zeros(mi.SurfaceInteraction3f, 100)
    si.wi = dr.repeat(mi.Vector3f(0.6, 0, 0.8), 100)
    every = dr.full(mi.Bool, True, 100)
    bs, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(0.3), mi.Point2f(0.2, 0.7), every)
    dr.eval(weight, bsdf.eval_pdf(mi.BSDFContext(), si, bs.wo, every), bsdf.eval_diffuse_reflectance(si, every))
    film = {"type": "hdrfilm", "width": 4, "height": 4}
    scene = {"type": "scene", "light": {"type": "constant"}, "integrator": {"type": "path", "max_depth": 3}}
    scene |= {
        "sensor": {"type": "perspective", "film": film},
        "sphere": {"type": "sphere", "bsdf": {"type": "diffuse"}},
    }
    assert np.isfinite(np.array(mi.render(mi.load_dict(scene), spp=1))).all()
    scene["other"] = {"type": "sphere", "radius": 0.5, "bsdf": bsdf}
    assert np.isfinite(np.array(mi.render(mi.load_dict(scene), spp=1))).all()
