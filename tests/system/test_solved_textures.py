"""Textures on materials that are solved in NumPy: as the uniform material of a point, with gradients to texels."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.renderer.packets import aligned

mi = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

pytestmark = pytest.mark.usefixtures("one_thread")

vt.register()

COATED = vt.Stack(
    [
        vt.Interface(eta=1.5, alpha=0.1),
        vt.Medium(depth=0.5, sigma_a=(0.1, 0.4, 0.9), sigma_s=0.3, g=0.5),
        vt.Interface(eta=(0.15, 0.4, 1.3), k=(3.6, 2.4, 1.9), alpha=0.3),
    ]
)
PANE = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(eta=1.3, alpha=0.2)])
FROSTED = vt.Stack([vt.Interface(eta=1.5, alpha=0.3), vt.Medium(sigma_a=0.3), vt.Interface(eta=1.0, alpha=0.2)])
DUST = vt.Stack([vt.Medium(depth=0.5, sigma_s=(0.9, 0.7, 0.5), sigma_a=0.1, g=0.7), COATED.layers[-1]])
FOG = vt.Stack([DUST.layers[0], vt.Interface(eta=1.0)])
PAINT = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Diffuse(albedo=0.5)])
NODES = 48  # along either axis of the disc of directions
U = 0.3  # where textures are read


def texture(low: Any, high: Any, texels: int = 16) -> Any:
    """Texels in a row from one value to another."""
    row = np.linspace(low, high, texels, dtype=np.float32).reshape(1, texels, -1).repeat(2, 0)
    return {"type": "bitmap", "bitmap": mi.Bitmap(row), "raw": True, "filter_type": "nearest"}


def made(stack: vt.Stack, **textures: Any) -> Any:
    """The plugin with textures in place of some values, or with switches of the model."""
    values: dict[str, Any] = {}
    for key, value in stack.flat().items():
        if key != "exterior" and key not in textures and key[:-2] not in textures:
            values[key] = {"type": "rgb", "value": list(value)} if isinstance(value, tuple) else value
    return kernel.load_dict({"type": "layered", **values, **textures})


def at_a_point(bsdf: Any, stack: vt.Stack) -> Any:
    """The uniform material of the values there."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.uv = mi.Point2f(U, 0.5)
    found = {name: np.array(image.at(si, True), float).ravel() for name, image in bsdf.stacks[0].binding.images.items()}
    values = {name: tuple(x.tolist()) if len(set(x)) > 1 else float(x[0]) for name, x in found.items()}
    return vt.bsdf(stack.replace(**values), form=bsdf.stacks[0].model.form)


def light(bsdf: Any, cosine: float) -> np.ndarray:
    """Energy of cells of the disc of directions on both sides, (3, cells)."""
    x, y = np.meshgrid(*[(np.arange(NODES) + 0.5) * (2 / NODES) - 1] * 2)
    z = np.sqrt(np.maximum(1 - x * x - y * y, 1e-9))
    si, sine, found = dr.zeros(mi.SurfaceInteraction3f, x.size), float(np.sqrt(1 - cosine * cosine)), []
    si.uv, si.wi = mi.Point2f(U, 0.5), mi.Vector3f(0.8 * sine, 0.6 * sine, cosine)
    dr.make_opaque(si.wi)  # one kernel for all angles
    for side in (z, -z):
        wo = mi.Vector3f(*(mi.Float(aligned(each.ravel())) for each in (x, y, side)))
        value = np.array(bsdf.eval(mi.BSDFContext(), si, wo)) / z.ravel()
        found.append(np.where((x * x + y * y).ravel() < 1, value, 0) * (2 / NODES) ** 2)
    return np.concatenate(found, axis=1)


@pytest.mark.parametrize(
    ("stack", "textures"),
    (
        (COATED, {"layer0_alpha": (0.13, 0.13), "layer2_alpha": (0.22, 0.22)}),
        (COATED, {"layer0_alpha": (0.02, 0.5), "layer2_alpha": (0.05, 0.6)}),
        (COATED, {"layer1_depth": (0.1, 2.0), "layer0_eta": (1.2, 1.7)}),
        (PANE, {"layer1_alpha": (0.05, 0.6)}),
        (FROSTED, {"layer0_alpha": (0.25, 0.6)}),
        (PAINT, {"layer1_albedo": ((0.1, 0.5, 0.7), (0.6, 0.2, 0.8))}),
        (DUST, {"layer0_g": (0.4, 0.4), "layer1_alpha": (0.2, 0.2)}),
        (DUST, {"layer0_sigma_s": ((0.0, 0.4, 0.6), (0.8, 0.6, 0.9)), "layer0_depth": (0.1, 2.0)}),
        (FOG, {"layer0_depth": (0.1, 2.0)}),
    ),
)
def test_a_texel_is_the_uniform_material(stack: vt.Stack, textures: dict[str, Any]) -> None:
    """Constant and varying textures, one and two: albedo within .003, and total variation within .005."""
    bsdf = made(stack, **{key: texture(*ends) for key, ends in textures.items()})
    uniform = at_a_point(bsdf, stack)
    for cosine in (1.0, 0.7, 0.35):
        found, expected = light(bsdf, cosine), light(uniform, cosine)
        assert np.abs(found.sum(axis=1) - expected.sum(axis=1)).max() < 0.003
        assert 0.5 * np.abs(found - expected).sum() < 0.005 * expected.sum()


