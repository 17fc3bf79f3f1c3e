"""Light that passes a stack after it has bounced between its interfaces, or has been scattered by its media.

Like reflected light, it is drawn in a medium of its own: a GGX reflection about the momentum p_i of light from wi, in
the slab where light last bounced or was scattered, let out through the smooth interfaces below. In that slab, of index
m and cosine c, the widths of all that light meets on its way add as in `direct`: of refractions |w_l| a_l,
as seen at a reflection, 2 m c; a share `BOUNCES` of both faces of the last slab for light that bounces; and for
scattered light, of optical depth x = tau_s / c, the width of N = x / (1 - exp(-x)) scatterings of asymmetry g^N in all,
whose median angle theta follows from a fit, as that of a mirror with facets of alpha = tan(theta / 2).

Of light that bounces the lobe has the share 1 / (1 + a_u a_v / `WIDE`^2). The rest of it, scattering that is wider than
GGX can be, and what facets met often add are diffuse: a polynomial over all momenta that can leave, by direction, which
is fitted to the light at the nodes (`remainder.passing`). All that is seen here is in the frame of the outside below:
directions are turned up, indices relative to it.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from math import pi
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model import fitted
from velatura.model.directions import select_direction
from velatura.model.solved.guards import COS_INSIDE_MIN, COS_OUTSIDE_MIN, G_MIN, INDEX_MAX, INTERNAL_ALPHA_MAX
from velatura.model.solved.lobes import refracted_lobe, remainder
from velatura.model.solved.lobes.refracted_lobe import RefractedLobe
from velatura.model.solved.lobes.remainder import EVEN, RemainderSamples
from velatura.model.solved.lobes.top_medium import PassedSamples
from velatura.model.solved.transmission import forward
from velatura.model.solved.transmission.direct import (
    WIDTHS,
    CrossedSlab,
    MomentumInSlabs,
    Refraction,
    Transmission,
    entered,
    is_none,
)
from velatura.model.variance import Roughness, Variance
from velatura.ops import Value
from velatura.optics.ggx import Direction

THIN = 1e-4  # optical depth of scattering that no light meets twice

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Rest:
    """Light that is scattered: a lobe, None without one, with a diffuse share of `diffuse` over momenta up to `bound`,
    relative to the index below, by the `numbers` of `remainder.passing`. Its samples crowd about a share `forward` of
    the momentum of the light."""

    lobe: RefractedLobe | None
    diffuse: Value
    bound: Value
    numbers: Sequence[Value]
    forward: Value = 0.0

    @property
    def samples(self) -> RemainderSamples:
        """How diffuse light is sampled."""
        even, _, grazing, once, twice = self.numbers
        return RemainderSamples((even + grazing, 0.0, 0.0), (1.0, 0.0, 0.0), once, twice)


def bounced(transmission: Transmission, wi: Direction) -> RefractedLobe | None:
    """The lobe of light from wi, above, that bounces between the last two interfaces; None for a single one."""
    if not transmission.bounces:
        return None
    faces = _sum(transmission.faces, [refraction.width for refraction in transmission.refractions])
    return _lobe(transmission, entered(transmission, wi), transmission.under, faces * fitted.BOUNCES)


def share(lobe: RefractedLobe | None) -> Value:
    """Share of internal reflections that the lobe carries; falls with its width."""
    if lobe is None:
        return 0.0
    return 1 / (1 + lobe.roughness.alpha_u * lobe.roughness.alpha_v / (fitted.WIDE * fitted.WIDE))


def bound(transmission: Transmission) -> Value:
    """Greatest momentum of scattered light that leaves."""
    return reduce(
        ops.minimum,
        (x + INDEX_MAX * (1 - flag) for x, flag in zip(transmission.indices, (*transmission.scattered, 1.0))),
    )


@dataclass(frozen=True)
class EitherRest:
    """Light that a medium alone passes where a condition holds, else that of other materials."""

    where: Value
    alone: PassedSamples
    other: Rest

    @property
    def diffuse(self) -> Value:
        return ops.select(self.where, self.alone.diffuse, self.other.diffuse)


AnyRest: TypeAlias = Rest | PassedSamples | EitherRest


def rest(transmission: Transmission, wi: Direction, numbers: Sequence[Value] = EVEN, crowded: Value = 0.0) -> AnyRest:
    """The light from wi, above, that is scattered by media, or often by facets; diffuse light has `numbers`, whose
    first is of a medium alone the share of samples by phase functions, and is drawn `crowded` otherwise."""
    through = transmission.through
    if through is None:
        return _rest(transmission, wi, numbers, crowded)
    alone = PassedSamples.of(through, numbers[0])
    if isinstance(through.is_alone, float):
        return alone
    return EitherRest(through.is_alone > 0, alone, _rest(transmission, wi, numbers, crowded))


def _rest(transmission: Transmission, wi: Direction, numbers: Sequence[Value], crowded: Value) -> Rest:
    reached = bound(transmission) / transmission.indices[-1]
    if not transmission.is_cloudy:
        return Rest(None, 1.0, reached, numbers, crowded)
    i = entered(transmission, wi)
    scattering = [(slab, cosine) for slab, cosine in zip(transmission.slabs, i.bounded) if not is_none(slab.scattering)]
    alpha = _turned(scattering)
    # Without a jump, which would be seen between directions, and in gradients
    diffuse = ops.clip(
        (alpha - fitted.DIFFUSE_ALPHA[0]) / (fitted.DIFFUSE_ALPHA[1] - fitted.DIFFUSE_ALPHA[0]), 0.0, 1.0
    )
    width = type(transmission.refractions[0].width).uniform(WIDTHS.variance(alpha))
    return Rest(_lobe(transmission, i, transmission.scattered, width), diffuse, reached, numbers, crowded)


def _turned(slabs: Sequence[tuple[CrossedSlab, Value]]) -> Value:
    """Roughness of the mirror that deflects light as much as all scattering in slabs with their cosines."""
    depths = [ops.mean(slab.scattering) / ops.maximum(cosine, fitted.COS_OF_BOUNCES_MIN) for slab, cosine in slabs]
    total = reduce(operator.add, depths)
    g = ops.divide(reduce(operator.add, (depth * slab.g for depth, (slab, _) in zip(depths, slabs))), total)
    x = ops.maximum(total, THIN)
    g = ops.exp(x / (1 - ops.exp(-x)) * ops.log(ops.clip(g, G_MIN, 1.0)))
    cos_theta = ops.minimum(0.5 * g * (3 - g * g), 1.0)
    return ops.sqrt((1 - cos_theta) / (1 + cos_theta))


def _lobe(transmission: Transmission, i: MomentumInSlabs, under: Sequence[Value], inside: Variance) -> RefractedLobe:
    """The lobe in the slab above the interfaces that are `under` it, of the widths of refractions and those that light
    takes on inside."""
    n = _above(under, transmission.indices)
    scale = 1 / (2 * n * ops.maximum(_above(under, i.bounded), fitted.COS_OF_BOUNCES_MIN))
    for refraction, step in zip(transmission.refractions, i.steps):
        inside = inside + refraction.width * ops.power(
            ops.maximum(ops.absolute(step) * scale, ops.TINY), fitted.EXPONENT
        )
    u, v, rotation = inside.roughness(WIDTHS)
    roughness = Roughness(ops.minimum(u, INTERNAL_ALPHA_MAX), ops.minimum(v, INTERNAL_ALPHA_MAX), rotation)
    return RefractedLobe(
        1.0,
        roughness,
        n / transmission.indices[-1],
        leaving=_Outlet(transmission.indices, transmission.refractions, under),
    )


@dataclass(frozen=True)
class _Outlet:
    """Share (a colour) that the smooth interfaces that are `under` light let pass, by the cosine below all of them."""

    indices: Sequence[Value]
    refractions: Sequence[Refraction]
    under: Sequence[Value]

    def __call__(self, cos_o: Value) -> Value:
        n, p2 = self.indices, 1 - cos_o * cos_o
        passes: Value = 1.0
        for l, (flag, refraction) in enumerate(zip(self.under, self.refractions)):
            if isinstance(flag, float) and flag == 0.0:
                continue
            above, below = (ops.sqrt(1 - p2 * (n[-1] / x) * (n[-1] / x)) for x in n[l : l + 2])
            below = cos_o if l == len(self.refractions) - 1 else below
            passes = passes * (1 - flag + flag * refraction.passing(above, below))
        return passes


def _above(under: Sequence[Value], values: Sequence[Value]) -> Value:
    """Value of the slab above the first flagged interface, or of the last slab."""
    first = [flag - before for flag, before in zip((*under, 1.0), (0.0, *under))]
    return _sum(first, values)


def _sum(flags: Sequence[Value], values: Sequence[Any]) -> Any:
    """Sum of the values whose flags are 1."""
    kept = [(flag, x) for flag, x in zip(flags, values) if not (isinstance(flag, float) and flag == 0.0)]
    return reduce(operator.add, (x if isinstance(flag, float) else x * flag for flag, x in kept))


def seen_below(transmission: Transmission, wi: Direction) -> Direction:
    """Refracted counterpart of wi below the stack, flipped up, clamped to the horizon."""
    n = transmission.indices
    x, y = (wi[k] * (n[0] / n[-1]) for k in (0, 1))
    scale = 1 / ops.sqrt(ops.maximum(x * x + y * y, 1.0))
    x, y = scale * x, scale * y
    return x, y, ops.maximum(ops.sqrt(1 - x * x - y * y), COS_INSIDE_MIN)


def within(o: Direction, bound: Value) -> Direction:
    """A direction below as one of all that diffuse light up to a momentum has."""
    x, y = o[0] / bound, o[1] / bound
    return x, y, ops.sqrt(1 - x * x - y * y)


def eval_pdf_rest(found: AnyRest, i: Direction, o: Direction) -> tuple[Value, Value]:
    """f |cos theta_o|, a colour, and the density of `sample_rest`, in the frame of `seen_below`."""
    if isinstance(found, PassedSamples):
        return found.eval_pdf(i, o)
    if isinstance(found, EitherRest):
        (value, density), (other, of_other) = (eval_pdf_rest(each, i, o) for each in (found.alone, found.other))
        return ops.select(found.where, value, other), ops.select(found.where, density, of_other)
    inside = within(o, found.bound)
    even = found.diffuse * ops.maximum(o[2], 0.0) / (found.bound * found.bound)
    value = ops.select(inside[2] > 0, even * (1 / pi) * diffuse(found.numbers, i, inside), 0.0)
    drawn, crowd = forward.undone(found.forward, i, inside)
    density = even * crowd / ops.maximum(drawn[2], COS_OUTSIDE_MIN) * found.samples.density(i, drawn)
    if found.lobe:
        also, density_of_lobe = refracted_lobe.eval_pdf(found.lobe, i, o)
        value, density = (1 - found.diffuse) * also + value, (1 - found.diffuse) * density_of_lobe + density
    return value, density


def sample_rest(found: AnyRest, i: Direction, u: Value, u1: Value, u2: Value) -> Direction:
    """A direction, in the frame of `seen_below`, from uniform numbers."""
    if isinstance(found, PassedSamples):
        return found.sample(i, u, u1, u2)
    if isinstance(found, EitherRest):
        w, other = (sample_rest(each, i, u, u1, u2) for each in (found.alone, found.other))
        return select_direction(found.where, w, other)
    even = found.samples.sample(i, ops.clip(ops.divide(u, found.diffuse), 0.0, 1.0), u1, u2)
    x, y, _ = forward.moved(found.forward, i, even)
    x, y = found.bound * x, found.bound * y
    even = x, y, ops.sqrt(1 - x * x - y * y)
    if not found.lobe:
        return even
    other = refracted_lobe.sample(found.lobe, i, u1, u2)
    x, y, z = (ops.select(u < found.diffuse, a, b) for a, b in zip(even, other))
    return x, y, z


def diffuse(numbers: Sequence[Value], i: Direction, o: Direction) -> Value:
    """Density of diffuse light over its mean."""
    even, cosine, grazing, once, twice = numbers
    s = -1 * (i[0] * o[0] + i[1] * o[1])
    both = (i[0] * i[0] + i[1] * i[1]) * (o[0] * o[0] + o[1] * o[1])
    mean = even + cosine * o[2] + grazing * remainder.grazing(o[2])
    return ops.maximum(mean + once * s + twice * (2 * s * s - both), 0.0)  # model.md, Eq. 10


def integral_rest(found: AnyRest, i: tuple[Array, Array, Array]) -> Array:
    """Energy (3, N) of `eval_pdf_rest` from directions (N,) each."""
    assert isinstance(found, Rest)
    if not found.lobe:
        return np.ones((1, len(i[2])))
    return np.asarray((1 - found.diffuse) * refracted_lobe.integral(found.lobe, i) + found.diffuse)
