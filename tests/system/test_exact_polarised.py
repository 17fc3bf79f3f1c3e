"""Mueller matrices of the form `exact` and of `layered_reference` in a polarised variant.

Single interfaces are those of Mitsuba's own plugins, in its frames. Smooth stacks polarise as sums of all ways by
amplitudes of the package `tmm`, and films by the wavelengths of a ray as `tmm` has them; so do coats over metal that
are nearly smooth. Rough stacks over a medium polarise as walks that carry Stokes vectors do, by z-tests at .1 % for
each of four parameters. Values and samples of `layered_reference`, by different ways through smooth interfaces, are the
same light. Facets out of the plane of incidence have the matrices of NIST's SCATMECH. The seeds are fixed.
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

pytestmark = pytest.mark.usefixtures("one_thread")

GLASS, METAL = {"int_ior": 1.5, "ext_ior": 1.0}, {"eta": 0.2, "k": 3.9}
GGX = {"distribution": "ggx", "alpha": 0.3}
CASES = {
    "metal": (Interface(**METAL, alpha=0.3), {"type": "roughconductor", **GGX, **METAL}),
    "glass": (Interface(eta=1.5, alpha=0.3), {"type": "pplastic", **GGX, **GLASS, "diffuse_reflectance": 0.0}),
}
BOUND = 3.3  # standard errors, which chance exceeds once in a thousand tests


@pytest.fixture(scope="module", autouse=True)
def variant_kept() -> Iterator[None]:
    before = mi.variant()
    yield
    kernel.mitsuba(before)


@pytest.fixture(autouse=True)
def polarised(variant_kept: None) -> None:
    """A polarised variant, unless the test before has left it."""
    if mi.variant() != "llvm_ad_mono_polarized":
        kernel.mitsuba("llvm_ad_mono_polarized")
        vt.register()


def made(*layers: Any, reflectance: str = "fgd") -> Any:
    material = dumps(Stack(list(layers)), "json")
    return mi.load_dict({"type": "layered", "material": material, "form": "exact", "reflectance": reflectance})


def walked(*layers: Any, **options: Any) -> Any:
    material = dumps(Stack(list(layers)), "json")
    return mi.load_dict({"type": "layered_reference", "material": material, **options})


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
        dr.eval(matrix, bs.wo)  # in one kernel
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


def of_samples(bsdf: Any, wi: Any, count: int, side: float = 1.0, delta: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Matrix (4, 4) of all energy that leaves on a side, in frames along the surface, and its standard error; with that
    of smooth interfaces alone, or without."""
    rng, context = mi.PCG32(count, 7), mi.BSDFContext(mi.TransportMode.Importance)
    u = [rng.next_float32() for _ in range(3)]
    bs, weight = bsdf.sample(context, points(wi, count), u[0], mi.Point2f(u[1], u[2]))
    dr.eval(bs, weight)  # once, though it is read thrice
    smooth = np.array(bs.sampled_type & mi.UInt32(+mi.BSDFFlags.Delta)) > 0
    return mean_and_error(weight, wi, bs.wo, (side * np.array(bs.wo.z) > 0) & (delta | ~smooth))


