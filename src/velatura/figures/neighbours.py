"""Metals with a thin film under a coat as neighbours of this package show them, by their published formulas.

A thin film belongs there to the Fresnel term of the base, by the sums of Belcour and Barla 2017 over the order of
interference, up to the third; and a coat lies on top by albedo scaling,

    f = f_coat + (1 - E_coat) f_base,

E_coat being the directional albedo of the coat for the view. They differ in what film and base know of the coat:

- `closures`: the closures of MaterialX and OSL, a `conductor_bsdf` with `thinfilm_thickness` under a `dielectric_bsdf`
  by `layer`. Above the film is a vacuum; the base keeps its roughness, and the angle outside.
- `principled`: Blender's Principled BSDF (5.0). The same; but n and k follow from the colours of the metal at 0 and 82
  degrees (Gulbrandsen 2014), reflectances from these (Kutz et al. 2021), and sensitivities from a table.
- `openpbr`: the text of OpenPBR 1.1, sections "Thin-film iridescence" and "Coat". Above the film is the coat, at the
  angle inside it; the base is roughened and darkened.

n and k differ by colour, each of which is evaluated with its own sensitivity. Facets are met once, as in the figures'
pictures of all models: what neighbours add for light that meets several is left out.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import kernel, ops
from velatura.api import lobes
from velatura.films.tables import NODES, Coated
from velatura.optics import fresnel, ggx
from velatura.stack import Interface, Stack
from velatura.stack.spectra import srgb_weights

Array = NDArray[Any]
#: Complex sensitivities (3,) of colours to an optical path difference in nanometres, (3, N); 1 for 0.
Sensitivity = Callable[[Array], Array]

ORDERS = 3  # of interference
ALPHA_MIN = 1e-3  # lower roughness is evaluated as this
GRAZING = 1e-3  # least cosine that a model is asked for


@dataclass(frozen=True)
class FilmedMetal:
    """A metal of index eta + i k (colours) and roughness alpha, with a film."""

    eta: tuple[float, float, float]
    k: tuple[float, float, float]
    alpha: float
    film_eta: float
    thickness_nm: float


@dataclass(frozen=True)
class ClearCoat:
    """A clear coat."""

    eta: float
    alpha: float

    def albedo(self, cos_theta: Array) -> Array:
        """Directional albedo of its reflection."""
        opaque = Stack([Interface(eta=self.eta, alpha=self.alpha), Interface(eta=1.0, k=1.0)])
        return np.asarray(lobes(opaque, np.maximum(cos_theta, GRAZING), reflectance="fgd").energy[0][0])


@dataclass(frozen=True)
class GgxLobe:
    """A lobe of GGX: its Fresnel term (NODES, 3) over the cosine of facets, times a weight over that of the view."""

    alpha: float
    fresnel: Array
    weight: Array


def closures(metal: FilmedMetal, coat: ClearCoat | None) -> list[GgxLobe]:
    """Lobes of MaterialX and OSL."""
    return _coated(coat, metal.alpha, interference(_COSINES, 1.0, metal, fitted))


def principled(metal: FilmedMetal, coat: ClearCoat | None) -> list[GgxLobe]:
    """Lobes of Blender."""
    return _coated(coat, metal.alpha, interference(_COSINES, 1.0, metal, tabled, by_colours=True))


def openpbr(metal: FilmedMetal, coat: ClearCoat | None) -> list[GgxLobe]:
    """Lobes that the text of OpenPBR asks for."""
    if coat is None:
        return closures(metal, None)
    inside = fresnel.cos_transmitted(_COSINES, coat.eta)
    base = interference(np.asarray(inside), coat.eta, metal, fitted)
    # Roughening: r'^4 = r^4 + 2 r_C^4, r^2 being alpha
    alpha = min(float(np.hypot(metal.alpha, np.sqrt(2) * coat.alpha)), 1.0)
    # Darkening by K = lerp(K_s, K_r, r), from the base's albedo at the normal
    reflected = fresnel.dielectric(_COSINES, coat.eta)
    diffuse = 1 - (1 - np.trapezoid(2 * _COSINES * reflected, _COSINES)) / coat.eta**2
    kept = (reflected + (diffuse - reflected) * np.sqrt(metal.alpha))[:, None]
    return _coated(coat, alpha, base, (1 - kept) / (1 - base[-1] * kept))


NEIGHBOURS: dict[str, Callable[[FilmedMetal, ClearCoat | None], list[GgxLobe]]] = {
    "OpenPBR": openpbr,
    "Blender": principled,
    "MaterialX, OSL": closures,
}

_COSINES = np.linspace(0, 1, NODES)


def _coated(coat: ClearCoat | None, alpha: float, base: Array, darkening: Array | float = 1.0) -> list[GgxLobe]:
    plain = np.ones((NODES, 3))
    if coat is None:
        return [GgxLobe(alpha, base, plain)]
    above = np.repeat(np.asarray(fresnel.dielectric(_COSINES, coat.eta))[:, None], 3, axis=1)
    return [GgxLobe(coat.alpha, above, plain), GgxLobe(alpha, base, darkening * _left(coat) * plain)]


@functools.cache
def _left(coat: ClearCoat) -> Array:
    """The share (NODES, 1) of light that a coat does not reflect, which every neighbour asks for."""
    return 1 - coat.albedo(_COSINES)[:, None]


# The film


def interference(
    cosines: Array, n_1: float, metal: FilmedMetal, sensitivity: Sensitivity, by_colours: bool = False
) -> Array:
    """Reflectance (N, 3) of a metal with a film for cosines (N,) in a medium of index n_1, clipped to 0 to 1.

    R = C_0 + 2 sum over m of Re(C_m exp(i m phi) S(m D)), C_0 = R_12 + R_s, C_m = (R_s - T_121) (R_12 R_23)^(m/2),
    with R_s = T_121^2 R_23 / (1 - R_12 R_23) and T_121 = 1 - R_12, for s and p (Belcour and Barla 2017, section 3).

    by_colours: n, k and reflectances of the metal follow from its colours.
    """
    colours = np.array(metal.eta)[:, None], np.array(metal.k)[:, None]
    n_2, sin2 = metal.film_eta, n_1**2 * (1 - cosines**2)
    cos_2 = np.sqrt(np.maximum(1 - sin2 / n_2**2, 0))
    edge = None
    if by_colours:
        colours, edge = _from_colours(*colours)
    n_3 = colours[0] + 1j * colours[1]
    upper, lower = _amplitudes(n_1, n_2, sin2), _amplitudes(n_2, n_3, sin2)
    path_nm = 2 * n_2 * metal.thickness_nm * cos_2
    total = np.zeros((3, len(cosines)))
    for above, below in zip(upper, lower):
        r_12, r_23 = np.abs(above) ** 2, np.abs(below) ** 2
        if edge is not None:
            r_23 = _by_edge(cos_2, np.abs((n_2 - n_3) / (n_2 + n_3)) ** 2, edge)
        through = 1 - r_12
        r_s = through**2 * r_23 / (1 - r_12 * r_23)
        turn = np.exp(1j * np.angle(-above * below))  # the film is met from below
        total += (r_12 + r_s) * sensitivity(0 * path_nm).real
        for m in range(1, ORDERS + 1):
            share = (r_s - through) * (r_12 * r_23) ** (m / 2)
            total += 2 * share * (turn**m * sensitivity(m * path_nm)).real
    return np.clip(0.5 * total, 0, 1).T


def _amplitudes(n_1: Any, n_2: Any, sin2: Array) -> tuple[Array, Array]:
    """Fresnel's amplitudes of reflection for s and p; `sin2` is the square of the tangential index."""
    q_1, q_2 = (np.sqrt(n**2 - sin2 + 0j) for n in (n_1, n_2))
    s = (q_1 - q_2) / (q_1 + q_2)
    p = (n_2**2 * q_1 - n_1**2 * q_2) / (n_2**2 * q_1 + n_1**2 * q_2)
    return s, p


