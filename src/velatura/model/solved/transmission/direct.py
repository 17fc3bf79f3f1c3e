"""Light that passes a stack without bouncing inside: a mixture of refractions, one for each interface.

Tails of GGX come from one steep facet. So component j takes the whole step of tangential momentum, from p_i to p_o, at
a facet of interface j, crosses all interfaces above smoothly at p_i and all below at p_o, and is as wide as all
together: the widths |w_l| a_l that interfaces give to momentum add as their powers of `EXPONENT`, as tensors where
interfaces are brushed. Its weight is its share of the squared widths, and far out its share of the tails there, which
for brushed interfaces depends on the direction. With d = p_o - p_i, cosines
c_l(p) = sqrt(1 - p^2 / n_l^2) in slabs 0 to K, and w_j = n_{j-1} c_{j-1}(p_i) - n_j c_j(p_o), light of direction wi
passes to wo as

    f |cos_o| = n_K^2 cos_o sum_j t_j P(d / w_j; a_j) / w_j^2 v_i v_o G1_j(i) G1_j(o) (1 - F_j) S_j(p_i) S_j(p_o)

where P is the density of slopes s of GGX of the width seen at interface j, v_i and v_o the cosines to the facet over
those to the interface (1 - p.s / (n c)), G1_j Smith's masking of interface j by itself, F_j Fresnel's reflectance at
the facet, and S_j what the smooth interfaces and the media above j and below it let pass.

For one interface that is microfacet refraction (Walter 2007, Eq. 21) as it stands. It is reciprocal: f / n^2 is the
same from the other side. Its integral comes close to the energy that passes straight through, which it is normalised
to in the end.

A sample draws a visible normal of one component, and Fresnel's reflectance decides: light that does not pass is
reflected about the same normal, as at a rough dielectric. Indices are relative to the outside, that of wi; light from
below is light from above a material that is turned over (`Material.reversed`).
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass, is_dataclass, replace
from functools import reduce
from itertools import accumulate
from math import pi
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.films.of_material import films_of
from velatura.films.reflectance import Films, dielectric_passing
from velatura.model import fitted
from velatura.model.guards import ALPHA_MIN
from velatura.model.roughness_maps import RoughnessMap
from velatura.model.solved import sample_allocation
from velatura.model.solved.guards import (
    COS_IN_SLABS_MIN,
    COS_OUTSIDE_MIN,
    MOMENTUM_STEP_MIN,
    MOMENTUM_WIDTH_ACROSS_MIN,
    MOMENTUM_WIDTH_MIN,
    WIDTH2_MIN,
)
from velatura.model.solved.lobes.top_medium import ScatteredThrough
from velatura.model.variance import Covariance, Isotropic, Roughness, Variance
from velatura.ops import Value
from velatura.optics import fresnel, ggx
from velatura.optics.ggx import Direction
from velatura.renderer import compiled, low_discrepancy
from velatura.renderer.compiled import Colour, Found, Number
from velatura.renderer.directional_grid import Curves
from velatura.stack import InterfaceValues, Material, SlabValues
from velatura.stack.chain import chain

NODES = (16, 24)  # of the quadrature
LEAST_RAYS = 12  # of these, of many brushed interfaces
EDGE = 0.98  # of the disc of momenta that can leave, where light from beyond it is looked for

#: Widths in the space where they add; they have no upper bound.
WIDTHS = RoughnessMap(lambda a, _: ops.power(a, fitted.EXPONENT), lambda s, _: ops.power(s, 1 / fitted.EXPONENT))

Momentum = tuple[Value, Value]
Passing = Callable[[Value, Value], Value]
Array = NDArray[np.floating]
T = TypeVar("T")


@dataclass(frozen=True)
class Refraction(ops.NamedFields):
    """An interface between media of mean indices n_1 and n_2; `eta` is the lower over the upper one, by colour.

    `width` is the roughness in the space of `WIDTHS`, `area` its product over the axes, `sign` that of n_1 - n_2: 0
    where facets turn light by less than single precision has. Then all make the step `least`, none hides another, and
    light passes as at a smooth interface. `films` are thin films on it.
    """

    n_1: Value
    n_2: Value
    eta: Value
    roughness: Roughness
    width: Variance
    area: Value
    sign: Value
    least: Value
    films: Films | None = None

    def passing(self, cos_1: Value, cos_2: Value) -> Value:
        """Transmittance of facets (a colour) for cosines above and below, by Fresnel."""
        return dielectric_passing(self.films, cos_1, cos_2, self.eta)


@dataclass(frozen=True)
class CrossedSlab(ops.NamedFields):
    """Media between two interfaces: optical depths along the normal (colours), in all and for scattering, and the
    asymmetry g."""

    depth: Value = 0.0
    scattering: Value = 0.0
    g: Value = 0.0

    @property
    def is_clear(self) -> bool:
        return isinstance(self.depth, float) and self.depth == 0.0

    def over(self, other: CrossedSlab) -> CrossedSlab:
        """This and another medium below it as one, of the mean asymmetry of what they scatter."""
        if is_none(self.scattering):
            return other if self.is_clear else replace(other, depth=self.depth + other.depth)
        if is_none(other.scattering):
            return replace(self, depth=self.depth + other.depth)
        here, there = ops.mean(self.scattering), ops.mean(other.scattering)
        g = ops.divide(here * self.g + there * other.g, here + there)
        return CrossedSlab(self.depth + other.depth, self.scattering + other.scattering, g)


@dataclass(frozen=True)
class Transmission:
    """Interfaces from the top, and the slabs 0 to K above, between and below them.

    Of interfaces, `faces` are 1 for the last two that make a step of the index, or for the only one, else 0; `under`
    are 1 from the last of them on; `scattered` are 1 below the last medium that scatters, or the last rough interface.
    What a medium alone scatters is light `through` it, None elsewhere.
    """

    refractions: tuple[Refraction, ...]
    slabs: tuple[CrossedSlab, ...]
    faces: tuple[Value, ...]
    under: tuple[Value, ...]
    scattered: tuple[Value, ...]
    bounces: bool
    is_cloudy: bool
    through: ScatteredThrough | None = None

    @property
    def indices(self) -> list[Value]:
        """Those of the slabs."""
        return [self.refractions[0].n_1, *(refraction.n_2 for refraction in self.refractions)]


def transmission(
    material: Material,
    kind: type[Variance],
    stepped: Sequence[int] | None = None,
    rough: int | None = None,
    cloudy: Sequence[int] | None = None,
) -> Transmission:
    """A material that transmits, ready for light from above; `kind` as of `variance_kind`. `stepped` are the
    interfaces that make a step of the index, `rough` is the last one whose facets turn light, `cloudy` are the
    slabs that scatter; None for all, for the last one, and for those of media whose scattering is not known to be 0.
    """
    n = 1.0
    refractions: list[Refraction] = []
    slabs = [CrossedSlab()]
    for meeting in chain(material.solid(), films_of(material)):
        layer = meeting.layer
        if isinstance(layer, SlabValues):
            tau_s = layer.tau_s
            clear = is_none(tau_s) if cloudy is None else len(refractions) not in cloudy
            slabs[-1] = slabs[-1].over(CrossedSlab(layer.tau_a + tau_s, 0.0 if clear else tau_s, ops.mean(layer.g)))
            continue
        assert isinstance(layer, InterfaceValues) and layer.kind == "dielectric"
        refractions.append(_crossing(layer, meeting.above, n, kind, meeting.films))
        slabs.append(CrossedSlab())
        n = refractions[-1].n_2
    count = len(refractions)
    lower, *others = reversed(range(count) if stepped is None else stepped or [count - 1])
    faces = tuple(float(k in (lower, *others[:1])) for k in range(count))
    under = tuple(float(k >= lower) for k in range(count))
    scattering = [l for l, slab in enumerate(slabs) if not is_none(slab.scattering)]
    last = min(scattering[-1], count - 1) if scattering else 1 + (count - 1 if rough is None else rough)
    scattered = tuple(float(k >= last) for k in range(count))
    is_cloudy = bool(scattering)
    return Transmission(tuple(refractions), tuple(slabs), faces, under, scattered, bool(others), is_cloudy)


def is_none(x: Value) -> bool:
    return isinstance(x, float | np.ndarray) and not np.any(x)


def _crossing(
    layer: InterfaceValues, above: Value, n_1: Value, kind: type[Variance], films: Films | None
) -> Refraction:
    eta = layer.eta / above
    ratio = ops.mean(layer.eta) / ops.mean(above)  # and so its inverse from the other side
    u, v = ops.maximum(layer.alpha_u, ALPHA_MIN), ops.maximum(layer.alpha_v, ALPHA_MIN)
    # Across the brushing light has a width, too
    step = n_1 * ops.absolute(ratio - 1)
    narrow = ops.divide(MOMENTUM_WIDTH_ACROSS_MIN, step)
    u, v = ops.maximum(u, ops.minimum(narrow, v)), ops.maximum(v, ops.minimum(narrow, u))
    roughness = Roughness(u, v, layer.rotation * (pi / 180) if kind is Covariance else 0.0)
    least = n_1 * ops.sqrt(ratio) * MOMENTUM_WIDTH_MIN / ops.sqrt(u * v)
    turns = step > least
    sign, least = ops.select(turns, ops.select(ratio < 1, 1.0, -1.0), 0.0), ops.select(turns, MOMENTUM_STEP_MIN, least)
    return Refraction(n_1, n_1 * ratio, eta, roughness, kind.of(roughness, WIDTHS), u * v, sign, least, films)


@dataclass(frozen=True)
class MomentumInSlabs(ops.NamedFields):
    """A momentum p in all slabs: its cosines there, 0 where it cannot be, and the same bounded; for interfaces, the
    steps w_l, and the shares (colours) of light that they let pass; the latter for slabs, too."""

    p: Momentum
    p2: Value
    n: list[Value]
    cosines: list[Value]
    bounded: list[Value]
    steps: list[Value]
    passes: list[Value]
    slabs: list[Value]


def entered(transmission: Transmission, wi: Direction) -> MomentumInSlabs:
    """The momentum of light from wi, above."""
    n = transmission.indices[0]
    return _crossed(transmission, (-n * wi[0], -n * wi[1]), ops.maximum(wi[2], 0.0), None)


def _crossed(transmission: Transmission, p: Momentum, above: Value, below: Value | None) -> MomentumInSlabs:
    """The momentum p in all slabs, with the cosines above and below all interfaces where more exact ones are known."""
    p2 = p[0] * p[0] + p[1] * p[1]
    cosines = [ops.sqrt(1 - p2 / (n * n)) for n in transmission.indices]  # model.md, Eq. 1
    bounded = [ops.maximum(c, COS_IN_SLABS_MIN) for c in cosines]
    for l, known in ((0, above), (-1, below)):
        if known is not None:
            cosines[l], bounded[l] = known, ops.maximum(known, COS_OUTSIDE_MIN)
    refractions = transmission.refractions
    steps = [c.n_1 * bounded[l] - c.n_2 * bounded[l + 1] for l, c in enumerate(refractions)]
    passes = [c.passing(cosines[l], cosines[l + 1]) for l, c in enumerate(refractions)]
    slabs = [1.0 if slab.is_clear else ops.exp(-slab.depth / c) for slab, c in zip(transmission.slabs, bounded)]
    return MomentumInSlabs(p, p2, transmission.indices, cosines, bounded, steps, passes, slabs)


def _from_top(values: Sequence[T], join: Callable[[T, T], T]) -> list[T]:
    """Values joined with all that come before them."""
    return list(accumulate(values, join))


def _from_bottom(values: Sequence[T], join: Callable[[T, T], T]) -> list[T]:
    """Values joined with all that come after them."""
    return list(accumulate(reversed(values), join))[::-1]


def _smooth_above(crossed: MomentumInSlabs) -> list[Value]:
    """Share (a colour) of light that passes all smooth interfaces above each one."""
    return [1.0, *_from_top(crossed.passes[:-1], operator.mul)]


def _smooth_below(crossed: MomentumInSlabs) -> list[Value]:
    return [*_from_bottom(crossed.passes[1:], operator.mul), 1.0]


@dataclass(frozen=True)
class _Component(ops.NamedFields):
    """Interface j as the one that takes the step: that step, bounded, the roughness seen there, and its weight."""

    step: Value
    roughness: Roughness
    weight: Value


def _components(
    transmission: Transmission,
    above: Sequence[Value],
    own: Sequence[Value],
    below: Sequence[Value],
    d: Momentum | None = None,
    widths_above: Sequence[Variance] | None = None,
) -> list[_Component]:
    """The component of each interface for its `own` step, and those of `above` and `below` that light makes at the
    interfaces there, of `widths_above` if these are known; d is the sum of its moves, None for little. A single
    interface has its own roughness, and all the weight."""
    refractions, last = transmission.refractions, len(own) - 1
    sizes = [ops.maximum(refraction.sign * step, refraction.least) for refraction, step in zip(refractions, own)]
    if not last:
        return [_Component(sizes[0], refractions[0].roughness, 1.0)]
    widths_above = widths_above or _widths_above(transmission, above)
    widths_below = _from_bottom([_width(*each) for each in zip(refractions, below)], operator.add)
    over, at, under = ([_weight(*each) for each in zip(refractions, steps)] for steps in (above, own, below))
    over_all, under_all = _from_top(over, operator.add), _from_bottom(under, operator.add)
    # Tails of isotropic interfaces are alike
    lengths2 = [_length2(x, d) for x in refractions if d is not None and not isinstance(x.width, Isotropic)]
    found = []
    for j, (refraction, size) in enumerate(zip(refractions, sizes)):
        width, scale, weight, total = refraction.width, ops.power(size, -fitted.EXPONENT), at[j], at[j]
        if j:
            width, total = width + widths_above[j - 1] * scale, over_all[j - 1] + total
        if j < last:
            width, total = width + widths_below[j + 1] * scale, total + under_all[j + 1]
        if lengths2:
            # Densities of tails, but for what all have in common
            ends = [length2 + total for length2 in lengths2]
            weights = [x / (end * end) for x, end in zip([*over[:j], weight, *under[j + 1 :]], ends)]
            weight, total = weights[j], reduce(operator.add, weights)
        found.append(_Component(size, width.roughness(WIDTHS), weight / total))
    return found


def _widths_above(transmission: Transmission, steps: Sequence[Value]) -> list[Variance]:
    """Widths of the moves of light at all interfaces down to each one."""
    return _from_top([_width(*each) for each in zip(transmission.refractions, steps)], operator.add)


def _width(refraction: Refraction, step: Value) -> Variance:
    """Width of a move of light that makes a step, in the space of `WIDTHS`."""
    return refraction.width * ops.power(ops.maximum(ops.absolute(step), ops.TINY), fitted.EXPONENT)


def _weight(refraction: Refraction, step: Value) -> Value:
    """Square of the width of a step."""
    width2 = ops.select(_turns(refraction.sign), step * step * refraction.area, 0.0)
    return width2 + WIDTH2_MIN * refraction.n_1 * refraction.n_2


def _length2(refraction: Refraction, d: Momentum) -> Value:
    """Square of the length of d, by which the tail of an interface falls, as for one that is isotropic."""
    alpha_u, alpha_v, rotation = refraction.roughness
    x, y, _ = _turned((*d, 0.0), rotation)
    return x * x * (alpha_v / alpha_u) + y * y * (alpha_u / alpha_v)


def _drawn(
    transmission: Transmission, i: MomentumInSlabs, widths_above: Sequence[Variance] | None = None
) -> tuple[list[_Component], list[Value]]:
    """The components as they are sampled, as wide as at p_o = p_i, and their probabilities."""
    components = _components(transmission, i.steps, i.steps, i.steps, None, widths_above)
    if len(components) == 1:
        return components, [1.0]
    # Leave out parts that light does not reach; it always reaches the first interface
    shares = [c.weight * ops.mean(share) for c, share in zip(components, _smooth_above(i))]
    shares[0] = shares[0] + WIDTH2_MIN
    total = sum(shares[1:], shares[0])
    return components, [share / total for share in shares]


@dataclass(frozen=True)
class _Arriving:
    """Light from one direction above: its momentum; widths of its moves down to each interface; the components that are
    drawn of it, and their probabilities; masking by each interface, as it is and as it is drawn; the mean share that it
    lets pass where it is smooth, and the share (a colour) that comes to it."""

    momentum: MomentumInSlabs
    widths: Sequence[Variance]
    drawn: Sequence[_Component]
    shares: Sequence[Value]
    alone: Sequence[Value]
    masked: Sequence[Value]
    evenly: Sequence[Value]
    comes: Sequence[Value]

    @classmethod
    def of(cls, transmission: Transmission, wi: Direction) -> _Arriving:
        i = entered(transmission, wi)
        widths = _widths_above(transmission, i.steps) if len(i.steps) > 1 else []
        drawn, shares = _drawn(transmission, i, widths)
        alone = [_masking(x.roughness, i, j) for j, x in enumerate(transmission.refractions)]
        masked = [_masking(x.roughness, i, j) for j, x in enumerate(drawn)]
        comes = [x * y for x, y in zip(_smooth_above(i), _from_top(i.slabs, operator.mul))]
        return cls(i, widths, drawn, shares, alone, masked, [*map(ops.mean, i.passes)], comes)


def chances(transmission: Transmission, wi: Direction) -> list[Value]:
    """Share of samples of light from wi that meet facets of each interface, from the top."""
    return _drawn(transmission, entered(transmission, wi))[1]


def eval_pdf(transmission: Transmission, wi: Direction, wo: Direction) -> tuple[Value, Value]:
    """f(wi, wo) |cos theta_o|, a colour, of light that passes straight through; the density of `sample` on both sides.

    wi lies above. Radiance is not scaled by the index. The value is 0 for wo above.
    """
    value, density = _eval_pdf(transmission, _Arriving.of(transmission, wi), wo)
    lit = wi[2] > 0
    return ops.select(lit, value, 0.0), ops.select(lit, density, 0.0)


def _eval_pdf(
    transmission: Transmission, arriving: _Arriving, wo: Direction, passes: bool = False
) -> tuple[Value, Value]:
    """Like `eval_pdf`, for light from above; `passes` if all wo lie below."""
    n, i = transmission.indices, arriving.momentum
    below, cos_o = wo[2] < 0, ops.absolute(wo[2])
    n_out = ops.select(below, n[-1], n[0])
    o = _crossed(
        transmission, (n_out * wo[0], n_out * wo[1]), cos_o, cos_o
    )  # no part reads the cosine on the side of wi and that beyond
    d = o.p[0] - i.p[0], o.p[1] - i.p[1]
    own = [c.n_1 * i.bounded[j] - c.n_2 * o.bounded[j + 1] for j, c in enumerate(transmission.refractions)]
    components = _components(transmission, i.steps, own, o.steps, d, arriving.widths)
    below_all, slabs_below = _smooth_below(o), _from_bottom(o.slabs, operator.mul)
    lowest = _from_bottom(n, ops.minimum)
    value: Value = 0.0
    density: Value = 0.0
    for j, (refraction, component, sampled, share) in enumerate(
        zip(transmission.refractions, components, arriving.drawn, arriving.shares)
    ):
        with ops.block(f"Pass by a facet of interface {j}"):
            facet = _facet(refraction, i, o, j, component.step)
            alone = arriving.alone[j] * _masking(refraction.roughness, o, j + 1)
            turns = _turns(refraction.sign)
            smooth = arriving.comes[j] * (below_all[j] * slabs_below[j + 1])
            seen = component.weight * _slopes(component.roughness, facet.slope) * ops.select(turns, alone, 1.0)
            value = value + smooth * facet.passes * seen  # model.md, Eq. 9
            visible = ops.mean(facet.passes) * arriving.masked[j]
            evenly = arriving.evenly[j] / (component.step * component.step)
            through = _slopes(sampled.roughness, facet.slope) * ops.select(turns, visible, evenly)
            through = ops.select(o.p2 < lowest[j + 1] * lowest[j + 1], through, 0.0)
        with ops.block("Or be reflected by it"):
            if not passes:
                through = ops.select(below, through, _reflected(transmission, i, o, j, sampled.roughness))
            density = density + share * through
    # From momentum to solid angle
    scale = n_out * n_out * cos_o
    return ops.select(below, value * scale, 0.0), density * scale


def sample(transmission: Transmission, wi: Direction, u: Value, u1: Value, u2: Value) -> Direction:
    """A direction wo from uniform numbers, on either side of the material.

    It lies in the surface where light of the facet drawn would stay inside; `eval_pdf` is 0 there.
    """
    n = transmission.indices
    i = entered(transmission, wi)
    components, shares = _drawn(transmission, i)
    with ops.block("Choose an interface"):
        every, begins = [], []
        u_chosen, begin = u, 0.0
        for j, (c, component, share) in enumerate(zip(transmission.refractions, components, shares)):
            bounds = _lowest2(n[: j + 1]), _lowest2(n[j + 1 :])
            own = c.n_1, c.n_2, c.eta, c.sign, c.least, i.bounded[j], ops.mean(i.passes[j])
            every.append([*own, *component.roughness, *bounds, share, begin])
            begins.append(begin)
            begin = begin + share
        chosen = every[0]
        for fields in every[1:]:
            chosen = [b if a is b else ops.select(u > fields[-1], a, b) for a, b in zip(fields, chosen)]
        n_1, n_2, eta, sign, least, cosine, evenly, alpha_u, alpha_v, rotation, up2, down2, share, begin = chosen
        u = (u - begin) / share
    with ops.block("Draw a normal"):
        w = i.p[0] / -n_1, i.p[1] / -n_1, cosine
        h = _turned(ggx.sample_visible(_turned(w, rotation), alpha_u, alpha_v, u1, u2), -rotation)
    with ops.block("Refract or reflect"):
        p, passes = _refracted(n_1, n_2, _chosen(transmission.refractions, eta, u_chosen, begins), i.p, w, h, down2)
        r, phi, turns = least * ops.sqrt(ops.divide(u2, 1 - u2)), 2 * pi * u1, _turns(sign)
        x, y, _ = _turned((r * alpha_u * ops.cos(phi), r * alpha_v * ops.sin(phi), 1.0), -rotation)
        p = ops.select(turns, p[0], i.p[0] + x), ops.select(turns, p[1], i.p[1] + y)
        below = u < ops.select(turns, passes, evenly)
        turned = 2 * ggx.dot(w, h)
        back = i.p[0] + n_1 * turned * h[0], i.p[1] + n_1 * turned * h[1]
        leaves = (turned * h[2] > cosine) & (back[0] * back[0] + back[1] * back[1] < up2)
    n_out = ops.select(below, n[-1], n[0])
    x, y = (ops.select(below, a, b) / n_out for a, b in zip(p, back))
    z = ops.sqrt(1 - x * x - y * y)
    return x, y, ops.select(below, -z, ops.select(leaves, z, 0.0))


@dataclass(frozen=True)
class _Facet(ops.NamedFields):
    """The facet that refracts light: its slope, up to a sign, and (1 - F) v_i v_o / w^2 (a colour; 0 without one)."""

    slope: Momentum
    passes: Value


def _facet(refraction: Refraction, i: MomentumInSlabs, o: MomentumInSlabs, j: int, step: Value) -> _Facet:
    """Facet of interface j, for its step as `_components` bound it."""
    n_1, n_2, c_1, c_2 = refraction.n_1, refraction.n_2, i.bounded[j], o.bounded[j + 1]
    slope = (o.p[0] - i.p[0]) / step, (o.p[1] - i.p[1]) / step
    v_i = 1 - refraction.sign * (i.p[0] * slope[0] + i.p[1] * slope[1]) / (n_1 * c_1)
    v_o = 1 - refraction.sign * (o.p[0] * slope[0] + o.p[1] * slope[1]) / (n_2 * c_2)
    turns = _turns(refraction.sign)
    height = ops.select(turns, 1 / ops.sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]), 1.0)
    forwards = ops.select(turns, refraction.sign * (n_1 * c_1 - n_2 * c_2), 1.0)
    faces = (v_i > 0) & (v_o > 0) & (forwards > 0)
    v_i, v_o = ops.maximum(v_i, 0.0), ops.maximum(v_o, 0.0)
    passing = refraction.passing(v_i * c_1 * height, v_o * c_2 * height)
    return _Facet(slope, ops.select(faces, passing * (v_i * v_o / (step * step)), 0.0))


def _refracted(
    n_1: Value, n_2: Value, passing: Passing, p: Momentum, w: Direction, h: Direction, lowest2: Value
) -> tuple[Momentum, Value]:
    """Momentum p, of direction w above, after refraction about a normal h, and the probability that light takes it:
    none unless it crosses all slabs below."""
    cos_1 = ggx.dot(w, h)
    cos_2 = ops.sqrt(1 - (1 - cos_1 * cos_1) * (n_1 * n_1) / (n_2 * n_2))
    step = n_1 * cos_1 - n_2 * cos_2
    x, y = p[0] + step * h[0], p[1] + step * h[1]
    crosses = (cos_1 > 0) & (cos_2 > 0) & (n_1 * w[2] > step * h[2]) & (x * x + y * y < lowest2)
    passes = ops.mean(passing(cos_1, cos_2))
    return (x, y), ops.select(crosses, passes, 0.0)


def _chosen(refractions: Sequence[Refraction], eta: Value, u: Value, begins: Sequence[Value]) -> Passing:
    """Transmittance of the interface of relative index `eta` that u has chosen, by where each begins."""
    if not any(refraction.films for refraction in refractions):
        return lambda cos_1, cos_2: 1 - fresnel.dielectric_between(cos_1, cos_2, eta)

    def passing(cos_1: Value, cos_2: Value) -> Value:
        found = refractions[0].passing(cos_1, cos_2)
        for refraction, begin in zip(refractions[1:], begins[1:]):
            found = ops.select(u > begin, refraction.passing(cos_1, cos_2), found)
        return found

    return passing


def _reflected(
    transmission: Transmission, i: MomentumInSlabs, o: MomentumInSlabs, j: int, roughness: Roughness
) -> Value:
    """Density of the momentum o, of light reflected by the facets of interface j that it does not pass."""
    n, c = transmission.indices, transmission.refractions[j]
    cos_i, cos_o = i.bounded[j], o.bounded[j]
    w = i.p[0] / -c.n_1, i.p[1] / -c.n_1, cos_i
    h = ggx.normalize((w[0] + o.p[0] / c.n_1, w[1] + o.p[1] / c.n_1, cos_i + cos_o))
    _, passes = _refracted(c.n_1, c.n_2, c.passing, i.p, w, h, _lowest2(n[j + 1 :]))
    passes = ops.select(_turns(c.sign), passes, ops.mean(i.passes[j]))
    visible = ggx.ndf(_turned(h, roughness.rotation), roughness.alpha_u, roughness.alpha_v)
    density = visible * _masking(roughness, i, j) * (1 - passes) / (4 * cos_i * cos_o * c.n_1 * c.n_1)
    return ops.select(o.p2 < _lowest2(n[: j + 1]), density, 0.0)


def _slopes(roughness: Roughness, slope: Momentum) -> Value:
    """Density of slopes of GGX."""
    alpha_u, alpha_v, rotation = roughness
    x, y, _ = _turned((*slope, 1.0), rotation)
    x, y = x / alpha_u, y / alpha_v
    q = 1 + x * x + y * y
    return 1 / (pi * alpha_u * alpha_v * q * q)


def _masking(roughness: Roughness, crossed: MomentumInSlabs, slab: int) -> Value:
    """Smith's G1 in a slab; the side from which light comes, and its length, make no difference."""
    p, z = crossed.p, crossed.n[slab] * crossed.bounded[slab]
    return ggx.masking(_turned((p[0], p[1], z), roughness.rotation), roughness.alpha_u, roughness.alpha_v)


