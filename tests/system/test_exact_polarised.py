"""Mueller matrices of the form `exact` in a polarised variant.

Single interfaces are those of Mitsuba's own plugins, in its frames. Smooth stacks polarise as sums of all ways by
amplitudes of the package `tmm`, and films by the wavelengths of a ray as `tmm` has them; so do coats over metal that
are nearly smooth. Rough stacks over a medium polarise as walks that carry Stokes vectors do, by z-tests at .1 % for
each of four parameters. The seeds are fixed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import tmm

import velatura as vt
from velatura import Film, Interface, Medium, Stack, kernel
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


def smooth(bsdf: Any, cosine: float, mode: Any = mi.TransportMode.Radiance) -> dict[str, np.ndarray]:
    """Matrices (C, 4, 4) of what a smooth BSDF reflects, and transmits, in frames along the surface."""
    wi, context = direction(cosine, 0.4), mi.BSDFContext(mode)
    found = {}
    for u in (mi.Float(0.001), mi.Float(0.999)):
        dr.make_opaque(wi, u)  # one kernel for all directions
        bs, weight = bsdf.sample(context, points(wi, 2), u, mi.Point2f(0.3, 0.6))
        into, away = (bs.wo, wi) if mode == mi.TransportMode.Radiance else (wi, bs.wo)
        before, after = (mi.Vector3f(*horizontal(tuple(w))) for w in (into, away))
        basis, turned = mi.mueller.stokes_basis, mi.mueller.rotate_mueller_basis
        matrix = turned(weight * bs.pdf, -into, basis(-into), before, away, basis(away), after)
        channels = len(mi.UnpolarizedSpectrum())
        each = [[np.broadcast_to(np.array(x), (channels, 2))[:, 0] for x in row] for row in matrix]
        found["reflected" if bs.wo.z[0] * cosine > 0 else "transmitted"] = np.moveaxis(np.array(each), -1, 0)
    return found


def of_amplitudes(s: complex, p: complex, product: complex) -> np.ndarray:
    """Matrix in the frame of the plane of incidence, of shares of s and p, and the sum of r_s conj(r_p)."""
    a, b, re, im = (s + p) / 2, (s - p) / 2, product.real, product.imag
    return np.array([[a, b, 0, 0], [b, a, 0, 0], [0, 0, re, -im], [0, 0, im, re]]).real


def direction(cosine: float, azimuth: float = 0.0) -> Any:
    sine = (1 - cosine * cosine) ** 0.5
    return mi.Vector3f(*map(float, (sine * np.cos(azimuth), sine * np.sin(azimuth), cosine)))


def points(wi: Any, count: int) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi, si.uv = wi, mi.Point2f(dr.arange(mi.Float, count) / count, 0.5)
    if mi.is_spectral:
        si.wavelengths = mi.UnpolarizedSpectrum(450, 520, 580, 640)
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


@pytest.mark.parametrize("mode", [mi.TransportMode.Radiance, mi.TransportMode.Importance])
def test_smooth_interfaces_are_those_of_mitsuba(mode: Any) -> None:
    metal, glass = made(Interface(**METAL)), made(Interface(eta=1.5))
    conductor, dielectric = (mi.load_dict(x) for x in ({"type": "conductor", **METAL}, {"type": "dielectric", **GLASS}))
    for cosine in (0.9, 0.3, -0.3, -0.9):
        for bsdfs in ((glass, dielectric), (metal, conductor))[: 1 + (cosine > 0)]:
            a, b = (smooth(bsdf, cosine, mode) for bsdf in bsdfs)
            assert a.keys() == b.keys()
            for name in a:
                assert np.allclose(a[name], b[name], atol=1e-5)


@pytest.mark.parametrize("index", [(1.0, 1.5, 0.2 + 3.9j), (1.0, 1.8, 1.3, 1.0), (1.5, 2.1, 1.2)])
def test_smooth_stacks_are_sums_of_all_ways_by_tmm(index: tuple[complex, ...]) -> None:
    """Shares of s and p, with absorption between, and phases; from either side, and beyond the critical angle."""
    depth, opaque = 0.3, np.iscomplex(index[-1])
    layers: list[Any] = []
    for k, n in enumerate(index[1:]):
        layers += [Medium(sigma_a=depth)] if k else []
        layers.append(Interface(eta=n.real, k=n.imag) if np.iscomplex(n) else Interface(eta=float(n.real)))
    bsdf = mi.load_dict({
        "type": "layered", "material": dumps(Stack(layers, exterior=index[0]), "json"), "form": "exact"
    })  # fmt: skip
    for cosine in (0.95, 0.65, 0.3, 0.1, -0.9, -0.4)[: 4 if opaque else 6]:
        wanted = by_ways(index[:: 1 if cosine > 0 else -1], abs(cosine), depth)
        found = smooth(bsdf, cosine, mi.TransportMode.Importance)
        for name, matrix in found.items():
            assert np.allclose(matrix, wanted[name], atol=2e-4), (name, cosine)


def by_ways(index: tuple[complex, ...], cosine: float, depth: float) -> dict[str, np.ndarray]:
    """Matrices of smooth interfaces between thick media: light is followed from interface to interface by amplitudes of
    `tmm`, s with p, until little is left."""
    angles = tmm.list_snell(np.array(index, complex), np.arccos(cosine))
    pairs = [("s", "s"), ("p", "p"), ("s", "p")]

    def amplitudes(of: Any, a: int, b: int) -> np.ndarray:
        r = {x: of(x, index[a], index[b], angles[a], angles[b]) for x in "sp"}
        return np.array([r[x] * np.conj(r[y]) for x, y in pairs])

    def passes(a: int, b: int) -> np.ndarray:
        if not np.isreal(np.round(np.cos(angles[b]), 12)) or np.iscomplex(index[b]):
            return np.zeros(3)
        share = (index[b] * np.cos(angles[b])) / (index[a] * np.cos(angles[a]))
        return amplitudes(tmm.interface_t, a, b) * share.real

    last = len(index) - 1
    light = {(0, 1): np.ones(3, complex)}  # by medium and direction, downwards 1
    out = {0: np.zeros(3, complex), last: np.zeros(3, complex)}
    for _ in range(2000):
        onward: dict[tuple[int, int], np.ndarray] = {}
        for (k, way), carried in light.items():
            if 0 < k < last:
                carried = carried * np.exp(-depth / np.cos(angles[k]).real)
            for to, new, share in (
                (k, -way, amplitudes(tmm.interface_r, k, k + way)),
                (k + way, way, passes(k, k + way)),
            ):
                leaves = (to == 0 and new < 0) or (to == last and new > 0)
                if leaves:
                    out[to] += carried * share
                elif np.abs(carried * share).max() > 1e-9:
                    onward[to, new] = onward.get((to, new), 0) + carried * share
        light = onward
    return {name: of_amplitudes(*out[k]) for name, k in (("reflected", 0), ("transmitted", last))}


@pytest.mark.parametrize("film", [(2.0, 0.0), (1.8, 0.2)])
def test_films_polarise_as_those_of_tmm_by_wavelength(film: tuple[float, float]) -> None:
    kernel.mitsuba("llvm_ad_spectral_polarized")
    vt.register()
    nm, depth = (450.0, 520.0, 580.0, 640.0), 300.0
    eta, k = film
    layers = {
        (1.0, 1.5): Interface(eta=1.5, films=[Film(eta=eta, k=k, thickness_nm=depth)]),
        (1.0, 0.5 + 3j): Interface(eta=0.5, k=3.0, films=[Film(eta=eta, k=k, thickness_nm=depth)]),
    }
    for ends, layer in layers.items():
        bsdf = made(layer)
        for cosine in (0.9, 0.4, -0.4)[: 2 if np.iscomplex(ends[1]) else 3]:
            found = smooth(bsdf, cosine, mi.TransportMode.Importance)
            above, below = ends if cosine > 0 else ends[::-1]
            for k, wavelength in enumerate(nm):
                of = [above, complex(*film), below], [np.inf, depth, np.inf], np.arccos(abs(cosine)), wavelength
                s, p = (tmm.coh_tmm(kind, *of) for kind in "sp")
                product = s["t"] * np.conj(p["t"])
                wanted = {
                    "reflected": of_amplitudes(s["R"], p["R"], s["r"] * np.conj(p["r"])),
                    "transmitted": of_amplitudes(s["T"], p["T"], product / abs(product) * np.sqrt(s["T"] * p["T"])),
                }
                for name, matrices in found.items():
                    assert np.allclose(matrices[k], wanted[name], atol=1e-4), (name, wavelength, cosine)


OXIDE = Interface(eta=0.5, k=3.0, alpha=0.3, films=[Film(eta=2.0, thickness_nm=300)])


def of_facet(bsdf: Any) -> np.ndarray:
    """Matrices (C, 4, 4), over the intensity, of light that one facet reflects at 31 degrees."""
    wi, wo = direction(np.cos(0.9)), direction(np.cos(0.17), np.pi)
    value = bsdf.eval(mi.BSDFContext(), points(wi, 1), wo)
    before, after = (mi.Vector3f(*horizontal(tuple(w))) for w in (wo, wi))
    basis = mi.mueller.stokes_basis
    found = np.array(mi.mueller.rotate_mueller_basis(value, -wo, basis(-wo), before, wi, basis(wi), after), float)
    found = np.moveaxis(found.reshape(4, 4, -1), -1, 0)
    return found / found[:, :1, :1]


def test_films_on_facets_polarise_by_wavelength() -> None:
    kernel.mitsuba("llvm_ad_spectral_polarized")
    vt.register()
    for matrix, nm in zip(of_facet(made(OXIDE)), (450.0, 520.0, 580.0, 640.0)):
        index, depths = [1.0, 2.0, 0.5 + 3j], [np.inf, 300.0, np.inf]
        s, p = (tmm.coh_tmm(kind, index, depths, (0.9 + 0.17) / 2, nm) for kind in "sp")
        wanted = of_amplitudes(s["R"], p["R"], s["r"] * np.conj(p["r"]))
        assert np.allclose(matrix, wanted / wanted[0, 0], atol=1e-3)


def test_films_whose_thickness_is_a_texture_polarise_as_others() -> None:
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(np.full((2, 2, 1), 0.5, np.float32)), "raw": True}
    plugin = {"type": "layered", "material": dumps(Stack([OXIDE]), "json"), "form": "exact"}
    uniform = of_facet(mi.load_dict(plugin | {"layer0_film0_thickness_nm": 0.5}))
    textured = of_facet(mi.load_dict(plugin | {"layer0_film0_thickness_nm": texture}))
    assert np.allclose(uniform, textured, atol=0.004)


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
