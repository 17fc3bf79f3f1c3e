"""The symmetric form of solved materials: reciprocal to rounding, with the energy of every part."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.renderer.packets import aligned

mi: Any = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

STACKS = {
    "coat": vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(conductor="Au", alpha=0.25)]),
    "brushed": vt.Stack(
        [vt.Interface(eta=1.5, alpha=0.05), vt.Interface(conductor="Al", alpha=(0.1, 0.3), rotation=20)]
    ),
    "pane": vt.Stack([vt.Interface(eta=1.5, alpha=0.3), vt.Interface(eta=1.33, alpha=0.1)]),
}


def interactions(wi: Any) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wi))
    si.wi = wi
    return si


def directions(count: int, seed: int, both_sides: bool) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(-1 if both_sides else 0.05, 1, count), rng.uniform(0, 2 * np.pi, count)
    z = np.where(np.abs(z) < 0.05, 0.05, z)
    return np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z])


@pytest.mark.parametrize("name", STACKS)
def test_exchanging_light_and_view_changes_nothing_but_rounding(name: str) -> None:
    """Expected: f over the squared index of the medium of wo is the same both ways, to 1e-4 in single precision."""
    bsdf, pane = vt.bsdf(STACKS[name], form="symmetric"), name == "pane"
    wi, wo = directions(4000, 1, pane), directions(4000, 2, pane)
    context = mi.BSDFContext(mi.TransportMode.Importance)
    there, back = (
        np.array(bsdf.eval(context, interactions(mi.Vector3f(a)), mi.Vector3f(b))) / np.abs(b[2])
        for a, b in ((wi, wo), (wo, wi))
    )
    index = np.where(wi[2] > 0, 1.0, 1.33 if pane else 1.0), np.where(wo[2] > 0, 1.0, 1.33 if pane else 1.0)
    np.testing.assert_allclose(there / index[1] ** 2, back / index[0] ** 2, rtol=2e-4, atol=1e-6)
    assert (there > 1e-3).any(axis=0).mean() > 0.5


@pytest.mark.parametrize("form", ["forward", "symmetric"])
@pytest.mark.parametrize("name", STACKS)
def test_every_component_has_its_energy(name: str, form: str) -> None:
    """Expected: by 2 * 10^5 samples, the albedo of all components is that of the layers, to .01."""
    bsdf, n = vt.bsdf(STACKS[name], form=form), 200_000
    rng = np.random.default_rng(3)
    context = mi.BSDFContext(mi.TransportMode.Importance)
    for z in (0.95, 0.5, *((-0.8, -0.4) if name == "pane" else ())):
        wi = mi.Vector3f(float(np.sqrt(1 - z * z)), 0, z)
        dr.make_opaque(wi)  # one kernel for all angles
        si = interactions(dr.repeat(wi, n))
        found = np.zeros(3)
        for k in range(bsdf.component_count()):
            context.component = k
            _, weight = bsdf.sample(context, si, mi.Float(aligned(rng.random(n))), mi.Point2f(rng.random((2, n))))
            found = found + np.array(weight).mean(axis=1)
        expected = np.array(bsdf.eval_diffuse_reflectance(interactions(wi))).ravel()
        np.testing.assert_allclose(found, expected, atol=0.01)