def _turns(sign: Value) -> Value:
    return ops.absolute(sign) > 0


def _turned(w: Direction, rotation: Value) -> Direction:
    return w if isinstance(rotation, float) and rotation == 0.0 else ggx.rotate(w, rotation)


def _lowest2(indices: Sequence[Value]) -> Value:
    """Square of the momentum that light has at most in all of some slabs."""
    lowest = reduce(ops.minimum, indices)
    return lowest * lowest


# The integral, in NumPy


def integrals(
    transmission: Transmission, wi: tuple[Array, Array, Array], nodes: tuple[int, int] = NODES
) -> tuple[Array, Array, Array]:
    """Energy (3, N) that `eval_pdf` passes from directions wi, (N,) each, the mean square (3, N) of the weights of
    samples, and the share (N,) of them that pass.

    By quadrature on rays of p_o from p_i, or from the point next to it that can leave, with nodes that crowd as the
    tails of GGX do; their numbers are those along a ray, and of rays.
    """
    n = transmission.indices
    arriving = _Arriving.of(transmission, wi)
    i = arriving.momentum
    widths = [
        c.width * ops.power(np.abs(step) + ops.TINY, fitted.EXPONENT)
        for c, step in zip(transmission.refractions, i.steps)
    ]
    u, v, rotation = (np.broadcast_to(x, i.p2.shape) for x in reduce(lambda a, b: a + b, widths).roughness(WIDTHS))
    # Cast rays from the middle
    along, weight = low_discrepancy.gauss(nodes[0])
    # Both sides of the plane of incidence are alike where interfaces have no axes; elsewhere as many rays for each
    # side, so that light does not jump between them, but fewer of many interfaces, whose light is round
    alike = all(isinstance(refraction.width, Isotropic) for refraction in transmission.refractions)
    share = 1.0 if alike else sample_allocation.share(len(transmission.refractions)) ** 0.5
    half = max(round(share * nodes[1]), min(LEAST_RAYS, nodes[1]))
    turns = half if alike else 2 * half
    phi = (np.arange(turns) + 0.5) * (pi / half)
    rotation = np.arctan2(i.p[1], i.p[0]) if alike else rotation
    n_out = np.asarray(n[-1])
    length = np.sqrt(np.maximum(i.p2, ops.TINY))
    bound = np.where(length < n_out, np.minimum(1, (1 - MOMENTUM_WIDTH_MIN) * n_out / length), EDGE * n_out / length)
    gap = (1 - bound) * length
    u, v = (np.sqrt(width**2 + gap**2 + MOMENTUM_WIDTH_MIN**2) for width in (u, v))
    middle = *(bound * x for x in i.p), u, v, np.cos(rotation), np.sin(rotation)
    rays = np.tile(along, turns), np.tile(weight * (pi / turns), turns)
    around = np.repeat(np.cos(phi), nodes[0]), np.repeat(np.sin(phi), nodes[0])
    alone = Transmission(tuple(map(_numbered, transmission.refractions)), transmission.slabs, (), (), (), False, False)
    # A kernel reads what depends on wi alone, which would be a third of it to compile
    rows = list[Array]()
    arriving = replace(
        arriving,
        momentum=replace(i, n=[], cosines=[], passes=[], slabs=[]),
        comes=[*np.broadcast_arrays(*map(np.atleast_2d, arriving.comes))],
    )
    numbers = wider(alone), _placed(arriving, rows, len(i.p2)), Colour(np.ones((compiled.COLOURS, 1, 1)))
    found, _, _ = compiled.over(_passed, (*middle, *rows), (*rays, *around), numbers)
    *energy, passes = found
    count = len(energy) // 2
    return np.array(energy[:count]), np.array(energy[count:]), passes


