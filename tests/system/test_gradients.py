"""Gradients of materials that are solved in NumPy, against differences of the values of a BSDF."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.model.solved import solve
from velatura.renderer import low_discrepancy

mi = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

pytestmark = pytest.mark.usefixtures("one_thread")

COATED = vt.Stack(
    [
        vt.Interface(eta=1.5, alpha=0.1),
        vt.Medium(depth=0.5, sigma_a=(0.1, 0.4, 0.9), sigma_s=0.3, g=0.5),
        vt.Interface(eta=(0.15, 0.4, 1.3), k=(3.6, 2.4, 1.9), alpha=0.3),
    ]
)
PANE = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(eta=1.3, alpha=0.2)])
BRUSHED = vt.Stack([vt.Interface(eta=0.2, k=3.9, alpha=(0.3, 0.15), rotation=20)])
MIRROR = vt.Interface(conductor="mirror", alpha=0.5)
MATCHED = {  # with a medium that has the index of the outside
    "bare": vt.Stack([vt.Interface(eta=1.0), MIRROR]),
    "dust": vt.Stack([vt.Medium(depth=0.3, sigma_a=1.0, sigma_s=1.0), vt.Interface(eta=1.0), MIRROR]),
}
RARER = vt.Stack(  # the last medium is rarer than the outside
    [vt.Interface(eta=1.7, alpha=0.5), vt.Interface(eta=1.37), vt.Interface(conductor="mirror", alpha=0.1)],
    exterior=1.4,
)
WHITE = {  # below an interface that does nothing
    "rough mirror": vt.Stack([vt.Interface(eta=1.0, alpha=0.1), vt.Interface(conductor="mirror", alpha=1.0)]),
    "diffuse base": vt.Stack([vt.Interface(eta=1.0, alpha=0.1), vt.Diffuse(albedo=1.0)]),
}
EDGED = {  # panes
    "rarer than the outside": vt.Stack(
        [vt.Interface(eta=1.354, alpha=0.245), vt.Interface(eta=1.643, alpha=0.533)], exterior=1.7045, thin=True
    ),
    "with facets that stand upright": vt.Stack(
        [vt.Interface(eta=2.0773, alpha=0.6409), vt.Interface(eta=1.5054, alpha=0.5008)], exterior=1.7045, thin=True
    ),
}
ROUND = vt.Stack([vt.Interface(conductor="mirror", alpha=0.2)])
CROSSED = vt.Stack(  # once an axis of the metal shrinks
    [vt.Interface(eta=1.34, alpha=(0.42, 0.85)), vt.Interface(conductor="Te-e_palik", alpha=1.0)]
)
NEARLY_ROUND = vt.Stack(  # another axis is the longer one over a step
    [vt.Interface(eta=1.12, alpha=(0.507, 0.513)), vt.Interface(conductor="Te-e_palik", alpha=1.0)]
)
UP, DOWN = (-0.45, -0.15, 0.75), (-0.45, -0.15, -0.75)


@pytest.fixture(autouse=True)
def finely(monkeypatch: pytest.MonkeyPatch) -> None:
    """Values as finely solved as those of gradients: else their error, over a step, hides slopes. Both are less fine
    than in programs, and within the same bounds."""
    facets, normals = 610, 987
    monkeypatch.setattr(solve, "FINELY", (facets, normals))
    monkeypatch.setattr(solve, "SAMPLES", facets)
    monkeypatch.setattr(solve, "NORMALS", dict.fromkeys(solve.NORMALS, normals))


def value(bsdf: Any, wo: tuple[float, ...]) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = dr.normalize(mi.Vector3f(0.4, 0.3, 0.8))
    dr.make_opaque(si)
    return dr.sum(bsdf.eval(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(*wo))))


def difference(stack: vt.Stack, key: str, wo: tuple[float, ...]) -> list[float]:
    """By channel, over a step of 2 %, or 1 degree."""
    given = stack.flat()[key]
    colour = given if isinstance(given, tuple) else (given,)
    found = []
    for k, x in enumerate(colour):
        step = 1.0 if key.endswith("rotation") else 0.02 * x
        ends = []
        for end in (x - step, x + step):
            new = (*colour[:k], end, *colour[k + 1 :])
            ends.append(float(value(vt.bsdf(stack.replace(**{key: new if len(new) > 1 else end})), wo)[0]))
        found.append((ends[1] - ends[0]) / (2 * step))
    return found


@pytest.mark.parametrize(
    ("stack", "keys", "wo"),
    (
        (COATED, "layer0_eta layer1_depth layer1_sigma_a layer1_sigma_s layer1_g layer2_eta layer2_k", UP),
        (PANE, "layer0_eta layer1_eta", DOWN),
        (BRUSHED, "layer0_alpha_u layer0_rotation layer0_k", UP),
        (ROUND, "layer0_alpha_u layer0_alpha_v", UP),
    ),
)
def test_gradients_are_differences(stack: vt.Stack, keys: str, wo: tuple[float, ...]) -> None:
    """To 2 %: some values change where nodes lie, and so by how much they are off."""
    bsdf = vt.bsdf(stack)
    parameters, given = mi.traverse(bsdf), stack.flat()
    # A colour that is one number is one variable
    variables = {key: (mi.Color3f if isinstance(given[key], tuple) else mi.Float)(given[key]) for key in keys.split()}
    for key, variable in variables.items():
        dr.enable_grad(variable)
        parameters[key] = variable
    parameters.update()
    dr.backward(value(bsdf, wo))
    for key, variable in variables.items():
        np.testing.assert_allclose(np.array(dr.grad(variable)).ravel(), difference(stack, key, wo), rtol=0.02)


@pytest.mark.parametrize("stack", MATCHED.values(), ids=MATCHED)
def test_a_gradient_by_the_index_of_the_outside_is_the_slope_towards_denser_media(stack: vt.Stack) -> None:
    """Light has a kink there: lobes and their columns are to have the slope of the same side, to 5 % over 2 %."""
    (key,) = (name for name in stack.flat() if name.endswith("_eta"))
    bsdf, eta = vt.bsdf(stack), mi.Float(1.0)
    parameters = mi.traverse(bsdf)
    dr.enable_grad(eta)
    parameters[key] = eta
    parameters.update()
    dr.backward(value(bsdf, UP))
    same, denser = (float(value(vt.bsdf(stack.replace(**{key: x})), UP)[0]) for x in (1.0, 1.02))
    assert float(dr.grad(eta)[0]) == pytest.approx((denser - same) / 0.02, rel=0.05)


def lit(bsdf: Any, wi: tuple[float, ...], weight: Callable[[Any], Any]) -> Any:
    """The mean of light that leaves, by a weight of its cosine."""
    u, turn = (mi.Float(x) for x in low_discrepancy.fibonacci(28657))
    wo = mi.warp.square_to_cosine_hemisphere(mi.Point2f(u, turn))
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(u))
    si.wi = dr.normalize(mi.Vector3f(*wi))
    return dr.mean(dr.mean(bsdf.eval(mi.BSDFContext(), si, wo)) * weight(wo.z) * dr.pi / wo.z)


def test_the_edge_of_light_moves_with_its_index() -> None:
    """The gradient of light at the horizon by the index of the medium that it leaves, to 3 %."""

    def at_the_horizon(bsdf: Any) -> Any:
        return lit(bsdf, (0.4, 0.3, 0.8), lambda z: dr.select(z < 0.5, 1.0, 0.0))

    bsdf, eta = vt.bsdf(RARER), mi.Float(1.37)
    parameters = mi.traverse(bsdf)
    dr.enable_grad(eta)
    parameters["layer1_eta"] = eta
    parameters.update()
    dr.backward(at_the_horizon(bsdf))
    low, high = (float(at_the_horizon(vt.bsdf(RARER.replace(layer1_eta=x * 1.37)))[0]) for x in (0.98, 1.02))
    assert float(dr.grad(eta)[0]) == pytest.approx((high - low) / (0.04 * 1.37), rel=0.03)


@pytest.mark.parametrize("stack", WHITE.values(), ids=WHITE)
def test_white_materials_reflect_all_light_beside_an_index_that_is_that_of_the_outside(stack: vt.Stack) -> None:
    """The gradient of all light at a slant by that index is 0, to .02 per unit of it: a lattice errs so at a slant."""
    bsdf, eta = vt.bsdf(stack), mi.Float(1.0)
    parameters = mi.traverse(bsdf)
    dr.enable_grad(eta)
    parameters["layer0_eta"] = eta
    parameters.update()
    light = lit(bsdf, (0.94, 0.0, 0.34), lambda z: 1.0)
    dr.backward(light)
    assert float(light[0]) == pytest.approx(1, abs=0.01)
    assert float(dr.grad(eta)[0]) == pytest.approx(0, abs=0.02)


@pytest.mark.parametrize("pane", EDGED.values(), ids=EDGED)
def test_light_that_passes_facets_has_edges_that_move_with_an_index(pane: vt.Stack) -> None:
    """The gradient of all light that a white pane lets pass is its slope, and that of all light is 0, to .15 per unit
    of the logarithm: light is uneven by .004 over such steps. Slopes without the edges were off by .7."""
    u, turn = (mi.Float(x) for x in low_discrepancy.fibonacci(28657))
    w = mi.warp.square_to_cosine_hemisphere(mi.Point2f(u, turn))
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(u))
    si.wi = mi.Vector3f(0.643, 0.0, 0.766)
    bsdf, eta = vt.bsdf(pane), pane.flat()["layer0_eta"]
    called, parameters = dr.opaque(mi.BSDFPtr, bsdf, dr.width(u)), mi.traverse(bsdf)

    def light(scale: Any) -> list[Any]:
        parameters["layer0_eta"] = eta * scale
        parameters.update()
        each = (mi.Vector3f(w.x, w.y, side * w.z) for side in (1, -1))
        return [dr.mean(called.eval(mi.BSDFContext(), si, wo)) * (dr.pi / w.z) for wo in each]

    scale = mi.Float(1.0)
    dr.enable_grad(scale)
    lights = light(scale)
    dr.forward(scale)
    back, through = (float(np.mean(np.array(dr.grad(each)))) for each in lights)
    low, high = (float(np.mean(np.array(light(mi.Float(x))[1]))) for x in (0.98, 1.02))
    assert through == pytest.approx((high - low) / 0.04, abs=0.15)
    assert back + through == pytest.approx(0, abs=0.15)


def test_one_variable_for_both_axes_leaves_an_interface_isotropic(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two roughnesses, each one variable for both of its axes: to 2 %, over smaller steps, and so of more normals."""
    facets, normals = 6765, 28657
    monkeypatch.setattr(solve, "FINELY", (facets, normals))
    monkeypatch.setattr(solve, "SAMPLES", facets)
    monkeypatch.setattr(solve, "NORMALS", {True: normals})
    bsdf = vt.bsdf(COATED)
    parameters = mi.traverse(bsdf)
    roughness = {0: mi.Float(0.1), 2: mi.Float(0.3)}
    dr.enable_grad(roughness)
    for layer, alpha in roughness.items():
        parameters[f"layer{layer}_alpha_u"] = alpha
        parameters[f"layer{layer}_alpha_v"] = alpha
    parameters.update()
    assert not mi.has_flag(bsdf.flags(), mi.BSDFFlags.Anisotropic)
    dr.backward(value(bsdf, UP))
    for layer, alpha in roughness.items():
        x = float(dr.detach(alpha)[0])
        step = 0.02 * x
        low, high = (
            float(value(vt.bsdf(COATED.replace(**{f"layer{layer}_alpha": end})), UP)[0]) for end in (x - step, x + step)
        )
        assert np.isclose(float(dr.grad(alpha)[0]), (high - low) / (2 * step), rtol=0.02, atol=0.003)


