"""Mueller matrices of the form `exact` in a polarised variant.

Single interfaces are those of Mitsuba's own plugins, in its frames. Coats over metal that are nearly smooth polarise as
the package `tmm` has them, and rough ones over a medium as walks that carry Stokes vectors do, by z-tests at .1 % for
each of four parameters. The seeds are fixed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import tmm

import velatura as vt
from velatura import Interface, Medium, Stack, kernel
from velatura.optics.polarisation import horizontal
from velatura.stack import dumps

mi = kernel.mitsuba()
import drjit as dr  # noqa: E402

GLASS, METAL = {"int_ior": 1.5, "ext_ior": 1.0}, {"eta": 0.2, "k": 3.9}
GGX = {"distribution": "ggx", "alpha": 0.3}
CASES = {
    "metal": (Interface(**METAL, alpha=0.3), {"type": "roughconductor", **GGX, **METAL}),
    "glass": (Interface(eta=1.5, alpha=0.3), {"type": "pplastic", **GGX, **GLASS, "diffuse_reflectance": 0.0}),
}
BOUND = 3.3  # standard errors, which chance exceeds once in a thousand tests


@pytest.fixture(autouse=True)
def polarised() -> Iterator[None]:
    """A polarised variant, and then the one before."""
    before = mi.variant()
    kernel.mitsuba("llvm_ad_mono_polarized")
    vt.register()
    yield
    kernel.mitsuba(before)


def made(*layers: Any, reflectance: str = "fgd") -> Any:
    material = dumps(Stack(list(layers)), "json")
    return mi.load_dict({"type": "layered", "material": material, "form": "exact", "reflectance": reflectance})


def direction(cosine: float, azimuth: float = 0.0) -> Any:
    sine = (1 - cosine * cosine) ** 0.5
    return mi.Vector3f(sine * float(np.cos(azimuth)), sine * float(np.sin(azimuth)), cosine)


def points(wi: Any, count: int) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi, si.uv = wi, mi.Point2f(dr.arange(mi.Float, count) / count, 0.5)
    return si


def of_samples(bsdf: Any, wi: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Matrix (4, 4) of all reflected energy, in frames along the surface, and its standard error."""
    rng, context = mi.PCG32(count, 7), mi.BSDFContext(mi.TransportMode.Importance)
    u = [rng.next_float32() for _ in range(3)]
    bs, weight = bsdf.sample(context, points(wi, count), u[0], mi.Point2f(u[1], u[2]))
    ends = mi.Vector3f(wi), bs.wo
    before, after = (mi.Vector3f(*horizontal(tuple(w))) for w in ends)
    basis, turned = mi.mueller.stokes_basis, mi.mueller.rotate_mueller_basis
    matrix = turned(weight, -ends[0], basis(-ends[0]), before, ends[1], basis(ends[1]), after)
    each = np.array(matrix, float).reshape(4, 4, count) * (np.array(bs.wo.z) > 0)
    return each.mean(-1), each.std(-1) / count**0.5


@pytest.mark.parametrize("mode", [mi.TransportMode.Radiance, mi.TransportMode.Importance])
@pytest.mark.parametrize("name", CASES)
def test_single_interfaces_are_those_of_mitsuba(name: str, mode: Any) -> None:
    ours, theirs = made(CASES[name][0]), mi.load_dict(CASES[name][1])
    wo = mi.Vector3f([0.2, -0.5, 0.7], [-0.6, 0.3, -0.2], [0.6, 0.5, 0.6])
    si = points(direction(0.6, 0.4), 3)
    a, b = (np.array(bsdf.eval(mi.BSDFContext(mode), si, dr.normalize(wo))) for bsdf in (ours, theirs))
    assert np.allclose(a, b, atol=1e-5 * np.abs(b).max())
    assert np.abs(b[0, 1]).max() > 1e-3 * np.abs(b).max()  # polarises


@pytest.mark.parametrize("index", [(1.0, 2.0, 1 + 1j), (1.0, 1.5, 0.2 + 3.9j)])
def test_coats_polarise_as_layers_of_tmm(index: tuple[complex, ...]) -> None:
    """Where they are nearly smooth, for s and p: the first row, and the first column."""
    coat, metal = Interface(eta=index[1].real, alpha=0.002), Interface(eta=index[2].real, k=index[2].imag, alpha=0.002)
    found, error = of_samples(made(coat, metal), direction(0.4, 0.5), 2**17)
    depths, kinds = [np.inf, 1.0, np.inf], ["i", "i", "i"]
    s, p = (tmm.inc_tmm(x, list(index), depths, kinds, np.arccos(0.4), 550.0)["R"] for x in "sp")
    wanted = np.array([[s + p, s - p], [s - p, s + p]]) / 2
    # Facets that are tilted by .002 change the shares by as much
    assert np.all(np.abs(found[:2, :2] - wanted) < BOUND * error[:2, :2] + 1e-3)
    assert np.abs(found[:2, 2:]).max() < BOUND * error[:2, 2:].max() + 1e-3


@pytest.mark.parametrize("reflectance", ["fgd", "fgd-multi"])
def test_stacks_polarise_as_walks_with_stokes_vectors(reflectance: str) -> None:
    layers = [Interface(eta=2.0, alpha=0.3), Medium(sigma_s=0.2, sigma_a=0.1), Interface(eta=1.0, k=1.0, alpha=0.2)]
    found, error = of_samples(made(*layers, reflectance=reflectance), direction(0.5), 2**17)
    often = reflectance == "fgd-multi"
    walked = vt.reference.stokes(Stack(layers), 0.5, paths=400_000, microsurface=often)
    assert walked.standard_error
    light = np.sum(walked.reflected, axis=0)[:, 0, 0]
    noise = np.sqrt(np.sum(np.square(walked.standard_error.reflected), axis=0))[:, 0, 0]
    assert np.all(np.abs(found[:, 0] - light) < BOUND * np.hypot(error[:, 0], noise))