def _numbered(refraction: Refraction) -> Refraction:
    """An interface for a kernel that serves both sides, and any axes of brushed interfaces."""

    def number(value: Value) -> Number:
        return Number(np.asarray(value).item())

    # An index is 1 but for rounding
    n_1, n_2, sign = map(number, (refraction.n_1, refraction.n_2, refraction.sign))
    found = replace(refraction, n_1=n_1, n_2=n_2, sign=sign)
    if isinstance(refraction.width, Isotropic):
        return found
    width = type(refraction.width)(*map(number, vars(refraction.width).values()))
    return replace(found, roughness=Roughness(*map(number, refraction.roughness)), width=width)


class _Rows(NamedTuple):
    """The place of a value among those of sources: the first of its rows, and how many channels it has."""

    first: int
    channels: int


def _placed(values: _Arriving, rows: list[Array], count: int) -> _Arriving:
    """The places of values of sources among `rows`, which gets them, (count,) each."""

    def place(value: Any) -> Any:
        if isinstance(value, float) and value == 0:
            return value
        each = np.atleast_2d(value)
        rows.extend(each if each.shape[-1] == count else np.broadcast_to(each, (len(each), count)))
        return _Rows(len(rows) - len(each), len(each))

    found: _Arriving = mapped(values, np.ndarray | float, place)
    return found