@pytest.mark.usefixtures("few_samples")
def test_a_furnace_through_a_texture_gains_nothing() -> None:
    """The law of energy, which is wrong by chance once in 1000 checks, of a roughness from a texture."""
    bsdf = kernel.load_dict({"type": "layered", "material": "furnace-rough", "layer0_alpha": texture(0.05, 0.2)})
    assert vt.check(bsdf)["energy"].passed


def test_several_textures_are_near_the_uniform_material() -> None:
    """Three have a table together, a fourth has one with each: albedo within .003, and total variation within .005."""
    three = {"layer0_eta": (1.3, 1.5), "layer0_alpha": (0.05, 0.15), "layer2_alpha": (0.1, 0.3)}
    textures = {**three, "layer1_depth": (0.85, 1.3)}
    stack = COATED.replace(layer1_sigma_s=0.0)
    bsdf = made(stack, **{key: texture(*ends) for key, ends in textures.items()})
    uniform = at_a_point(bsdf, stack)
    for cosine in (1.0, 0.7, 0.35):
        found, expected = light(bsdf, cosine), light(uniform, cosine)
        assert np.abs(found.sum(axis=1) - expected.sum(axis=1)).max() < 0.003
        assert 0.5 * np.abs(found - expected).sum() < 0.005 * expected.sum()


def seen(bsdf: Any) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi, si.uv = dr.normalize(mi.Vector3f(0.4, 0.3, 0.8)), mi.Point2f(U, 0.5)
    dr.make_opaque(si)
    return dr.sum(bsdf.eval(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(-0.45, -0.15, 0.75))))


def test_gradients_to_texels_are_differences() -> None:
    """Of two textures: of the tables to 3 %, since slopes are constant from place to place, and of uniform materials
    over a step that is large enough for the errors of solves, to 10 %."""
    ends = {"layer0_alpha": (0.02, 0.5), "layer2_alpha": (0.05, 0.6)}
    bsdf, column = made(COATED, **{key: texture(*each) for key, each in ends.items()}), int(U * 16)
    parameters, names = mi.traverse(bsdf), {key: f"{key}_u.data" for key in ends}
    at = {key: float(np.linspace(*each, 16)[column]) for key, each in ends.items()}

    def shifted(key: str, step: float) -> float:
        before = mi.TensorXf(parameters[names[key]])
        texels = np.array(before)
        texels[:, column] += step
        parameters[names[key]] = mi.TensorXf(texels)
        parameters.update()
        found = float(seen(bsdf)[0])
        parameters[names[key]] = before
        parameters.update()
        return found

    slopes = {key: (shifted(key, 0.01) - shifted(key, -0.01)) / 0.02 for key in ends}
    for name in names.values():
        dr.enable_grad(parameters[name])
    parameters.update()
    dr.backward(seen(bsdf))
    for key, x in at.items():
        gradient = np.array(dr.grad(parameters[names[key]])).ravel()
        assert np.count_nonzero(gradient) == 1
        assert np.isclose(gradient.sum(), slopes[key], rtol=0.03), key
        low, high = (float(seen(vt.bsdf(COATED.replace(**{**at, key: x + s})))[0]) for s in (-0.1 * x, 0.1 * x))
        assert np.isclose(gradient.sum(), (high - low) / (0.2 * x), rtol=0.1), key


def test_gradients_to_constants_beside_a_texture() -> None:
    bsdf = made(COATED, layer2_alpha=texture(0.18, 0.24))
    parameters, keys = mi.traverse(bsdf), ("layer1_depth", "layer1_sigma_s")
    for key in keys:
        dr.enable_grad(parameters[key])
    parameters.update()
    dr.backward(seen(bsdf))
    point = COATED.replace(layer2_alpha=float(np.linspace(0.18, 0.24, 16)[int(U * 16)]))
    for key in keys:
        x = COATED.flat()[key]
        low, high = (float(seen(vt.bsdf(point.replace(**{key: s * x})))[0]) for s in (0.98, 1.02))
        assert np.isclose(np.sum(np.array(dr.grad(parameters[key]))), (high - low) / (0.04 * x), rtol=0.05), key