def of_values(bsdf: Any, wi: Any, count: int, side: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """The same by values in directions of the cosine law."""
    rng = mi.PCG32(count, 8)
    wo = mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
    weight = bsdf.eval(mi.BSDFContext(mi.TransportMode.Importance), points(wi, count), side * wo) * (dr.pi / wo.z)
    return mean_and_error(weight, wi, side * wo, np.full(count, True))


def mean_and_error(matrix: Any, wi: Any, wo: Any, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Those over all directions of matrices from wi to wo, in frames along the surface, 0 where they are not kept."""
    each = along_surface(matrix, wi, wo).reshape(4, 4, -1) * kept
    return each.mean(-1), each.std(-1) / each.shape[-1] ** 0.5


def along_surface(matrix: Any, wi: Any, wo: Any) -> np.ndarray:
    """Matrices (4, 4, ...) of light from wi to wo, in frames along the surface."""
    before, after = (mi.Vector3f(*horizontal(tuple(w))) for w in (wi, wo))
    basis = mi.mueller.stokes_basis
    return np.array(mi.mueller.rotate_mueller_basis(matrix, -wi, basis(-wi), before, wo, basis(wo), after), float)


@pytest.mark.parametrize("mode", [mi.TransportMode.Radiance, mi.TransportMode.Importance])
@pytest.mark.parametrize("plugin", [made, walked])
@pytest.mark.parametrize("name", CASES)
def test_single_interfaces_are_those_of_mitsuba(name: str, plugin: Any, mode: Any) -> None:
    ours, theirs = plugin(CASES[name][0]), mi.load_dict(CASES[name][1])
    wo = mi.Vector3f([0.2, -0.5, 0.7], [-0.6, 0.3, -0.2], [0.6, 0.5, 0.6])
    si = points(direction(0.6, 0.4), 3)
    a, b = (np.array(bsdf.eval(mi.BSDFContext(mode), si, dr.normalize(wo))) for bsdf in (ours, theirs))
    assert np.allclose(a, b, atol=1e-5 * np.abs(b).max())
    assert np.abs(b[0, 1]).max() > 1e-3 * np.abs(b).max()  # polarises


# Matrices of one facet over the intensity, by pySCATMECH 0.1.10 (Germer, NIST), at 580 nm:
#     BRDF_Model(model, {"lambda": 0.58, "sdf": "Unit_Slope_Distribution_Function", **more}).MuellerBRDF(*radians)
# where more is {"substrate": "(0.5,3)"} for the metal, and beside it for the film {"stack": "SingleFilm_StackModel",
# "stack.material": "(2,0)", "stack.thickness": 0.3}, for the coat {"overcoat": "(1.5,0)"}; for glass it is
# {"substrate": "(1.5,0)", "type": 1}. By polar angles of incidence and of what leaves, and the azimuth of that from the
# plane of incidence, in degrees.
SCATMECH = {
    # Facet_BRDF_Model
    ("metal", 60, 30, 50): [
        [1.00000, 0.03820, -0.03903, 0.00000],
        [0.00536, -0.59842, -0.72295, 0.34101],
        [-0.05435, -0.76183, 0.64688, 0.03365],
        [0.00000, -0.24492, -0.23966, -0.93787],
    ],
    ("film", 70, 60, 10): [
        [1.00000, 0.13580, -0.05581, 0.00000],
        [0.13385, 0.69738, -0.70134, 0.13470],
        [-0.06035, -0.70359, -0.63071, 0.29876],
        [0.00000, -0.12458, -0.30313, -0.93329],
    ],
    ("glass", 60, 30, 50): [
        [1.00000, -0.13318, -0.29975, 0.00000],
        [0.25647, 0.22069, -0.95367, 0.00000],
        [-0.20448, 0.92814, 0.26978, 0.00000],
        [0.00000, 0.00000, 0.00000, 0.94468],
    ],
    # Subsurface_Facet_BRDF_Model
    ("coat", 60, 30, 50): [
        [1.00000, -0.06763, -0.00285, -0.00295],
        [0.02449, -0.33078, -0.92537, 0.17404],
        [0.06217, -0.93645, 0.34448, 0.06051],
        [0.01120, -0.11671, -0.14300, -0.98054],
    ],
    ("coat", 70, 60, 10): [
        [1.00000, -0.18140, 0.02561, -0.00862],
        [-0.17632, 0.91155, -0.39807, 0.08982],
        [0.04876, -0.40171, -0.81102, 0.38681],
        [0.01295, -0.08348, -0.38835, -0.89930],
    ],
}
FACETS = {
    "metal": [Interface(eta=0.5, k=3.0, alpha=0.3)],
    "film": [Interface(eta=0.5, k=3.0, alpha=0.3, films=[Film(eta=2.0, thickness_nm=300)])],
    "glass": [Interface(eta=1.5, alpha=0.3)],
    "coat": [Interface(eta=1.5), Interface(eta=0.5, k=3.0, alpha=0.3)],
}


@pytest.mark.parametrize("case", SCATMECH)
def test_facets_have_the_matrices_of_scatmech(case: tuple[str, int, int, int]) -> None:
    """Under a coat by one reflection: paths end with their second event. SCATMECH has V of the other sign."""
    name, theta_i, theta_o, phi = case
    if name == "film":
        kernel.mitsuba("llvm_ad_spectral_polarized")
        vt.register()
    wi = direction(np.cos(np.radians(theta_i)), np.pi)
    wo = direction((-1 if name == "glass" else 1) * np.cos(np.radians(theta_o)), np.radians(phi))
    exact = [made(*FACETS[name])] if name in ("metal", "glass") else []
    for bsdf in (walked(*FACETS[name], max_depth=2), *exact):
        value = bsdf.eval(mi.BSDFContext(mi.TransportMode.Importance), points(wi, 1), wo)
        matrix = along_surface(value, wi, wo).reshape(4, 4, -1)[..., -2 if name == "film" else 0]  # at 580 nm
        sign = np.array([1, 1, 1, -1])
        assert np.allclose(matrix / matrix[0, 0], sign * np.array(SCATMECH[case]) * sign[:, None], atol=2e-5)


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


def smooth_layers(index: tuple[complex, ...], depth: float) -> list[Any]:
    """Smooth interfaces between media that absorb."""
    layers: list[Any] = []
    for k, n in enumerate(index[1:]):
        layers += [Medium(sigma_a=depth)] if k else []
        layers.append(Interface(eta=n.real, k=n.imag) if np.iscomplex(n) else Interface(eta=float(n.real)))
    return layers


@pytest.mark.parametrize("index", [(1.0, 1.5, 0.2 + 3.9j), (1.0, 1.8, 1.3, 1.0), (1.5, 2.1, 1.2)])
def test_smooth_stacks_are_sums_of_all_ways_by_tmm(index: tuple[complex, ...]) -> None:
    """Shares of s and p, with absorption between, and phases; from either side, and beyond the critical angle."""
    depth, opaque = 0.3, np.iscomplex(index[-1])
    stack = Stack(smooth_layers(index, depth), exterior=index[0])
    bsdf = mi.load_dict({"type": "layered", "material": dumps(stack, "json"), "form": "exact"})
    for cosine in (0.95, 0.65, 0.3, 0.1, -0.9, -0.4)[: 4 if opaque else 6]:
        wanted = by_ways(index[:: 1 if cosine > 0 else -1], abs(cosine), depth)
        found = smooth(bsdf, cosine, mi.TransportMode.Importance)
        for name, matrix in found.items():
            assert np.allclose(matrix, wanted[name], atol=2e-4), (name, cosine)


@pytest.mark.parametrize("index", [(1.0, 1.5, 0.2 + 3.9j), (1.0, 1.8, 1.3, 1.0)])
def test_walks_through_smooth_stacks_are_sums_of_all_ways_by_tmm(index: tuple[complex, ...]) -> None:
    depth = 0.3
    bsdf = walked(*smooth_layers(index, depth))
    for cosine in (0.9, 0.3, -0.5)[: 2 if np.iscomplex(index[-1]) else 3]:
        wanted = by_ways(index[:: 1 if cosine > 0 else -1], abs(cosine), depth)
        for name, side in {"reflected": cosine, "transmitted": -cosine}.items():
            found, error = of_samples(bsdf, direction(cosine, 0.4), 2**16, side)
            assert np.all(np.abs(found - wanted[name]) < 4 * error + 2e-4), (name, cosine)


HAZE = (
    Interface(eta=1.5),
    Medium(sigma_s=0.8, sigma_a=0.2),
    Interface(eta=1.8),
    Medium(sigma_a=0.1),
    Interface(eta=1.0),
)
COATS = (Interface(eta=2.5), Interface(eta=1.2), Interface(eta=0.5, k=3.0, alpha=0.2))


@pytest.mark.parametrize(
    "layers, cosine, side, often",
    [
        (COATS, 0.5, 1, False),
        (COATS, 0.5, 1, True),
        (HAZE, 0.5, 1, False),
        (HAZE, 0.5, -1, False),
        (HAZE, -0.3, -1, False),
    ],
)
def test_values_of_walks_are_those_of_their_samples(
    layers: tuple[Any, ...], cosine: float, side: float, often: bool
) -> None:
    """Behind several smooth interfaces, reflections between which are summed up in values, and followed in samples."""
    bsdf = walked(*layers, microsurface=often)
    a, noise_a = of_samples(bsdf, direction(cosine, 0.4), 2**17, side, delta=False)
    b, noise_b = of_values(bsdf, direction(cosine, 0.4), 2**17, side)
    assert np.all(np.abs(a - b) < 4 * np.hypot(noise_a, noise_b) + 1e-6)
    assert np.abs(a[0, 1]) > 5 * noise_a[0, 1]  # polarises


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
    found = along_surface(bsdf.eval(mi.BSDFContext(), points(wi, 1), wo), wo, wi)
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
    walked = vt.reference.stokes(Stack(layers), 0.5, paths=200_000, microsurface=often)
    assert walked.standard_error
    light = np.sum(walked.reflected, axis=0)[:, 0, 0]
    noise = np.sqrt(np.sum(np.square(walked.standard_error.reflected), axis=0))[:, 0, 0]
    assert np.all(np.abs(found[:, 0] - light) < BOUND * np.hypot(error[:, 0], noise))
