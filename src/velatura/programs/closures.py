"""Closures that other programs' materials are made of: microfacets, diffuse reflection, and thin films, in NumPy.

Directions are (3, N), `wi` above the surface. Values are f |cos theta_o| of energy, (N,) or (3, N) with colours.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from velatura.optics import fresnel, ggx, refraction
from velatura.programs.parameters import ALPHA_MIN as ALPHA_MIN
from velatura.renderer.low_discrepancy import square
from velatura.stack import srgb_weights

Array: TypeAlias = NDArray[np.floating]
Number: TypeAlias = Any  # a float or an array


@dataclass(frozen=True)
class ViewAndLight:
    """Directions wi above, and wo; `straight` is wo turned up where it lies below."""

    wi: Array
    wo: Array

    @functools.cached_property
    def cos_i(self) -> Array:
        return np.maximum(self.wi[2], 1e-6)

    @functools.cached_property
    def cos_o(self) -> Array:
        return np.abs(self.wo[2])

    @functools.cached_property
    def reflected(self) -> Array:
        """1 where wo lies above, else 0."""
        return (self.wo[2] > 0).astype(float)

    @functools.cached_property
    def straight(self) -> Array:
        return np.stack([self.wo[0], self.wo[1], self.cos_o])

    @functools.cached_property
    def h(self) -> Array:
        """The half-vector of wi and `straight`."""
        h = self.wi + self.straight
        return np.asarray(h / np.sqrt(np.maximum(np.sum(h * h, axis=0), 1e-12)))

    @functools.cached_property
    def cos_d(self) -> Array:
        """Cosine between wi and the half-vector."""
        return np.clip(np.sum(self.wi * self.h, axis=0), 0, 1)


def burley(roughness: Number, anisotropic: float) -> tuple[Number, Number]:
    """GGX roughness along the tangent and across it (Burley 2012)."""
    aspect = np.sqrt(1 - 0.9 * anisotropic)
    return roughness**2 / aspect, roughness**2 * aspect


def anisotropic(alpha_u: Number, alpha_v: Number) -> tuple[Number, Number]:
    """Roughnesses that can be evaluated."""
    return np.clip(alpha_u, ALPHA_MIN, 1), np.clip(alpha_v, ALPHA_MIN, 1)


def microfacets(
    pair: ViewAndLight, alpha_u: Number, alpha_v: Number, turn: float = 0.0, correlated: bool = True
) -> Array:
    """D G / (4 cos theta_i), on the side of wi and, as in a mirror, on the other (Walter 2007, Eq. 20).

    `turn`: of the first axis from the tangent, radians; `correlated`: in height (Heitz 2014, Eq. 99), or separable.
    """
    return _facets(pair, pair.h, alpha_u, alpha_v, turn, correlated) / 4


def refracted(
    pair: ViewAndLight,
    eta: float,
    alpha_u: Number,
    alpha_v: Number,
    turn: float = 0.0,
    correlated: bool = True,
    passing: Callable[[Array], Array] = np.ones_like,
) -> Array:
    """Light that rough facets refract into a medium of relative index eta (Walter 2007, Eq. 21).

    Where eta is 1, facets do not deflect light; it is then blurred as by a mirror. `passing`: the transmittance of a
    facet by the cosine to its normal.
    """
    below = 1 - pair.reflected
    if not below.any():
        return below
    if abs(eta - 1) < 1e-3:
        return below * microfacets(pair, alpha_u, alpha_v, turn, correlated)
    wi, wo = tuple(pair.wi), tuple(pair.wo)
    h = refraction.half_vector(wi, wo, eta)
    cos_i, cos_o = ggx.dot(wi, h), ggx.dot(wo, h)
    kept = below * (cos_i > 0) * (cos_o < 0) * passing(np.maximum(cos_i, 0))
    scale = kept * np.abs(cos_i) * refraction.jacobian(cos_i, cos_o, eta)
    return np.asarray(scale * _facets(pair, np.stack(h), alpha_u, alpha_v, turn, correlated))


def _facets(pair: ViewAndLight, h: Array, alpha_u: Number, alpha_v: Number, turn: float, correlated: bool) -> Array:
    """D G / cos theta_i of the normals h, that are seen from wi and from `straight`."""
    wi, wo, normal = (ggx.rotate(tuple(w), turn) if turn else tuple(w) for w in (pair.wi, pair.straight, h))
    visible_i, visible_o = ggx.masking(wi, alpha_u, alpha_v), ggx.masking(wo, alpha_u, alpha_v)
    both = visible_i * visible_o
    if correlated:
        both = both / np.maximum(visible_i + visible_o - both, 1e-12)
    return np.asarray(ggx.ndf(normal, alpha_u, alpha_v) * both / pair.cos_i)


def lambert(pair: ViewAndLight) -> Array:
    return np.asarray(pair.reflected * pair.cos_o / pi)


def oren_nayar(pair: ViewAndLight, colour: Array, roughness: float, again: Number = 1.0) -> Array:
    """Energy-preserving Oren-Nayar (Portsmouth et al. 2024, EON); `again` is a factor on light scattered many times."""
    if roughness < 1e-6:
        return np.asarray(colour * lambert(pair))
    c_1, c_2 = 0.5 - 2 / (3 * pi), 2 / 3 - 28 / (15 * pi)
    scale = 1 / (1 + c_1 * roughness)
    s = np.sum(pair.wi * pair.wo, axis=0) - pair.cos_i * pair.cos_o
    s = np.where(s > 0, s / np.maximum(np.maximum(pair.cos_i, pair.cos_o), 1e-6), s)
    mean = scale * (1 + c_2 * roughness)

    def lost(cosine: Array) -> Array:
        sine = np.sqrt(np.maximum(1 - cosine**2, 0))
        over = sine / np.maximum(cosine, 1e-6)
        g = sine * (np.arccos(np.clip(cosine, -1, 1)) - sine * cosine) + 2 / 3 * (over * (1 - sine**3) - sine)
        return np.asarray(1 - scale * (1 + roughness / pi * g))

    often = again * colour**2 * mean / (1 - colour * (1 - mean)) * lost(pair.cos_o) * lost(pair.cos_i) / (1 - mean)
    return np.asarray((colour * scale * (1 + roughness * s) + often) * lambert(pair))


def schlick(cosine: Number, f_0: Number, f_90: Number = 1.0) -> Array:
    """Schlick's Fresnel reflectance between those at 0 and 90 degrees."""
    return np.asarray(f_0 + (f_90 - f_0) * (1 - np.clip(cosine, 0, 1)) ** 5)


