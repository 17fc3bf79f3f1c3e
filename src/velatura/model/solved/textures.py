"""Materials whose values come from textures: solved for some of those values, and interpolated between.

Each texture is an axis. Columns over direction are solved at all nodes of three axes together (two where wavelength is
one of them), splines refine them, and a renderer interpolates linearly; so do gradients. Of further textures every pair
has a table, of what it changes beyond those before, with all others at their middle: it scales columns that are nowhere
negative, and adds to others. Where interfaces are brushed each texture has a table of its own. A texture of the
rotation that all brushed interfaces share is no axis: materials are turned back to the first one's.

Of a texture of colours, each channel has its own coordinate, and solves are of grey values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, product
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.films import textured as textured_films
from velatura.model.base import Body, Model
from velatura.model.context import Context, at_a_point
from velatura.model.rotation_frame import Frame
from velatura.model.solved import solve, texture_axes, wide_light
from velatura.model.solved.bsdf import Side, Solved
from velatura.model.solved.columns import Columns
from velatura.model.solved.guards import ENERGY_EPS
from velatura.model.solved.lobes import remainder, top_medium
from velatura.model.solved.solve import Layout, SolvedSide, Solver
from velatura.model.solved.texture_axes import BESIDE, COARSE, WAVES_MAX, WAVES_OF_TWO, Range, TextureAxis, Wavelengths
from velatura.model.solved.transmission.combined import Parts
from velatura.model.variance import Isotropic, Variance
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import directional_grid, finite_differences
from velatura.renderer.differentiated import Variables
from velatura.renderer.directional_grid import Packed, Packing, Summed
from velatura.renderer.packets import WIDTH
from velatura.stack import Address, InterfaceValues, Material

Array = NDArray[np.floating]

COSINES = {True: 24, False: 16}  # at which isotropic materials are solved, and others
SAMPLES = 377  # for the factors of the symmetric form, at each direction
SHAPES = {True: (96,), False: (48, 33)}  # places over direction
FAINTEST = 1e-4  # columns that are scaled from less than that are scaled by less
MOST = 8.0  # times
DARK = 0.003  # energies by which weights of lobes are smoothed, where there are films
TOGETHER = 3  # axes of one table at most
OF_PASSED = 0.05  # share of what passes by which each part of it is sampled at least, where terms are summed


class Textured(Protocol):
    """A material with textures; bodies at all points are `balanced`, or none is."""

    @property
    def balanced(self) -> bool: ...

    def at(self, material: Material, place: Value = None) -> Body:
        """The body with the values of a point; `place` is that on the spectrum."""


@dataclass(frozen=True)
class Same:
    """A body whose textures are the same everywhere."""

    body: Body

    @property
    def balanced(self) -> bool:
        return self.body.balanced

    def at(self, material: Material, place: Value = None) -> Body:
        return self.body


@dataclass(frozen=True)
class Turning:
    """A material that was turned back to a frame."""

    straight: Textured
    frame: Frame

    @property
    def balanced(self) -> bool:
        return self.straight.balanced

    def at(self, material: Material, place: Value = None) -> Body:
        return self.frame.turned(self.straight.at(self.frame.back(material), place), material)


@dataclass(frozen=True)
class Term:
    """Change by some axes: tables over direction and them, for either side, and of the remainder over them. The first
    term has the columns themselves, a further one by what it scales those of the first, or `adds` to them."""

    axes: tuple[TextureAxis | Wavelengths, ...]
    columns: tuple[Packed, ...]
    polynomials: tuple[Packed | Summed, ...]

    def places(self, material: Material, place: Value) -> list[Value]:
        return [axis.at(material) if isinstance(axis, TextureAxis) else place for axis in self.axes]


@dataclass(frozen=True)
class TextureTables:
    """A material by some terms, of which further ones scale or add; `fixed` are the values that it was solved for,
    beside those of textures."""

    axes: tuple[TextureAxis | Wavelengths, ...]
    terms: tuple[Term, ...]
    adds: tuple[Array, ...]
    layouts: list[Layout]
    solver: Solver
    context: Context
    fixed: bytes

    @property
    def balanced(self) -> bool:
        return self.solver.model.form == "symmetric"

    def at(self, material: Material, place: Value = None) -> Solved:
        material = material.solid()
        places, made = [term.places(material, place) for term in self.terms], []
        for k, (seen, layout) in enumerate(zip(solve.sides(material), self.layouts)):
            curves = partial(_together, [term.columns[k] for term in self.terms], places, self.adds[k])
            found = [term.polynomials[k].at(*at) for term, at in zip(self.terms, places)]
            numbers = [sum(each[1:], each[0]) for each in zip(*found)]
            colours = solve.coloured(numbers, self.solver, self.context)
            side = self.solver.side(seen, layout, curves, colours, self.context)
            made.append(_Interpolated(**vars(side), summed=len(self.terms) > 1))
        return self.solver.bsdf(material, made)

    def holds(self, solver: Solver, wanted: Sequence[TextureAxis | Wavelengths], fixed: bytes) -> bool:
        """Whether it is what would be solved, for values of textures in these ranges."""
        covered = len(self.axes) == len(wanted) and all(a.covers(b) for a, b in zip(self.axes, wanted))
        return covered and fixed == self.fixed and solver.variance is self.solver.variance


@dataclass(frozen=True)
class _Interpolated(Side):
    """A side whose columns are interpolated, and may miss their bounds by little; sums of several terms by more."""

    summed: bool = False

    def read(self, w: Direction) -> Columns:
        return _bounded(super().read(w), self.summed)


def _bounded(found: Columns, summed: bool) -> Columns:
    """Columns without negative weights and chances; chances that are summed up belong to energies."""
    *chances, chance = (ops.maximum(x, 0.0) for x in (*found.chances, found.chance))
    chance = chance + ENERGY_EPS
    passes: list[Value] = []
    of = found.passes
    if of:
        passes = [ops.maximum(getattr(of, name), 0.0) for name in Parts.CHANCES]
    if summed:
        energies = [0.5 * ops.maximum(ops.mean(x), 0.0) for x in (*found.energies, found.rest)]
        *chances, chance = (ops.maximum(a, b) for a, b in zip((*chances, chance), energies))
        passes = [ops.maximum(x, OF_PASSED * ops.maximum(ops.mean(found.passed), 0.0)) for x in passes]
    total = sum(chances) + chance + sum(passes)
    if of:
        weights = {name: ops.maximum(getattr(of, name), 0.0) for name in Parts.COLOURS}
        of = replace(of, **weights, **dict(zip(Parts.CHANCES, (x / total for x in passes))))
        if found.wide_passed:
            crowded = ops.clip(of.forward, 0.0, wide_light.CROWDED_MOST)
            kept = {name: ops.clip(getattr(of, name), 0.0, 1.0) for name in ("narrow", "faceted")}
            of = replace(of, forward=crowded, **kept)
    return replace(
        found,
        weights=[ops.maximum(x, 0.0) for x in found.weights],
        scale=ops.maximum(found.scale, 0.0),
        chances=[x / total for x in chances],
        chance=chance / total,
        passes=of,
        of_top=None if found.of_top is None else ops.clip(found.of_top, 0.0, top_medium.MOST),
        narrow=ops.clip(found.narrow, 0.0, 1.0),
    )


def _together(curves: Sequence[Packed], places: Sequence[Sequence[Value]], adds: Array, w: Direction) -> list[Value]:
    """The columns of all terms, for a direction."""
    first, *others = (each(w, *at) for each, at in zip(curves, places))
    for found in others:
        first = [a + b if add else a * b for a, b, add in zip(first, found, adds)]
    return first


def textured(
    material: Material,
    ranges: Sequence[Range | Wavelengths],
    symbolic: Material,
    model: Model,
    variance: type[Variance],
    context: Context,
    before: Textured | None = None,
) -> Textured:
    """A material of a renderer's constants with textures, whose values in `material` may be any.

    `symbolic` is the same material with values that may be compared. `before`, of the same material, is returned where
    it has all that is needed.
    """
    names = {address.name for given in _textures(ranges) for address in given[0]}
    frame = Frame.of(symbolic, names)
    if frame.layer is None:
        return _tabulated(material, ranges, model, variance, context, before)
    inner = before.straight if isinstance(before, Turning) and before.frame == frame else None
    others = [given for given in ranges if isinstance(given, Wavelengths) or given[0][0].key != "rotation"]
    straight = _tabulated(frame.back(material), others, model, frame.kind(variance), context, inner)
    return before if straight is inner and before else Turning(straight, frame)


def _tabulated(
    material: Material,
    ranges: Sequence[Range | Wavelengths],
    model: Model,
    variance: type[Variance],
    context: Context,
    before: Textured | None,
) -> Textured:
    if not ranges:
        return Same(solve.solve(material, model, variance, context))
    isotropic = variance is Isotropic
    spectral = any(isinstance(x, Wavelengths) for x in ranges)
    # Waves are resolved by the first table, in which wavelengths come first
    order = {
        id(x): 0 if isinstance(x, Wavelengths) else 1 if x[0][0].role in texture_axes.WAVING else 2 for x in ranges
    }
    ranges, films = sorted(ranges, key=lambda x: order[id(x)]), [*order.values()].count(1)
    together = min(len(ranges), TOGETHER if isotropic and not spectral and not films else 2)
    material = material.solid()
    numbers = solve.plain(material)
    spans = [textured_films.Span(at, *ends) for of, *ends in _textures(ranges) for at in of]
    step = partial(_step, textured_films.highest(numbers, spans))
    waves_max = WAVES_MAX[together] if films == 1 else WAVES_OF_TWO
    spanned = [
        x if isinstance(x, Wavelengths) else TextureAxis.of(x, together, step(x[0][0]), waves_max) for x in ranges
    ]
    start = texture_axes.placed(numbers, spanned, [axis.middle for axis in spanned])
    solver = Solver.of(model, variance, context)
    grid = replace(solver.grid, cosines=COSINES[isotropic])
    solver = replace(solver, grid=grid, shape=SHAPES[isotropic], samples=SAMPLES)
    textures = {name for axis in spanned for name in axis.changed(axis.middle)}
    fixed = b"".join(np.asarray(x).tobytes() for address, x in start.values() if address.name not in textures)
    fixed += bytes(map(bool, start.measured))
    given = Variables.of(material)
    if isinstance(before, TextureTables) and not given.given and before.holds(solver, spanned, fixed):
        return before
    groups = _groups(spanned, together if isotropic else 1)
    ends = product(*((axis.values[0], axis.values[-1]) for axis in spanned))
    extremes = [start, *(texture_axes.placed(start, spanned, values) for values in ends)]
    layouts = solver.layouts([*extremes, *given.ends(start)])
    solver = solver.own(extremes, layouts)

    reads: list[list[int]] = []

    def solved(made: Material, group: Sequence[TextureAxis | Wavelengths]) -> list[tuple[Array, Array]]:
        """Columns and numbers of each side, (nodes, ...)."""
        nodes = [texture_axes.placed(made, group, values) for values in product(*(axis.values for axis in group))]
        wavelengths = next((axis.count for axis in group if isinstance(axis, Wavelengths)), 0)
        of_group = replace(solver, colours=wavelengths or solver.colours)
        solves: list[list[tuple[list[Array], list[Array]]]] = []
        for done, node in enumerate(nodes):
            context.progress(done, len(nodes))
            sides = of_group.solve(node, layouts)
            sides = [_smoothed(side) for side in sides] if any(material.films) else sides
            solves.append([_of_channels(of_group, side, solver.colours, wavelengths) for side in sides])
            if not reads:
                reads.extend(side.declaration.groups(solver.colours) for side in sides)
        context.progress(len(nodes), len(nodes))
        by_side = ([np.array(x) for x in zip(*side)] for side in zip(*solves))
        # Wavelengths are the leading axis of a group
        return [(_leading(columns), _leading(numbers)) for columns, numbers in by_side]

    adds: list[Array] = []
    packings: dict[tuple[int, int], tuple[Packing, ...]] = {}  # of columns and polynomials, by group and side
    few: dict[tuple[int, int], Array] = {}  # polynomials that others are sums of

    def tables(numbers: list[float]) -> list[Array]:
        made, found = given.replaced(start, numbers), []
        by_group = [solved(made, group) for group, _ in groups]
        if not adds:
            every = zip(*by_group)
            adds.extend(np.min([x.min(axis=(0, 2)) for x, _ in of_side], axis=0) < 0 for of_side in every)
        for k, ((group, known), of_group) in enumerate(zip(groups, by_group)):
            for side, ((columns, polynomials), add) in enumerate(zip(of_group, adds)):
                if k:
                    by = _beyond(np.log(np.maximum(columns, 0) + FAINTEST), group, known)
                    scaled = np.exp(np.minimum(by, np.log(MOST)))
                    columns = np.where(add[:, None], _beyond(columns, group, known), scaled)
                    polynomials = _beyond(polynomials, group, known)
                # Of two sides, sums take more of a step of an optimisation than fetches do; those of media on top have
                # other functions
                alone = not given.given and len(layouts) == 1 and not layouts[0].apart
                if summed := _of_few(polynomials) if alone else None:
                    polynomials, few[k, side] = summed
                if (k, side) not in packings:
                    packings[k, side] = tuple(
                        Packing.of(values.swapaxes(0, 1), each, shared=not given.given)
                        for values, each in ((columns, reads[side]), (polynomials, [0] * polynomials.shape[1]))
                    )
                packing, of_polynomial = packings[k, side]
                found += [_flat(x, group) for x in packing.split(columns, 1)]
                found += [_flat(x, group) for x in of_polynomial.split(polynomials, 1)]
        return found

    def constants(rows: Array) -> list[list[Value]]:
        values = context.settle(finite_differences.numbers(rows.ravel(), context.number))
        return [values[k : k + rows.shape[1]] for k in range(0, rows.size, rows.shape[1])]

    flat = iter(finite_differences.differentiable(tables, given.given, given.around, context.number))
    terms = []
    for k, (group, _) in enumerate(groups):
        places = tuple(axis.places for axis in group)
        made = [
            packing.curves(
                directional_grid.interleaved(next(flat), (*directions, *places), context.number) for _ in packing.tables
            )
            for side in range(len(layouts))
            for packing, directions in zip(packings[k, side], (solver.shape, ()))
        ]
        polynomials = [
            Summed(curves, constants(few[k, side])) if (k, side) in few else curves
            for side, curves in enumerate(made[1::2])
        ]
        terms.append(Term(group, tuple(made[::2]), tuple(polynomials)))
    point = replace(at_a_point(), colour=context.colour, tables=context.tables)
    return TextureTables(tuple(spanned), tuple(terms), tuple(adds), layouts, solver, point, fixed)


def _textures(ranges: Sequence[Range | Wavelengths]) -> list[Range]:
    return [given for given in ranges if not isinstance(given, Wavelengths)]


def _step(highest: Material, address: Address) -> float | None:
    """Step between nodes of an axis of waves, by the greatest values of textures; None of others."""
    if address.role not in texture_axes.WAVING or address.layer is None:
        return None
    layer = highest.layers[address.layer]
    assert isinstance(layer, InterfaceValues)
    return textured_films.step(address, layer)


Group = tuple[TextureAxis | Wavelengths, ...]


def _of_few(polynomials: Array) -> tuple[Array, Array] | None:
    """Polynomials (nodes, 8 C) as sums of few, where that spares a fetch."""
    alike = len(np.unique(polynomials.astype(np.float32), axis=1).T) <= WIDTH
    return None if alike else remainder.of_few(polynomials, WIDTH)


def _groups(spanned: Sequence[TextureAxis | Wavelengths], together: int) -> list[tuple[Group, Sequence[int]]]:
    """The axes of all tables, some together in the first one, and those at whose middle others have the columns."""
    groups: list[tuple[Group, Sequence[int]]] = [(tuple(spanned[:together]), ())]
    others = [axis.with_middle(BESIDE) for axis in spanned[together:]]
    if together == 1:
        return [*groups, *(((axis,), (0,)) for axis in others)]
    first, *coarse = (axis.with_middle(COARSE) for axis in spanned)
    groups += [((first, axis), (1,)) for axis in others]
    pairs = [(coarse[i], coarse[k]) for i, k in combinations(range(len(coarse)), 2) if k + 1 >= together]
    return [*groups, *((pair, (0, 1)) for pair in pairs)]


def _beyond(values: Array, group: Group, known: Sequence[int]) -> Array:
    """Values at the nodes of a group, (nodes, ...), less those at the middle of the axes of these numbers."""
    found = values.reshape(*(axis.count for axis in group), *values.shape[1:])
    for k in known:
        found = found - found.take([group[k].middle_node], k)
    return found.reshape(values.shape)


def _smoothed(side: SolvedSide) -> SolvedSide:
    """A side whose weights of lobes tend to 1 where facets reflect less than `DARK`: films make that happen at single
    nodes, where weights are quotients of small numbers, and splines would carry them to others."""
    columns = side.columns
    weights = [
        w * (energy + DARK) / (energy + DARK * np.maximum(w, ENERGY_EPS))
        for w, energy in zip(columns.weights, columns.energies)
    ]
    return replace(side, columns=replace(columns, weights=weights))


def _of_channels(solver: Solver, side: SolvedSide, colours: int, wavelengths: int) -> tuple[list[Array], list[Array]]:
    """The columns and numbers of a side, for all wavelengths or, where it was solved for none, once; a colour of one
    wavelength has it in all channels."""
    rows, numbers = solver.spread(side), side.numbers
    if not wavelengths:
        return [rows], [numbers]
    counts = [column.rows(solver.colours) for column in side.declaration.columns]
    parts = np.split(rows, np.cumsum(counts)[:-1])
    columns = [np.concatenate([x if len(x) == 1 else x[[k] * colours] for x in parts]) for k in range(wavelengths)]
    return columns, [np.repeat(numbers.reshape(-1, wavelengths)[:, k], colours) for k in range(wavelengths)]


def _leading(values: Array) -> Array:
    """Values (nodes, wavelengths, ...) with the wavelengths first, in one."""
    return values.swapaxes(0, 1).reshape(-1, *values.shape[2:])


def _flat(values: Array, group: Sequence[TextureAxis | Wavelengths]) -> Array:
    """Values (nodes, channels, directions) or (nodes, channels), at all places, and interleaved: flat, with the nodes
    of directions first and channels last."""
    fine = texture_axes.refined(values, group)
    count = len(group)
    return np.transpose(fine, (*range(count + 1, fine.ndim), *range(count + 1))).ravel()