@pytest.mark.parametrize(
    ("stack", "key", "ends"),
    [(CROSSED, "layer1_alpha_v", (0.94, 1.0)), (NEARLY_ROUND, "layer0_alpha_u", (0.94, 1.06))],
    ids=["crossed", "nearly round"],
)
def test_a_gradient_by_an_axis_that_gets_alike_to_the_other_is_a_difference(
    stack: vt.Stack, key: str, ends: tuple[float, float]
) -> None:
    """Of all light, over the step: there the interface is brushed along another axis, and lobes are parted."""
    bsdf, rng = vt.bsdf(stack), np.random.default_rng(1)
    parameters, count = mi.traverse(bsdf), 1 << 12
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi, wo = (mi.warp.square_to_uniform_hemisphere(mi.Point2f(rng.random((2, count)))) for _ in range(2))

    def light() -> Any:
        called = dr.opaque(mi.BSDFPtr, bsdf, count)
        return 2 * dr.pi * dr.mean(dr.mean(called.eval(mi.BSDFContext(), si, wo)))

    x = stack.flat()[key]
    variable = mi.Float(x)
    dr.enable_grad(variable)
    parameters[key] = variable
    parameters.update()
    dr.backward(light())
    low, high = (_lit_at(parameters, key, share * x, light) for share in ends)
    over = (ends[1] - ends[0]) * x
    assert float(dr.grad(variable)[0]) * over == pytest.approx(high - low, rel=0.1, abs=5e-4)


