"""Light that passes a stack after it has bounced between its interfaces, or has been scattered by its media.

Like reflected light, it is drawn in a medium of its own: a GGX reflection about the momentum p_i of light from wi, in
the slab where light last bounced or was scattered, let out through the smooth interfaces below. In that slab, of index
m and cosine c, the widths of all that light meets on its way add as in `straight_through`: of refractions |w_l| a_l,
as seen at a reflection, 2 m c; a share `BOUNCES` of both faces of the last slab for light that bounces; and for
scattered light, of optical depth x = tau_s / c, the width of N = x / (1 - exp(-x)) scatterings of asymmetry g^N in all,
whose median angle theta follows from a fit, as that of a mirror with facets of alpha = tan(theta / 2).

Scattering that is wider than GGX can be is diffuse: even over all momenta that can leave. What facets met often add
is even below the last rough interface, but for a tilt to the side that light goes to. All that is seen here is in the
frame of the outside below: directions are turned up, indices relative to it.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model import own_medium
from velatura.model.own_medium import OwnMediumLobe
from velatura.model.straight_through import EXPONENT, WIDTHS, Crossed, Passage, Slab, entered, is_none
from velatura.model.variance import Roughness, Variance
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.optics.ggx import Direction
from velatura.sampling import low_discrepancy

BOUNCES = 0.3  # of the two faces of the slab that light bounces in
COS_MIN = 0.22  # at which slabs are crossed, for widths
ALPHA_MAX = 1.5
DIFFUSE = 0.75  # roughness of scattering that is diffuse
TILTED = 1.0  # tilt of the light of repeated facets
FAR = 1e3  # index
THIN = 1e-4  # optical depth of scattering that no light meets twice
NO_LOBE = 1e-6  # asymmetry
NODES = 48

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Rest:
    """Light that is scattered: a lobe, None without one, with a diffuse share of `diffuse` over momenta up to `bound`,
    relative to the index below, of which the smooth interfaces below let `leaving` pass; by `tilt`, more of it leaves
    on the side that light goes to."""

    lobe: OwnMediumLobe | None
    diffuse: Value
    tilt: Value
    bound: Value
    leaving: Callable[[Value], Value]


def bounced(passage: Passage, wi: Direction) -> OwnMediumLobe | None:
    """The lobe of light from wi, above, that bounces between the last two interfaces; None for a single one."""
    if not passage.bounces:
        return None
    faces = _sum(passage.faces, [crossing.width for crossing in passage.crossings])
    return _lobe(passage, entered(passage, wi), passage.under, faces * BOUNCES)


def rest(passage: Passage, wi: Direction) -> Rest:
    """The light from wi, above, that is scattered by media, or often by facets."""
    n, under = passage.indices, passage.scattered
    lowest = reduce(ops.minimum, (x + FAR * (1 - flag) for x, flag in zip(n, (*under, 1.0))))
    bound, leaving = lowest / n[-1], _leaving(passage, under)
    tilt = TILTED * passage.clear
    if not passage.is_cloudy:
        return Rest(None, 1.0, tilt, bound, leaving)
    i = entered(passage, wi)
    scattering = [(slab, cosine) for slab, cosine in zip(passage.slabs, i.bounded) if not is_none(slab.scattering)]
    alpha = _turned(scattering)
    diffuse = ops.select(alpha < DIFFUSE, 0.0, 1.0)
    width = type(passage.crossings[0].width).uniform(WIDTHS.variance(alpha))
    return Rest(_lobe(passage, i, under, width), diffuse, tilt, bound, leaving)


def _turned(slabs: Sequence[tuple[Slab, Value]]) -> Value:
    """Roughness of the mirror that deflects light as much as all scattering in slabs with their cosines."""
    depths = [ops.mean(slab.scattering) / ops.maximum(cosine, COS_MIN) for slab, cosine in slabs]
    total = reduce(operator.add, depths)
    g = ops.divide(reduce(operator.add, (depth * slab.g for depth, (slab, _) in zip(depths, slabs))), total)
    x = ops.maximum(total, THIN)
    g = ops.exp(x / (1 - ops.exp(-x)) * ops.log(ops.clip(g, NO_LOBE, 1.0)))
    cos_theta = ops.minimum(0.5 * g * (3 - g * g), 1.0)
    return ops.sqrt((1 - cos_theta) / (1 + cos_theta))


def _lobe(passage: Passage, i: Crossed, under: Sequence[Value], inside: Variance) -> OwnMediumLobe:
    """The lobe in the slab above the interfaces that are `under` it, of the widths of refractions and those that light
    takes on inside."""
    n = _above(under, passage.indices)
    scale = 1 / (2 * n * ops.maximum(_above(under, i.bounded), COS_MIN))
    for crossing, step in zip(passage.crossings, i.steps):
        inside = inside + crossing.width * ops.power(ops.maximum(ops.absolute(step) * scale, ops.TINY), EXPONENT)
    u, v, rotation = inside.roughness(WIDTHS)
    roughness = Roughness(ops.minimum(u, ALPHA_MAX), ops.minimum(v, ALPHA_MAX), rotation)
    return OwnMediumLobe(1.0, roughness, n / passage.indices[-1], leaving=_leaving(passage, under))


def _leaving(passage: Passage, under: Sequence[Value]) -> Callable[[Value], Value]:
    """Share (a colour) that smooth interfaces let pass, by the cosine below all of them."""
    n, crossings = passage.indices, passage.crossings

    def leaving(cos_o: Value) -> Value:
        p2 = 1 - cos_o * cos_o
        passes: Value = 1.0
        for l, (flag, crossing) in enumerate(zip(under, crossings)):
            if isinstance(flag, float) and flag == 0.0:
                continue
            above, below = (ops.sqrt(1 - p2 * (n[-1] / x) * (n[-1] / x)) for x in n[l : l + 2])
            below = cos_o if l == len(crossings) - 1 else below
            passes = passes * (1 - flag * fresnel.dielectric_between(above, below, crossing.eta))
        return passes

    return leaving


def _above(under: Sequence[Value], values: Sequence[Value]) -> Value:
    """Of values of slabs that of the one above some interfaces; without any, that of the last one."""
    first = [flag - before for flag, before in zip((*under, 1.0), (0.0, *under))]
    return _sum(first, values)


def _sum(flags: Sequence[Value], values: Sequence[Any]) -> Any:
    """Of the values whose flags are 1."""
    kept = [(flag, x) for flag, x in zip(flags, values) if not (isinstance(flag, float) and flag == 0.0)]
    return reduce(operator.add, (x if isinstance(flag, float) else x * flag for flag, x in kept))


def seen_below(passage: Passage, wi: Direction) -> Direction:
    """The direction below, turned up, of light that a smooth stack would mirror into it: at most a horizontal one."""
    n = passage.indices
    x, y = (wi[k] * (n[0] / n[-1]) for k in (0, 1))
    scale = 1 / ops.sqrt(ops.maximum(x * x + y * y, 1.0))
    x, y = scale * x, scale * y
    return x, y, ops.maximum(ops.sqrt(1 - x * x - y * y), own_medium.COS_MIN)


def eval_pdf_rest(found: Rest, i: Direction, o: Direction) -> tuple[Value, Value]:
    """f |cos theta_o|, a colour, and the density of `sample_rest`, in the frame of `seen_below`."""
    cos_o = ops.maximum(o[2], 0.0)
    even = cos_o / (pi * found.bound * found.bound) * _tilted(found, i, o)
    reached = o[0] * o[0] + o[1] * o[1] < found.bound * found.bound
    density = ops.select(reached, found.diffuse * even, 0.0)
    value = density * found.leaving(cos_o)
    if found.lobe:
        also, density_of_lobe = own_medium.eval_pdf(found.lobe, i, o)
        value, density = (1 - found.diffuse) * also + value, (1 - found.diffuse) * density_of_lobe + density
    return value, density


def sample_rest(found: Rest, i: Direction, u: Value, u1: Value, u2: Value) -> Direction:
    """A direction, in the frame of `seen_below`, from uniform numbers."""
    r, phi = found.bound * ops.sqrt(u1), 2 * pi * u2
    even = r * ops.cos(phi), r * ops.sin(phi), ops.sqrt(1 - r * r)
    if not is_none(found.tilt):
        side = ops.select(2 * u < _tilted(found, i, even), 1.0, -1.0)
        even = side * even[0], side * even[1], even[2]
    if not found.lobe:
        return even
    other = own_medium.sample(found.lobe, i, u1, u2)
    x, y, z = (ops.select(u < found.diffuse, a, b) for a, b in zip(even, other))
    return x, y, z


def _tilted(found: Rest, i: Direction, o: Direction) -> Value:
    """Density of diffuse light over its mean: 1 plus a part that is odd."""
    return 1 - found.tilt * (i[0] * o[0] + i[1] * o[1]) / found.bound


def integral_rest(found: Rest, i: tuple[Array, Array, Array]) -> Array:
    """Energy (3, N) of `eval_pdf_rest` from directions (N,) each."""
    x, weight = low_discrepancy.gauss(NODES)
    # Even over p^2; nodes crowd at grazing directions
    r2 = (np.asarray(found.bound)[..., None] ** 2) * (1 - x * x)
    diffuse = np.sum(found.leaving(np.sqrt(1 - r2)) * (2 * weight * x), axis=-1)[..., None]
    if not found.lobe:
        return np.asarray(diffuse + np.zeros((1, len(i[2]))))
    return np.asarray((1 - found.diffuse) * own_medium.integral(found.lobe, i) + found.diffuse * diffuse)