def tinted(cosine: Number, f_0: Array, f_82: Array) -> Array:
    """Schlick's reflectance of a metal, times f_82 at about 82 degrees (Kutz et al. 2021)."""
    edge = fresnel.EDGE
    at_82 = schlick(edge, f_0) * (1 - f_82) / (edge * (1 - edge) ** 6)
    return np.asarray(np.clip(schlick(cosine, f_0) - at_82 * cosine * (1 - cosine) ** 6, 0, 1))


NODES = 20  # of cosines, of roughnesses, and of indices
INDEX_MAX = 4.0


def _indices() -> Array:
    return 1 + (INDEX_MAX - 1) * np.linspace(0, 1, NODES) ** 2


@functools.cache
def _albedos() -> Array:
    """Albedos of microfacets (2 + 2 NODES, cosines, alphas): for Schlick's Fresnel, the parts of F0 and of F90
    (Karis 2013); for dielectrics of the indices, what is reflected, and what is refracted.

    Cosines and alphas stand at the squares of i / (NODES - 1), since albedos change fastest near 0.
    """
    grid = np.linspace(0, 1, NODES) ** 2
    cosine, alpha = (np.maximum(x, ALPHA_MIN).reshape(-1, 1) for x in np.meshgrid(grid, grid, indexing="ij"))
    u, v = square(377)
    wi = (np.sqrt(1 - cosine**2), 0 * cosine, cosine)
    h = ggx.sample_visible(wi, alpha, alpha, u, v)
    cos_d = np.clip(ggx.dot(wi, h), 0, 1)
    visible_i = ggx.masking(wi, alpha, alpha)

    def seen(wo: ggx.Direction) -> Array:
        visible_o = ggx.masking(wo, alpha, alpha)
        both = np.maximum(visible_i + visible_o - visible_i * visible_o, 1e-12)
        return np.where(wo[2] > 0, visible_o / both, 0)

    mirrored, grazing = seen(ggx.reflect(wi, h)), (1 - cos_d) ** 5
    reflected = [np.asarray(fresnel.dielectric(cos_d, eta)) for eta in _indices()]
    parts = [mirrored * (1 - grazing), mirrored * grazing, *(mirrored * f for f in reflected)]
    for f, eta in zip(reflected, _indices()):
        x, y, z = refraction.refract(wi, h, eta)
        parts.append((1 - f) * seen((x, y, -z)))
    return np.array([part.mean(axis=1).reshape(NODES, NODES) for part in parts])