def _from_colours(eta: Array, k: Array) -> tuple[tuple[Array, Array], Array]:
    """n and k from the reflectances in a vacuum at the normal and at the edge, and the latter (Gulbrandsen 2014)."""
    f_0, f_edge = (np.asarray(fresnel.conductor(c, eta, k)) for c in (1.0, fresnel.EDGE))
    root = np.sqrt(f_0)
    n = (1 + root) / (1 - root) * (1 - f_edge) + (1 - f_0) / (1 + f_0) * f_edge
    return (n, np.sqrt(np.maximum((f_0 * (n + 1) ** 2 - (n - 1) ** 2) / (1 - f_0), 0))), f_edge


def _by_edge(cosine: Array, f_0: Array, f_edge: Array) -> Array:
    """Schlick's curve less a term that makes it `f_edge` at the edge (Kutz et al. 2021)."""
    term = cosine * (1 - cosine) ** 6 / (fresnel.EDGE * (1 - fresnel.EDGE) ** 6)
    return np.clip(fresnel.schlick(cosine, f_0) - term * (fresnel.schlick(fresnel.EDGE, f_0) - f_edge), 0, 1)


def fitted(path_nm: Array) -> Array:
    """Gaussians over the wavenumber, fitted to the CIE's observer, in primaries of an equal-energy white.

    (Belcour and Barla 2017, released code)
    """
    height = np.array([5.4856e-13, 4.4201e-13, 5.2481e-13, 9.7470e-14])
    centre = np.array([1.6810e6, 1.7953e6, 2.2084e6, 2.2399e6])
    variance = np.array([4.3278e9, 9.3046e9, 6.6121e9, 4.5282e9])
    phase = 2 * np.pi * path_nm[:, None] * 1e-9
    each = height * np.sqrt(2 * np.pi * variance) * np.exp(1j * centre * phase - variance * phase**2) / 1.0685e-7
    xyz = np.stack([each[:, 0] + each[:, 3], each[:, 1], each[:, 2]])
    rgb_from_xyz = np.array(
        [
            [2.3706743, -0.9000405, -0.4706338],
            [-0.5138850, 1.4253036, 0.0885814],
            [0.0052982, -0.0146949, 1.0093968],
        ]
    )
    return np.asarray(rgb_from_xyz @ xyz)