def _passed(sources: Sequence[Value], samples: Sequence[Value], numbers: Any) -> Found:
    transmission, arriving, colour = numbers
    p_x, p_y, u, v, cosine, sine, *rows = sources

    def value(at: _Rows) -> Value:
        return colour(*rows[at.first : at.first + at.channels]) if at.channels > 1 else rows[at.first]

    arriving = mapped(arriving, _Rows, value)
    share, weight, *around = samples
    n = transmission.indices[-1]
    along_u, along_v = u * around[0], v * around[1]
    ray = cosine * along_u - sine * along_v, sine * along_u + cosine * along_v
    # Follow each to the rim of the disc, where the distribution r^2 / (1 + r^2) of widths has come to `most`
    length2, along = ray[0] * ray[0] + ray[1] * ray[1], ray[0] * p_x + ray[1] * p_y
    rim = (ops.sqrt(along * along + length2 * (n * n - p_x * p_x - p_y * p_y)) - along) / length2
    most = rim * rim / (1 + rim * rim)
    odds = share * most / (1 - share * most)
    r = ops.sqrt(odds)
    x, y = (p_x + r * ray[0]) / n, (p_y + r * ray[1]) / n
    z = ops.sqrt(ops.maximum(1 - x * x - y * y, 1e-12))
    area = weight * most * ((1 + odds) * (1 + odds) * u * v / (n * n * z))
    value, density = _eval_pdf(transmission, arriving, (x, y, -1 * z), True)
    return Found([value * area, value * area * ops.divide(value, density), density * area])


def wider(values: Any) -> Any:
    """Records of arrays, with one axis more; tables stay as they are."""
    return mapped(values, np.ndarray, lambda value: value[..., None])


def mapped(values: Any, kind: Any, change: Callable[[Any], Any]) -> Any:
    """Records with their values of a kind changed; tables stay as they are."""
    if isinstance(values, kind):
        return change(values)
    if isinstance(values, Curves):
        return values
    if isinstance(values, tuple | list):
        each = [mapped(value, kind, change) for value in values]
        return type(values)(*each) if hasattr(values, "_fields") else type(values)(each)
    if is_dataclass(values) and not isinstance(values, type):
        return type(values)(**{name: mapped(value, kind, change) for name, value in vars(values).items()})
    return values