def _at(grids: Array, cosine: Array, alpha: float) -> list[Array]:
    """Grids over cosines and alphas, at some."""
    x = np.sqrt(np.clip(cosine, 0, 1)) * (NODES - 1)
    y = np.sqrt(np.clip(alpha, 0, 1)) * (NODES - 1)
    j = int(min(y, NODES - 2))
    return [np.interp(x, np.arange(NODES), grid[:, j] * (1 - (y - j)) + grid[:, j + 1] * (y - j)) for grid in grids]


def albedo(cosine: Array, alpha: float, f_0: Number, f_90: Number = 1.0) -> Array:
    """Directional albedo of microfacets with Schlick's Fresnel reflectance."""
    of_0, of_90 = _at(_albedos()[:2], cosine, alpha)
    return np.asarray(f_0 * of_0 + f_90 * of_90)


def dielectric_albedo(cosine: Array, alpha: float, eta: float, passed: bool = False) -> Array:
    """Directional albedo of a rough dielectric of relative index eta, or of its inverse; or the share that is
    refracted."""
    z = np.sqrt((min(max(eta, 1 / eta), INDEX_MAX) - 1) / (INDEX_MAX - 1)) * (NODES - 1)
    k = int(min(z, NODES - 2))
    first = 2 + k + NODES * passed
    below, above = _at(_albedos()[first : first + 2], cosine, alpha)
    return np.asarray(below + (z - k) * (above - below))


def often(once: Number, albedo: Callable[[Array], Array]) -> Array:
    """Reflectance for light that facets scatter many times, from that of facets and their albedo over the cosine.

    (Kulla and Conty 2017)
    """
    cosine = (np.arange(64) + 0.5) / 64
    mean = 2 * (albedo(cosine) * cosine).mean()
    return np.asarray(once * mean / (1 - once * (1 - mean)))


def compensation(cosine: Array, alpha: float, reflectance: Number) -> Array:
    """The factor by which light that facets scatter many times raises their value (Turquin 2019)."""
    once = albedo(cosine, alpha, 1.0)
    return np.asarray(1 + reflectance * (1 - once) / once)


def coat(
    pair: ViewAndLight, weight: float, eta: float, alpha_u: float, alpha_v: float, turn: float = 0.0
) -> tuple[Array, Array]:
    """Value of the facets of a dielectric coat of some weight, and the share of light that it does not reflect."""
    if weight == 0:
        return 0 * pair.cos_i, np.ones_like(pair.cos_i)
    mean = float(np.sqrt(alpha_u * alpha_v))
    f = fresnel.dielectric(pair.cos_d, eta) if eta != 1 else 0 * pair.cos_d
    facets = pair.reflected * f * compensation(pair.cos_i, mean, f) * microfacets(pair, alpha_u, alpha_v, turn)
    again = compensation(pair.cos_i, mean, np.full(1, fresnel.normal_incidence(eta)))
    return np.asarray(weight * facets), np.asarray(1 - weight * dielectric_albedo(pair.cos_i, mean, eta) * again)


# Thin films (Belcour & Barla 2017) ------------------------------------------------------------------------------------

LONGEST_NM = 10_000.0  # of path differences that interfere in colours

_TO_RGB = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.969266, 1.8760108, 0.041556], [0.0556434, -0.2040259, 1.0572252]]
)
_TO_RGB_E = np.array(
    [[2.3706743, -0.9000405, -0.4706338], [-0.513885, 1.4253036, 0.0885814], [0.0052982, -0.0146949, 1.0093968]]
)


#: Interference of a path difference in nanometres and a phase, in RGB (3, N).
Seen: TypeAlias = Callable[[Array, Array], Array]


def _by_gaussians(path_nm: Array, shift: Array, to_rgb: Array = _TO_RGB_E) -> Array:
    """Interference by Fourier transforms of the sensitivities of the eye, as Gaussians."""
    phase = 2 * pi * path_nm * 1e-9
    val, pos, var = np.array(
        [[5.4856e-13, 4.4201e-13, 5.2481e-13], [1.681e6, 1.7953e6, 2.2084e6], [4.3278e9, 9.3046e9, 6.6121e9]]
    )[:, :, None]
    xyz = val * np.sqrt(2 * pi * var) * np.cos(pos * phase + shift) * np.exp(-var * phase**2)
    second = np.cos(2.2399e6 * phase + shift[0]) * np.exp(-4.5282e9 * phase**2)
    xyz[0] += 9.747e-14 * np.sqrt(2 * pi * 4.5282e9) * second
    return np.asarray(to_rgb @ xyz / 1.0685e-7)


