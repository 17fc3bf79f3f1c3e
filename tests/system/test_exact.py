"""The form `exact` of `layered`: its samples carry the light that walks find, and their density is the model's.

Light in cells of directions is compared with that of walks, which are followed without any density, by z-tests at a
level of 1 % for the cells of a stack together (Sidak). The seeds are fixed. `benchmarks/exact.py` has more stacks.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from benchmarks import benchmark

import velatura as vt
from velatura import Diffuse, Interface, Medium, Stack, kernel
from velatura.errors import InvalidInput

mi = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

pytestmark = pytest.mark.usefixtures("one_thread")

vt.register()

exact = benchmark("exact")

WO = mi.Vector3f(-0.6, 0.0, 0.8)
COUNT = 150_000
METAL = [Interface(eta=1.5, alpha=0.2), Interface(eta=0.2, k=3.9, alpha=0.3)]
PANE = [
    Interface(eta=1.5, alpha=0.3),
    Medium(sigma_s=(0.5, 1.0, 1.5), sigma_a=(0.1, 0.3, 0.0), g=0.5),
    Interface(eta=1.0, alpha=0.3),
]
PAINT = [Interface(eta=1.5), Medium(sigma_a=0.2), Diffuse(albedo=(0.9, 0.5, 0.2))]
COATS = [
    Interface(eta=1.3, alpha=0.1),
    Medium(sigma_a=0.1),
    Interface(eta=1.8, alpha=0.2),
    Interface(eta=0.2, k=3.9, alpha=0.1),
]
MIST = [Medium(sigma_s=0.7, g=0.3), Interface(eta=1.5, alpha=0.2), Interface(eta=0.2, k=3.9, alpha=0.3)]
BRUSHED = [Interface(eta=1.5, alpha=0.1), Interface(eta=0.2, k=3.9, alpha=(0.4, 0.1), rotation=30)]
CASES = {
    "metal": (METAL, "fgd-multi", 0.7),
    "brushed": (BRUSHED, "fgd", 0.5),
    "coats": (COATS, "fgd", 0.4),
    "mist": (MIST, "fgd", 0.6),
    "paint": (PAINT, "fgd", 0.7),
    "pane": (PANE, "fgd", 0.7),
    "pane from below": (PANE, "fgd", -0.5),
}


def plugins(layers: list, reflectance: str = "fgd") -> dict[str, Any]:
    return exact.bsdfs(Stack(layers), reflectance == "fgd-multi")


def made(layers: list, reflectance: str = "fgd") -> Any:
    return mi.load_dict(plugins(layers, reflectance)["exact"])


def direction(cosine: float) -> list[float]:
    sine = float(np.sqrt(1 - cosine * cosine))
    return [sine * 0.8, sine * 0.6, cosine]


@pytest.mark.parametrize("name", CASES)
def test_samples_carry_the_light_of_walks(name: str) -> None:
    layers, reflectance, cosine = CASES[name]
    walk = mi.load_dict(plugins(rough(layers), reflectance)["walk"])
    each = (exact.drawn(mi, bsdf, direction(cosine), COUNT, 3) for bsdf in (made(layers, reflectance), walk))
    z = exact.deviations(*(exact.cells(*found) for found in each))
    assert len(z) >= 12
    assert np.abs(z).max() < exact.bound(len(z))


def rough(layers: list) -> list:
    """Layers whose interfaces are as rough as the exact form has them, so that all light is scattered."""
    return [Interface(eta=layer.eta, alpha=1e-3) if layer == Interface(eta=1.5) else layer for layer in layers]


def test_a_bias_of_one_percent_is_found() -> None:
    """In all light of one stack."""
    count, walk = 400_000, mi.load_dict(plugins(METAL)["walk"])
    a, b = (exact.drawn(mi, bsdf, direction(0.7), count, 3)[1][0] for bsdf in (made(METAL), walk))
    error = np.hypot(a.std(), b.std()) / np.sqrt(count)
    assert abs(a.mean() - b.mean()) < 3 * error
    assert abs(1.01 * a.mean() - b.mean()) > 3 * error


def test_a_single_interface_has_no_noise() -> None:
    bsdf = made([Interface(eta=0.2, k=3.9, alpha=0.3)])
    value = np.array(bsdf.eval(mi.BSDFContext(), exact.interactions(mi, direction(0.7), 100), WO))
    theirs = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.3, "eta": 0.2, "k": 3.9}
    other = mi.load_dict(theirs).eval(mi.BSDFContext(), exact.interactions(mi, direction(0.7), 1), WO)
    assert np.allclose(value, np.array(other), rtol=1e-4)


def test_samples_reach_directions_that_the_model_has_no_light_in() -> None:
    bsdf, si = made([Interface(eta=0.2, k=3.9, alpha=0.01)]), exact.interactions(mi, direction(0.7), 1000)
    wo = mi.warp.square_to_uniform_hemisphere(mi.Point2f(mi.PCG32(1000).next_float32(), 0.7))
    assert np.all(np.array(bsdf.pdf(mi.BSDFContext(), si, wo)) >= 0.019 * np.array(wo.z) / np.pi)


def test_components_add_up() -> None:
    """Light of the base, and all other reflected light, of the same walks."""
    bsdf, si = made(PAINT), exact.interactions(mi, direction(0.7), 1000)
    wo = mi.warp.square_to_cosine_hemisphere(mi.Point2f(mi.PCG32(1000).next_float32(), 0.3))
    values = []
    for component in (0xFFFFFFFF, 0, 1):
        context = mi.BSDFContext()
        context.component = component
        values.append(np.array(bsdf.eval(context, si, wo)))
    assert bsdf.component_count() == 2 and bsdf.flags(1) & int(mi.BSDFFlags.DiffuseReflection)
    assert np.allclose(values[0], values[1] + values[2], rtol=1e-4, atol=1e-6)


def test_gradients_are_those_of_the_model() -> None:
    found = []
    for form in ("exact", "forward"):
        bsdf = vt.bsdf(Stack(METAL), form=form, reflectance="fgd")
        parameters, alpha = mi.traverse(bsdf), mi.Float(0.3)
        dr.enable_grad(alpha)
        parameters["layer1_alpha_u"] = parameters["layer1_alpha_v"] = alpha
        parameters.update()
        value = bsdf.eval(mi.BSDFContext(), exact.interactions(mi, direction(0.7), 100), WO)
        dr.backward(dr.mean(value.x))
        found.append(dr.grad(alpha)[0])
    assert found[0] == pytest.approx(found[1], rel=1e-4) and found[1] != 0


def test_smooth_stacks_are_mirrors() -> None:
    bsdf = made([Interface(eta=1.5), Interface(eta=0.2, k=3.9)])
    assert bsdf.flags() & int(mi.BSDFFlags.DeltaReflection)


def test_what_cannot_be_exact_is_refused() -> None:
    with pytest.raises(InvalidInput, match="form=exact: of the model velatura only"):
        vt.bsdf("coated-gold", "belcour2018", form="exact")
    with pytest.raises(InvalidInput, match="form=exact: no interface bends light"):
        vt.bsdf(Stack([Interface(eta=1.0), Medium(sigma_s=1.0), Interface(eta=1.0)]), "exact")