TO_TEXELS = {
    "layer0_eta": (1.46, 1.54),
    "layer1_depth": (0.4, 0.6),
    "layer1_sigma_a": (0.1, 0.2),
    "layer1_sigma_s": (0.2, 0.3),
    "layer1_g": (0.5, 0.6),
    "layer2_k": (2.9, 3.2),
}


@pytest.mark.parametrize("key", TO_TEXELS)
def test_gradients_to_texels_of_any_kind(key: str) -> None:
    """As above, of one texture, against differences of texels, to 5 %."""
    grey = vt.Stack(
        [
            COATED.layers[0],
            vt.Medium(depth=0.5, sigma_a=0.4, sigma_s=0.3, g=0.5),
            vt.Interface(eta=0.3, k=3.0, alpha=0.3),
        ]
    )
    bsdf = made(grey, **{key: texture(*TO_TEXELS[key])})
    parameters, name = mi.traverse(bsdf), f"{key}.data"
    texels, ends, step = np.array(parameters[name]), [], 0.1 * np.ptp(TO_TEXELS[key])
    dr.enable_grad(parameters[name])
    parameters.update()
    dr.backward(seen(bsdf))
    gradient = np.array(dr.grad(parameters[name])).sum()
    for shift in (-step, step):
        shifted = texels.copy()
        shifted[:, int(U * 16)] += shift
        parameters[name] = mi.TensorXf(shifted)
        parameters.update()
        ends.append(float(seen(bsdf)[0]))
    assert np.isclose(gradient, (ends[1] - ends[0]) / (2 * step), rtol=0.05)


def test_tables_stay_while_textures_stay_within_them() -> None:
    bsdf = made(COATED, layer2_alpha=texture(0.1, 0.3))
    parameters, tables = mi.traverse(bsdf), bsdf.stacks[0].bodies.textured
    for high, kept in ((0.35, True), (0.8, False)):
        parameters["layer2_alpha_u.data"] = mi.TensorXf(np.linspace(0.1, high, 32, dtype=np.float32).reshape(2, 16, 1))
        parameters.update()
        assert (bsdf.stacks[0].bodies.textured is tables) == kept


def test_two_textured_roughnesses_are_prepared_soon() -> None:
    """3 s of processor time, of the 2 cores that a machine has at least."""
    begin = time.process_time()
    made(COATED, layer0_alpha=texture(0.02, 0.5), layer2_alpha=texture(0.05, 0.6))
    assert time.process_time() - begin < 6


BRUSHED = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(eta=0.2, k=3.9, alpha=(0.3, 0.15), rotation=20)])


def test_a_textured_rotation_turns_a_brushed_metal() -> None:
    """With its roughness from another texture; and with gradients, against differences of texels."""
    bsdf = made(BRUSHED, layer1_alpha_u=texture(0.2, 0.3), layer1_rotation=texture(0, 60))
    uniform = at_a_point(bsdf, BRUSHED)
    found, expected = light(bsdf, 0.7), light(uniform, 0.7)
    assert 0.5 * np.abs(found - expected).sum() < 0.005 * expected.sum()
    parameters, name = mi.traverse(bsdf), "layer1_rotation.data"
    texels, ends = np.array(parameters[name]), []
    for step in (-1.0, 1.0):
        parameters[name] = mi.TensorXf(texels + np.float32(step))
        parameters.update()
        ends.append(float(seen(bsdf)[0]))
    parameters[name] = mi.TensorXf(texels)
    dr.enable_grad(parameters[name])
    parameters.update()
    dr.backward(seen(bsdf))
    assert np.isclose(np.array(dr.grad(parameters[name])).sum(), (ends[1] - ends[0]) / 2, rtol=0.03)