@functools.cache
def _transforms() -> tuple[Array, NDArray[np.complexfloating]]:
    """Path differences (N,), and Fourier transforms (3, N) of the sensitivities of linear sRGB."""
    wavelengths_nm, weights = srgb_weights(d65=False)
    path_nm = np.linspace(0, LONGEST_NM, 1024)
    return path_nm, weights @ np.exp(2j * pi * path_nm / wavelengths_nm[:, None])


def by_observer(path_nm: Array, shift: Array) -> Array:
    """Interference as the CIE 1931 observer sees it, in light of equal energy."""
    at, transforms = _transforms()
    found = np.stack([np.interp(path_nm, at, each, right=0.0) for each in transforms])
    return np.asarray((found * np.exp(1j * shift)).real)


def _interference(
    r_12: Array, r_23: Array, path_nm: Array, phase: Array, seen: Seen, least: float, orders: int = 2
) -> Array:
    """Light reflected by a film, of one polarisation (3, N)."""
    both = np.clip(r_12 * r_23, least, 0.9999)
    inside = (1 - r_12) ** 2 * r_23 / (1 - both)
    total, order = r_12 + inside, inside - (1 - r_12)
    for m in range(1, orders + 1):
        order = order * np.sqrt(both)
        total = total + order * 2 * seen(m * path_nm, m * phase)
    return np.asarray(total)


def film_by_schlick(cosine: Array, eta: float, thickness_nm: float, f_0: Array) -> Array:
    """Reflectance (3, N) of a film over a base of reflectance f_0 in air, without polarisation.

    (KHR_materials_iridescence, Iridescence Fresnel)
    """
    cos_2 = fresnel.cos_transmitted(cosine, eta)
    root = np.sqrt(np.minimum(f_0 + 1e-4, 0.9999))
    base = (1 + root) / (1 - root)
    r_12 = np.broadcast_to(schlick(cosine, fresnel.normal_incidence(eta)), (3, *np.shape(cosine)))
    r_23 = schlick(cos_2, ((base - eta) / (base + eta)) ** 2)
    phase = pi + np.where(base < eta, pi, 0.0)
    in_srgb = functools.partial(_by_gaussians, to_rgb=_TO_RGB)
    return np.maximum(_interference(r_12, r_23, 2 * eta * thickness_nm * cos_2, phase, in_srgb, 1e-5), 0)


#: Reflectance (3, N) and phase, of s and of p, at the lower side of a film, by the cosine inside it.
Below: TypeAlias = Callable[[Array], tuple[tuple[Array, Array], tuple[Array, Array]]]


def film(
    cosine: Array, eta: float, thickness_nm: float, below: Below, orders: int = 2, seen: Seen = _by_gaussians
) -> Array:
    """Reflectance (3, N) of a film: the mean of both polarisations, of so many orders of interference."""
    cos_2 = fresnel.cos_transmitted(cosine, eta)
    path = 2 * eta * thickness_nm * cos_2
    total = []
    for (r_12, _), (r_23, phase) in zip(fresnel.dielectric_amplitudes(cosine, cos_2, eta), below(cos_2)):
        again = phase + np.where(r_12 > 0, pi, 0.0)  # from inside, the amplitude has the other sign
        reflected = np.broadcast_to(r_12**2, (3, len(r_12)))
        total.append(_interference(reflected, r_23, path, again, seen, 0.0, orders))
    return np.clip(0.5 * (total[0] + total[1]), 0, 1)


def below_film(reflectances: Callable[[Array], tuple[Array, Array]], base: Array, eta: float) -> Below:
    """Reflectances of s and p, in phase but for the indices, of the base by channel and of the film."""
    flipped = np.where(base < eta, pi, 0.0)

    def found(cosine: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        s, p = reflectances(cosine)
        return (s, flipped + pi), (p, flipped)

    return found


def dielectric_below(eta: Number) -> Callable[[Array], tuple[Array, Array]]:
    """Reflectances of the lower side of a film over a dielectric of index eta over the film's."""

    def reflectances(cosine: Array) -> tuple[Array, Array]:
        (s, _), (p, _) = fresnel.dielectric_amplitudes(cosine, fresnel.cos_transmitted(cosine, eta), eta)
        return np.broadcast_to(s**2, (3, len(cosine))), np.broadcast_to(p**2, (3, len(cosine)))

    return reflectances