def _lit_at(parameters: Any, key: str, x: float, light: Callable[[], Any]) -> float:
    parameters[key] = mi.Float(x)
    parameters.update()
    return float(light()[0])


def test_a_colour_is_optimised_from_grey() -> None:
    """The absorption of a coat, from its light in some directions: within .02 of that of the target."""
    coat = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Medium(sigma_a=0.5), vt.Interface(conductor="Au", alpha=0.3)])
    truth, key, wo = (0.1, 0.4, 0.9), "layer1_sigma_a", dr.normalize(mi.Vector3f(-0.3, 0.1, 1))
    si = dr.zeros(mi.SurfaceInteraction3f, 16)
    angle = dr.two_pi / 16 * dr.arange(mi.Float, 16)
    si.wi = dr.normalize(mi.Vector3f(dr.cos(angle), dr.sin(angle), 1.5))
    expected = vt.bsdf(coat.replace(**{key: truth})).eval(mi.BSDFContext(), si, wo)
    bsdf = vt.bsdf(coat)
    parameters = mi.traverse(bsdf)
    optimiser = mi.ad.Adam(lr=0.2, beta_1=0.3, params={key: parameters[key]})
    for step in range(12):
        parameters[key] = optimiser[key]
        parameters.update()
        dr.backward(dr.mean(dr.square(bsdf.eval(mi.BSDFContext(), si, wo) / expected - 1), axis=None))
        optimiser.set_learning_rate(0.2 * 0.85**step)
        optimiser.step()
    np.testing.assert_allclose(np.ravel(optimiser[key]), truth, atol=0.02)