@pytest.mark.parametrize(
    ("form", "textures"), (("forward", {}), ("symmetric", {}), ("forward", {"layer1_alpha_u": (0.3, 0.4)}))
)
def test_all_turns_with_the_layers(form: str, textures: dict[str, tuple[float, float]]) -> None:
    """To 1e-3 of the light, where interfaces are brushed 30 to 1 along axes of their own, at an azimuth between those
    at which materials are solved, and at the normal."""
    angles, seen = (0.0, 37.3), []
    for angle in angles:
        layers = [
            vt.Interface(eta=1.5, alpha=(0.3, 0.01), rotation=12 + angle),
            vt.Interface(eta=0.2, k=3.9, alpha=(0.3, 0.15), rotation=130 + angle),
        ]
        bsdf = made(vt.Stack(layers), form=form, **{name: texture(*ends) for name, ends in textures.items()})
        i, o = (
            rotated(np.array(w, float), angle)
            for w in ([[0.5, 0.3, 0.8], [0, 0, 1]], [[-0.42, -0.3, 0.9], [0.1, 0, 1]])
        )
        si = dr.zeros(mi.SurfaceInteraction3f, 2)
        si.uv, si.wi = mi.Point2f(U, 0.5), mi.Vector3f(i)
        seen.append(np.array(bsdf.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(o))[0]))
    assert np.all(seen[0] > 0)
    np.testing.assert_allclose(seen[1], seen[0], rtol=1e-3)


def rotated(w: np.ndarray, degrees: float) -> np.ndarray:
    """Unit vectors (n, 3) turned about the normal, (3, n)."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y, z = w.T / np.linalg.norm(w, axis=1)
    return np.array([c * x - s * y, s * x + c * y, z])


def test_samples_have_the_energy_of_values() -> None:
    """A pane of two textured roughnesses, from both sides: means of weights against values at directions that are
    even over the sphere, 2^18 each, to 2 %; the density integrates to 1 or less."""
    bsdf = made(PANE, layer0_alpha=texture(0.1, 0.5), layer1_alpha=texture(0.2, 0.4))
    count, ctx = 2**18, mi.BSDFContext(mi.TransportMode.Importance)
    for cosine in (0.9, 0.35, -0.6):
        si, random = dr.zeros(mi.SurfaceInteraction3f, count), mi.PCG32(count)
        si.uv, si.wi = mi.Point2f(U, 0.5), mi.Vector3f(float(np.sqrt(1 - cosine * cosine)), 0, cosine)
        dr.make_opaque(si.wi)  # one kernel for all angles
        pair = mi.Point2f(random.next_float32(), random.next_float32())
        weights = np.array(bsdf.sample(ctx, si, random.next_float32(), pair)[1])
        even = mi.warp.square_to_uniform_sphere(mi.Point2f(random.next_float32(), random.next_float32()))
        values, density = (np.array(x) * 4 * np.pi for x in bsdf.eval_pdf(ctx, si, even))
        assert np.isclose(weights.mean(), values.mean(), rtol=0.02)
        assert density.mean() < 1.02 and weights.max() < 3


def test_the_symmetric_form_is_reciprocal() -> None:
    """At texels between nodes; and as the uniform material to 1 % of total variation."""
    bsdf, count = made(COATED, form="symmetric", layer2_alpha=texture(0.05, 0.6)), 2**12
    random = mi.PCG32(count)
    u, pair = random.next_float32(), [mi.Point2f(random.next_float32(), random.next_float32()) for _ in range(2)]
    wi, wo = map(mi.warp.square_to_uniform_hemisphere, pair)
    found = []
    for a, b in ((wi, wo), (wo, wi)):
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi, si.uv = a, mi.Point2f(u, 0.5)
        found.append(np.array(bsdf.eval(mi.BSDFContext(), si, b) / b.z))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-4, atol=1e-6)
    ours, theirs = light(bsdf, 0.7), light(at_a_point(bsdf, COATED), 0.7)
    assert 0.5 * np.abs(ours - theirs).sum() < 0.01 * theirs.sum()


def test_values_of_a_mesh_are_tabulated_over_all_that_they_may_be() -> None:
    """A roughness at the vertices, which is known while rendering only, as a constant of it."""
    mesh = mi.Mesh("square", 4, 2, has_vertex_texcoords=True)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = [-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]
    parameters["faces"] = [0, 1, 2, 0, 2, 3]
    parameters.update()
    mesh.add_attribute("vertex_rough", 1, [0.25] * 4)
    scene = mi.load_dict({"type": "scene", "square": mesh})
    si = scene.ray_intersect(mi.Ray3f([0.1, 0.2, 2], [0, 0, -1]))
    si.wi = dr.normalize(mi.Vector3f(0.4, 0.3, 0.8))
    bsdf = made(COATED, layer2_alpha={"type": "mesh_attribute", "name": "vertex_rough"})
    wo = dr.normalize(mi.Vector3f(-0.45, -0.15, 0.75))
    expected = vt.bsdf(COATED.replace(layer2_alpha=0.25)).eval(mi.BSDFContext(), si, wo)
    np.testing.assert_allclose(bsdf.eval(mi.BSDFContext(), si, wo), expected, rtol=0.01)