def tabled(path_nm: Array) -> Array:
    """The Fourier transform of the CIE's observer in the primaries of sRGB, scaled to 1 without a film."""
    wavelengths_nm, weights = srgb_weights(d65=False)
    return np.asarray(weights @ np.exp(2j * np.pi * path_nm / wavelengths_nm[:, None]))


# As a material


def bsdf(parts: list[GgxLobe]) -> Any:
    """A `mi.BSDF` of lobes, which are chosen alike often."""
    made = [(max(part.alpha, ALPHA_MIN), Coated(part.fresnel, 1), Coated(part.weight, 1)) for part in parts]
    return _plugin(kernel.mitsuba())(made)


@functools.cache
def _plugin(mi: Any) -> type:
    flags = mi.BSDFFlags

    class Lobes(mi.BSDF):
        def __init__(self, parts: list[tuple[float, Coated, Coated]]) -> None:
            mi.BSDF.__init__(self, mi.Properties())
            self.parts = parts
            self.m_components = [flags.GlossyReflection | flags.FrontSide]
            self.m_flags = self.m_components[0]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            wi, drawn = tuple(si.wi), mi.Vector3f(0, 0, 1)
            for k, (alpha, *_) in enumerate(self.parts):
                wo = ggx.reflect(wi, ggx.sample_visible(wi, alpha, alpha, sample2.x, sample2.y))
                drawn = ops.select(sample1 * len(self.parts) >= k, mi.Vector3f(*wo), drawn)
            bs = mi.BSDFSample3f()
            bs.wo, bs.eta, bs.sampled_component = drawn, 1.0, mi.UInt32(0)
            bs.sampled_type = mi.UInt32(+flags.GlossyReflection)
            value, bs.pdf = self.eval_pdf(ctx, si, drawn, active)
            return bs, ops.select(bs.pdf > 0, value / ops.maximum(bs.pdf, ops.TINY), 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            i, o = tuple(si.wi), tuple(wo)
            lit = active & (i[2] > 0) & (o[2] > 0)
            h = ggx.normalize((i[0] + o[0], i[1] + o[1], i[2] + o[2]))
            cosine, view = ops.maximum(ggx.dot(i, h), 0.0), ops.maximum(i[2], 0.0)
            value, density = mi.Color3f(0), mi.Float(0)
            for alpha, reflected, weight in self.parts:
                visible = ggx.ndf(h, alpha, alpha) * ggx.masking(i, alpha, alpha) * ops.divide(0.25, view)
                colour = mi.Color3f(reflected.at(cosine, cosine)) * mi.Color3f(weight.at(view, view))
                value += colour * (visible * ggx.masking(o, alpha, alpha))
                density += visible / len(self.parts)
            return ops.select(lit, value, 0.0), ops.select(lit, density, 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

    return Lobes
