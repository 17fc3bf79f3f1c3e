"""A uniform material as a BSDF: lobes in their own media, the remainder, and what passes, each with its own energy.

All that depends on direction is columns of numbers (`velatura.model.solved.solve`): energies over integrals, widths,
and chances of being sampled. A side is a material as light from above sees it; stacks that transmit have two.

The forward form takes all of a part from the direction of the light. The symmetric form takes the geometric mean of
the values there and back, with weights by which it keeps the energies (`velatura.model.solved.reciprocal_balance`);
samples are those of the forward form.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any

from velatura import ops
from velatura.model.base import ALL, Query
from velatura.model.directions import select_direction, upright
from velatura.model.roughness_maps import RoughnessMap
from velatura.model.smooth_interface import SmoothInterface
from velatura.model.solved.columns import Column, Columns, Declaration
from velatura.model.solved.guards import BELOW_ONE, COS_OF_DIRECTIONS_MIN, ENERGY_EPS
from velatura.model.solved.lobes import refracted_lobe, top_medium, wide
from velatura.model.solved.lobes.refracted_lobe import MediumIndex, RefractedLobe
from velatura.model.solved.lobes.remainder import Remainder, RemainderSamples
from velatura.model.solved.lobes.top_medium import TopMedium, TopSamples
from velatura.model.solved.transmission import combined
from velatura.model.solved.transmission.combined import Parts
from velatura.model.solved.transmission.direct import Transmission
from velatura.model.variance import PerAxis, Roughness, Variance
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.renderer.directional_grid import Curves, Packed

MAX_SAMPLE_WEIGHT = 2.9  # weight of a sample
NOTHING = Remainder(*[0.0] * len(fields(Remainder)))


class _Roots(RoughnessMap):
    """Needs no bounds."""

    def roughness(self, variance: Value, across: Value | None = None) -> Value:
        return variance * variance


#: What is interpolated are roots of roughness, or matrices of them, so that axes may turn.
ROOTS = _Roots(lambda along, across: ops.sqrt(along), lambda along, across: along * along)


@dataclass(frozen=True)
class Shape:
    """A lobe but for its columns: number of its interface, index of its medium, the facets that it is of, and what
    lets it out, with the index above that. Brushed facets let light out that they face: its cosine there is `steeper`,
    by a share of sin^2; None for others."""

    interface: int
    n: MediumIndex
    facets: SmoothInterface | None
    n_first: MediumIndex
    first: SmoothInterface | None
    steeper: Value | None = None

    def lobe(self, weight: Value, roughness: Roughness) -> RefractedLobe:
        reflect = self.facets.reflect_together if self.facets else None
        leaving, grazing = self._leaving if self.first else None, self.steeper is not None
        return RefractedLobe(weight, roughness, self.n, reflect, leaving, grazing)

    def _leaving(self, cosine: Value) -> Value:
        assert self.first
        n, cos2 = self.n_first, cosine * cosine
        if not n.is_outside:
            cos2 = ops.maximum((n.ring2 + cos2) * (n.inverse * n.inverse), 0.0)
        if self.steeper is not None:
            cos2 = cos2 + self.steeper * (1 - cos2)
        return self.first.pass_together(cos2)


@dataclass(frozen=True)
class Side:
    """One side of a solved material, in a renderer's numbers; a colour is made of `colours` channels.

    The remainder is drawn by `samples`. With it goes what the medium `top` scatters back, None where none is apart.
    Light that is too wide for lobes has columns of its own in sides that are `wide`.
    """

    curves: Any
    shapes: tuple[Shape, ...]
    polynomial: Remainder
    samples: RemainderSamples
    transmission: Transmission | None
    colour: Callable[..., Value]
    colours: int
    kind: type[Variance]
    top: TopMedium | None = None
    wide: bool = False

    @property
    def declaration(self) -> Declaration:
        passes, top = self.transmission is not None, self.top is not None
        return Declaration(len(self.shapes), len(fields(self.kind)), passes, top, self.wide)

    def at(self, w: Direction) -> Columns:
        """The columns for a direction above, where each part has its share."""
        return self.narrowed(self.read(w))

    def read(self, w: Direction) -> Columns:
        """The columns for a direction above, as they are declared."""
        found = self.declaration.read(self.values(self.declaration.columns, self.curves(w)))
        return replace(found, chance=ops.maximum(found.chance, 0.0))

    def either(self, other: Side, where: Value, w: Direction) -> Columns:
        """The columns of this side where a condition holds, else of another one, for a direction above."""
        if isinstance(self.curves, Packed) and isinstance(other.curves, Packed):
            return replace(self, curves=self.curves.either(other.curves, where)).at(w)
        columns: Columns = ops.select_record(where, self.at(w), other.at(w))
        return columns

    def narrowed(self, columns: Columns) -> Columns:
        """Columns where what is wide is no more that of lobes."""
        return columns.narrowed([shape.interface > 0 for shape in self.shapes]) if self.wide else columns

    def values(self, columns: Iterable[Column], channels: Iterable[Value]) -> list[Value]:
        """Numbers and colours of columns, by their rows."""
        rows = iter(channels)

        def value(column: Column) -> Value:
            found = [ops.channel(next(rows), k) for k in range(column.rows(self.colours))]
            return self.colour(*found) if column.colour else found[0]

        return list(map(value, columns))

    def seen(self, w: Direction) -> SideView:
        """The side as light from a direction above sees it."""
        return self.given(w, self.at(w))

    def part(self, k: int) -> SidePart:
        """The reflected part of number k, of a side in NumPy."""
        shapes, alone = self.shapes[k : k + 1], replace(self, curves=None, transmission=None)
        if shapes:
            alone = replace(alone, polynomial=NOTHING, samples=NOTHING.samples, top=None)
        return SidePart(replace(alone, shapes=shapes), *self._only(self.declaration.part(k)))

    @property
    def through(self) -> SidePart:
        """The part that passes, of a side in NumPy."""
        alone = replace(self, curves=None, shapes=(), polynomial=NOTHING, samples=NOTHING.samples, top=None)
        return SidePart(alone, *self._only(self.declaration.through))

    def _only(self, chosen: Sequence[int]) -> tuple[tuple[Column, ...], Any]:
        """Columns of some numbers, and curves of them alone."""
        columns = self.declaration.columns
        rows = self.declaration.rows(chosen, self.colours)
        return tuple(columns[k] for k in chosen), self.curves.only(rows)

    def given(self, w: Direction, columns: Columns) -> SideView:
        """The view from a direction above, by the columns for it."""
        every = zip(self.shapes, columns.weights, columns.roughness)
        lobes = [shape.lobe(weight, self.kind(*numbers).roughness(ROOTS)) for shape, weight, numbers in every]
        # The axes of isotropic interfaces lie in the plane of incidence
        plane = ggx.plane(w) if self.kind is PerAxis else None
        samples = TopSamples(self.samples, self.top, columns.of_top) if self.top else self.samples
        return SideView(self.shapes, lobes, plane, self.polynomial, samples, self.transmission, columns, self.top)


@dataclass(frozen=True)
class SidePart:
    """One part of a `side` in NumPy, which reads no columns but its own."""

    side: Side
    columns: tuple[Column, ...]
    curves: Curves

    def seen(self, w: Direction) -> SideView:
        """The view from a direction above with this part alone; a reflected one is the first one."""
        side, found = self.side, self.side.values(self.columns, self.curves(w))
        if side.transmission:
            count = len(side.declaration.parts)
            columns = Columns([], [], [], [], 0.0, 0.0, 0.0, Parts(*found[:count]), None, wide_passed=found[count:])
            return side.given(w, side.narrowed(columns))
        weight, *others = found
        count = side.declaration.entries if side.shapes else 0
        roughness, beyond = others[:count], others[count:]
        of_top, beyond = (beyond[0], beyond[1:]) if side.top else (None, beyond)
        narrow, beyond = (beyond[0], beyond[1:]) if side.wide else (1.0, beyond)
        columns = Columns([weight], [tuple(roughness)], [], [], weight, 0.0, 0.0, None, None, of_top, narrow, beyond)
        return side.given(w, side.narrowed(columns))


@dataclass(frozen=True)
class SideView:
    """A side as light from one direction sees it: its parts are lobes, the remainder, and what passes.

    Lobes are turned from a plane whose azimuth has the cosine and the sine `plane`; None for that of the tangent.
    """

    shapes: tuple[Shape, ...]
    lobes: list[RefractedLobe]
    plane: tuple[Value, Value] | None
    polynomial: Remainder
    samples: RemainderSamples | TopSamples
    transmission: Transmission | None
    columns: Columns
    top: TopMedium | None

    def turned(self, w: Direction, by: Direction) -> Direction:
        """A direction as this side sees it; all light comes from above where nothing passes."""
        return upright(w, by) if self.transmission else w

    @property
    def interfaces(self) -> int:
        return 1 + max((shape.interface for shape in self.shapes), default=-1)

    @property
    def numbers(self) -> list[int]:
        """Components that reflected parts belong to."""
        return [*(shape.interface for shape in self.shapes), self.interfaces]

    @property
    def chances(self) -> list[Value]:
        """Sampling probabilities of the reflected parts."""
        return [*self.columns.chances, self.columns.chance]

    @property
    def energies(self) -> list[Value]:
        """Energies of the reflected parts."""
        return [*self.columns.energies, self.columns.rest]

    @property
    def passed(self) -> Value:
        return 0.0 if self.columns.passed is None else self.columns.passed

    def only(self, asked: Query) -> Selection:
        """Chances of what is asked for: as samples are shared among all parts, or by energy where some are not."""
        passes = self.columns.passes
        wanted = [asked.reflects(number) for number in self.numbers]
        if all(wanted) and (asked.transmission or passes is None):
            return Selection(wanted, True, self.chances, passes)
        shares = [ops.mean(e) + ENERGY_EPS if w else 0.0 for w, e in zip(wanted, self.energies)]
        through = ops.mean(self.passed) + ENERGY_EPS if passes and asked.transmission else 0.0
        total = sum(shares) + through
        if isinstance(total, float) and total == 0:
            return Selection(wanted, False, shares, None)
        if passes is not None:
            scale = ops.divide(through / total, passes.share)
            chances = (scale * x for x in (passes.of_straight, passes.of_bounced, passes.of_rest))
            passes = replace(passes, **dict(zip(("of_straight", "of_bounced", "of_rest"), chances)))
        return Selection(wanted, asked.transmission, [share / total for share in shares], passes)

    def part(self, k: int, i: Direction, o: Direction) -> tuple[Value, Value]:
        """f |cos theta_o| and density of a reflected part."""
        if k < len(self.lobes):
            return refracted_lobe.eval_pdf(self.lobes[k], self._along_plane(i), self._in_plane(o))
        top = self.top
        rest = self.polynomial.value(i, o) if top is None else top_medium.value(self.polynomial, top, i, o)
        rest = self.columns.scale * rest
        if self.columns.wide_reflected:
            energy, *numbers = self.columns.wide_reflected
            rest = rest + wide.value(energy, numbers, i, o)
        return rest, self.samples.density(i, o)

    def through(self, i: Direction, o: Direction, whole: bool = False) -> tuple[Value, Value]:
        """f |cos theta_o| and density of what passes, with the `whole` of what lobes have of light that goes straight
        through, or its weight."""
        passes = self.columns.passes
        assert self.transmission and passes
        passes = replace(passes, straight=passes.faceted * (1.0 if whole else passes.straight))
        found, density = combined.eval_pdf(self.transmission, passes, i, o)
        if self.columns.wide_passed:
            energy, *numbers = self.columns.wide_passed
            found = found + combined.wide_value(self.transmission, energy, numbers, i, o)
        return found, density

    def out_of(self, lobe: RefractedLobe, i: Direction, u1: Value, u2: Value) -> Direction:
        """A direction drawn from a lobe."""
        o = refracted_lobe.sample(lobe, self._along_plane(i), u1, u2)
        return ggx.turned(o, self.plane[0], -self.plane[1]) if self.plane else o

    def _in_plane(self, w: Direction) -> Direction:
        return ggx.turned(w, *self.plane) if self.plane else w

    def _along_plane(self, i: Direction) -> Direction:
        """The direction that the plane is of."""
        x, y, z = self._in_plane(i)
        return x, 0.0 if self.plane else y, z


@dataclass(frozen=True)
class Selection:
    """Parts that are asked for: whether each one that is reflected is, and what passes; their chances."""

    wanted: list[bool]
    passing: bool
    chances: list[Value]
    passes: Parts | None

    @property
    def share(self) -> Value:
        """Share of samples that are drawn from what passes."""
        return self.passes.share if self.passes else 0.0

    @property
    def all(self) -> bool:
        """Whether all parts are asked for."""
        return all(self.wanted) and self.passing


@dataclass(frozen=True)
class Solved:
    """A material as a BSDF: a uniform one, or one with the values of a point; `known` is what light sees from the only
    direction that is asked for, None for any."""

    above: Side
    below: Side | None
    eta: Value
    symmetric: bool
    known: tuple[SideView, Value] | None = None

    diffuse = True  # the remainder comes after the lobes

    @property
    def balanced(self) -> bool:
        return self.symmetric

    def at_direction(self, wi: Direction) -> Solved:
        return replace(self, known=self.seen(wi))

    def seen(self, wi: Direction) -> tuple[SideView, Value]:
        """The view from wi, turned up; the index of the medium beyond over that on its own side."""
        if self.known:
            return self.known
        if self.below is None:
            return self.above.seen(wi), 1.0
        turned = upright(wi, wi)
        where = wi[2] > 0
        columns = self.above.either(self.below, where, turned)
        side = replace(
            self.above,
            shapes=tuple(_either(where, a, b) for a, b in zip(self.above.shapes, self.below.shapes)),
            polynomial=ops.select_record(where, self.above.polynomial, self.below.polynomial),
            samples=ops.select_record(where, self.above.samples, self.below.samples),
            top=ops.select_record(where, self.above.top, self.below.top),
            transmission=ops.select_record(where, self.above.transmission, self.below.transmission),
        )
        return side.given(turned, columns), ops.select(where, self.eta, 1 / self.eta)

    def albedo(self, wi: Direction, asked: Query = ALL) -> Value:
        """Energy of the queried parts, a colour."""
        of, _ = self.seen(wi)
        reflected = sum(energy for number, energy in zip(of.numbers, of.energies) if asked.reflects(number))
        return reflected + of.passed if asked.transmission else reflected

    def eval_pdf(self, wi: Direction, wo: Direction, asked: Query = ALL) -> tuple[Value, Value]:
        """f(wi, wo) |cos theta_o|, a colour, and the density of `sample`."""
        of, eta = self.seen(wi)
        back = replace(self, known=None).seen(wo)[0] if self.symmetric else None
        return eval_pdf(of, back, eta, wi, wo, asked)

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value, asked: Query = ALL) -> tuple[Direction, Value]:
        """A direction wo, and the index on its side over that on the side of wi."""
        of, eta = self.seen(wi)
        i, drawn = of.turned(wi, wi), of.only(asked)
        begin = 1 - drawn.chances[-1]
        within, rest = u < begin, ops.divide(u - begin, drawn.chances[-1])
        wo = of.samples.sample(i, rest, u1, u2)
        if of.lobes:
            lobe = of.lobes[-1]
            for above, chance in zip(of.lobes[-2::-1], drawn.chances[-2:0:-1]):
                begin = begin - chance
                lobe = refracted_lobe.either(u < begin, above, lobe)
            wo = select_direction(within, of.out_of(lobe, i, u1, u2), wo)
        if of.transmission is None or drawn.passes is None:
            return wo, 1.0
        again = ops.clip(ops.divide(u, drawn.share), 0.0, BELOW_ONE)
        through = combined.sample(of.transmission, drawn.passes, i, again, u1, u2)
        wo = select_direction(u < drawn.share, through, (wo[0], wo[1], ops.maximum(wo[2], 0.0)))
        return upright(wo, wi), ops.select(wo[2] < 0, eta, 1.0)

    def component(self, wi: Direction, wo: Direction, u: Value, asked: Query = ALL) -> Value:
        """Number of the part that `sample` drew wo from: an interface from the top, the remainder, or last what passes.
        Light that does not pass the facets of a rough dielectric is reflected by the first one."""
        of, _ = self.seen(wi)
        drawn = of.only(asked)
        kept = [(number, chance) for number, chance, w in zip(of.numbers, drawn.chances, drawn.wanted) if w]
        last = float(of.interfaces + 1)
        if not kept:
            return last
        found: Value = float(kept[0][0])
        begin = drawn.share
        for (_, chance), (following, _) in pairwise(kept):
            begin = begin + chance
            found = ops.select(u > begin, float(following), found)
        if self.below is None:
            return found
        return ops.select(wi[2] * wo[2] < 0, last, found) if drawn.passing else found


def eval_pdf(
    of: SideView, back: SideView | None, eta: Value, wi: Direction, wo: Direction, asked: Query
) -> tuple[Value, Value]:
    """The value and density of `Solved`; `back` is the side of wo, as seen from there, in the symmetric form."""
    i, o, drawn = of.turned(wi, wi), of.turned(wo, wi), of.only(asked)
    i_back, o_back = of.turned(wi, wo), of.turned(wo, wo)
    cosines = ops.absolute(wo[2]) / ops.maximum(ops.absolute(wi[2]), COS_OF_DIRECTIONS_MIN)
    value: Value = 0.0
    whole: Value = 0.0
    densities: list[Value] = [0.0, 0.0, 0.0]  # of what is asked for; of all, there and back
    for k, (wanted, chance) in enumerate(zip(drawn.wanted, drawn.chances)):
        part, pdf = of.part(k, i, o)
        chances = [chance, of.chances[k], 0.0]
        pdfs = [pdf, pdf, 0.0]
        if back:
            other, pdfs[2] = back.part(k, o_back, i_back)
            chances[2] = back.chances[k]
            part = ops.sqrt(part * other * cosines)
        densities = [total + c * each for total, c, each in zip(densities, chances, pdfs)]
        whole = whole + part
        value = value + (part if wanted else 0 * part)
    columns = of.columns
    if of.transmission and columns.passes:
        through, pdf = of.through(i, o)
        returned: Value = 0.0
        if back and back.transmission and back.columns.passes:
            through, pdf, returned = exchanged(of, back, eta, wi, wo)
            through = through * ops.sqrt(columns.passes.straight * back.columns.passes.straight)
        share = ops.divide(drawn.share, columns.passes.share)
        densities = [a + b for a, b in zip(densities, (share * pdf, pdf, returned))]
        whole = whole + through
        value = value + (through if drawn.passing else 0 * through)
    scale = ops.select(wi[2] * wo[2] < 0, eta * eta, 1.0)
    # No sample is too heavy, there and, in the symmetric form, back
    most = ops.minimum(densities[1], densities[2] * cosines * scale) if back else densities[1]
    kept = ops.clip(whole, 0.0, MAX_SAMPLE_WEIGHT * most)
    value = kept if drawn.all else ops.maximum(value, 0.0) * ops.divide(kept, whole)
    if of.transmission is None:
        lit = wi[2] > 0
        return ops.select(lit, value, 0.0), ops.select(lit, densities[0], 0.0)
    return value / scale if asked.radiance else value, densities[0]


def exchanged(of: SideView, back: SideView, eta: Value, wi: Direction, wo: Direction) -> tuple[Value, Value, Value]:
    """Mean of what passes there and back, with all that goes straight through, and the densities there and back."""
    i, o, i_back, o_back = upright(wi, wi), upright(wo, wi), upright(wi, wo), upright(wo, wo)
    there, density = of.through(i, o, True)
    other, returned = back.through(o_back, i_back, True)
    cosines = ops.absolute(wo[2]) / ops.maximum(ops.absolute(wi[2]), COS_OF_DIRECTIONS_MIN)
    return 0.5 * (there + other * (cosines * eta * eta)), density, returned


def _either(where: Value, a: Shape, b: Shape) -> Shape:
    """The shape a where a condition holds, else b."""
    assert a.facets and b.facets
    facets = _of_either(where, a.facets, b.facets)
    if a.first is None and b.first is None:
        return Shape(a.interface, ops.select_record(where, a.n, b.n), facets, a.n_first, None)
    first = _of_either(where, a.first, b.first)
    n, n_first = ops.select_record(where, a.n, b.n), ops.select_record(where, a.n_first, b.n_first)
    ends = [0.0 if each.steeper is None else each.steeper for each in (a, b)]
    steeper = None if a.steeper is b.steeper is None else ops.select(where, *ends)
    return Shape(a.interface, n, facets, n_first, first, steeper)


def _of_either(where: Value, a: SmoothInterface | None, b: SmoothInterface | None) -> SmoothInterface:
    """The indices of either interface; None for one without a step."""
    some = a or b
    assert some
    eta, n12 = (
        ops.select(where, getattr(a, name) if a else 1.0, getattr(b, name) if b else 1.0) for name in ("eta", "n12")
    )
    return replace(some, eta=eta, n12=n12, films=ops.select_record(where, *(x.films if x else None for x in (a, b))))
