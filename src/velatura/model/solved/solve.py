"""A material, solved once for all directions: what `velatura.model.solved.bsdf` reads."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence, Set
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.media import of_material
from velatura.model.base import Model
from velatura.model.context import Context, channels
from velatura.model.smooth_interface import smooth_interfaces
from velatura.model.solved import reciprocal_balance, sample_allocation, wide_light
from velatura.model.solved.bsdf import ROOTS, Shape, Side, SideView, Solved
from velatura.model.solved.columns import Columns, Declaration
from velatura.model.solved.energies import brushing
from velatura.model.solved.energies.adding import Part, interfaces, parts
from velatura.model.solved.energies.energies import INCIDENCES, MODES, SAMPLES, Energies, energies, media_of
from velatura.model.solved.energies.media import Slab, escaped
from velatura.model.solved.energies.modes import Relative
from velatura.model.solved.energies.nodes import CLOSE, Nodes
from velatura.model.solved.grid import Folded, Grid, Listed
from velatura.model.solved.guards import ALBEDO_MIN, COS_ON_GRID_MIN, ENERGY_EPS, WIDTH_ALPHA_MAX
from velatura.model.solved.lobes import refracted_lobe, remainder, top_medium, wide, widths
from velatura.model.solved.lobes.refracted_lobe import MediumIndex
from velatura.model.solved.lobes.remainder import EVEN, Remainder, RemainderSamples
from velatura.model.solved.lobes.top_medium import ORDERS, Medium, PassedMedium, ScatteredThrough, TopMedium, TopSamples
from velatura.model.solved.lobes.widths import Tensor
from velatura.model.solved.sample_allocation import Demand
from velatura.model.solved.transmission import combined, direct, internal_reflections
from velatura.model.solved.transmission.combined import Parts
from velatura.model.solved.transmission.direct import Transmission
from velatura.model.solved.transmission.internal_reflections import Rest
from velatura.model.variance import Covariance, Isotropic, PerAxis, Roughness, Variance, is_same
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.optics.phase import HenyeyGreenstein, PhaseFunction
from velatura.renderer import compiled, directional_grid, finite_differences, low_discrepancy
from velatura.renderer.differentiated import RELATIVE, Variables
from velatura.renderer.differentiated import plain as plain
from velatura.renderer.directional_grid import Packing
from velatura.stack import InterfaceValues, Material, SlabValues
from velatura.tables import Tables

Array = NDArray[np.floating]

RGB = 3
NORMALS = {True: 1597, False: 987}  # over which lobes are integrated, of isotropic materials and of others
FINELY = 1597, 4181  # facets, and as NORMALS, for differences, whose error is that of values over a step
BETWEEN = {True: 144, False: 89}  # as NORMALS, for each place of a renderer's grid
NARROW = 0.05  # roughness of lobes whose integrals have edges between directions, as those of interfaces do
SLANTED = np.concatenate([[0.12], INCIDENCES])
EVENLY = 377  # directions over which the remainder is integrated, and for each phase function of a medium on top
BRIGHTEST = 4.0  # by how much it is scaled at most
LITTLE = 0.05  # by which energies are scaled for their colour
BRIGHTER = 1.5  # at most, where it takes light of lobes
VEILS = 1e-3, 1e-2  # optical depth of what media scatter by little, from which veils are drawn, and from which whole
MIN_DEFENSIVE_SHARE = 0.2  # of samples of the symmetric form, that the remainder and the rest of what passes have


@dataclass(frozen=True)
class LobeSpec:
    """A lobe: the number of its interface from the top, that of the one that shapes its light on the way out, None
    where none does, whether it is the veil of one, or the tail of one below crossed facets, whether its medium is
    nowhere of a lower index than outside, and whether its light has an edge: for want of that, where what lets it out
    passes light of any momentum in the medium, or nearly, where the indices are about the same.
    """

    interface: int
    first: int | None
    veil: bool
    tail: bool
    denser: bool
    edged: bool


@dataclass(frozen=True)
class Layout:
    """The lobes of a side, the interfaces that make a step of the index, the last one whose facets turn light, the
    slabs that scatter, by the number of interfaces above, and the indices of media that nodes are chosen for; the place
    of a medium that scatters below no step of the index, None without one, whether either side has such a one, and
    whether it is alone."""

    lobes: list[LobeSpec]
    stepped: list[int]
    rough: int | None
    cloudy: list[int]
    indices: list[float]
    top: int | None
    apart: bool
    alone: bool


@dataclass(frozen=True)
class SolvedSide:
    """A side of a material in NumPy: columns (C, M) and (M,) over the directions of a grid; numbers of the remainder,
    (C,), and the albedo that it gains by being clipped at 0, (C, cosines); the shape of each lobe whose integral
    has an edge between directions, else None; what passes, in a material that is drawn forward, else None; and of a
    medium on top, shares of its wider phase functions, (K, C), with numbers and shares of what it passes alone."""

    columns: Columns
    polynomial: Remainder
    clipped: Array
    edged: Sequence[Shape | None]
    transmission: Transmission | None = None
    top: Sequence[Array] = ()

    @cached_property
    def rows(self) -> Array:
        """All columns, (rows, M), in the order of their declaration."""
        return np.concatenate([np.atleast_2d(each) for each in self.columns.all])

    @property
    def declaration(self) -> Declaration:
        return self.columns.declaration

    @property
    def numbers(self) -> Array:
        """Those of the remainder, (8 C,), and after them those of a medium on top."""
        return np.concatenate([*vars(self.polynomial).values(), *self.top])

    def weighed(self, factors: Sequence[Array], wanted: Demand | None) -> SolvedSide:
        """The side with weights of reflected parts, and of what passes, scaled by factors (C, M), and samples shared
        anew as `wanted`, None where light passes."""
        columns = self.columns
        weights = [factor * weight for factor, weight in zip(factors, columns.weights)]
        rest = factors[len(weights)]
        beyond = [*(rest * energy for energy in columns.wide_reflected[:1]), *columns.wide_reflected[1:]]
        columns = replace(columns, weights=weights, scale=rest * columns.scale, wide_reflected=beyond)
        if columns.passes:
            columns = replace(columns, passes=replace(columns.passes, straight=factors[-1]))
        if wanted:
            *chances, chance = sample_allocation.shared(_evened(wanted))
            columns = replace(columns, chances=chances, chance=chance)
        return replace(self, columns=columns)


@dataclass(frozen=True)
class Lit:
    """A side, and its columns for a list of directions wi, (M,) each."""

    side: Side
    columns: Columns
    wi: Direction

    def body(self, which: NDArray[np.integer]) -> Solved:
        """The side as a BSDF for light from the directions of numbers `which` alone."""
        return Solved(self.side, None, 1.0, False, (self.view(which)[0], 1.0))

    def view(self, which: NDArray[np.integer]) -> tuple[SideView, Direction]:
        """The view from the directions of numbers `which`, and these."""

        def taken(value: Any) -> Any:
            if isinstance(value, (list, tuple)):
                return type(value)(map(taken, value))
            if isinstance(value, Parts):
                return Parts(*map(taken, vars(value).values()))
            return value if np.ndim(value) == 0 else value[..., which]

        columns = Columns(*map(taken, vars(self.columns).values()))
        x, y, z = map(taken, self.wi)
        return self.side.given((x, y, z), self.side.narrowed(columns)), (x, y, z)


class _Lobe(NamedTuple):
    """A lobe that is drawn, and its width at the directions of a grid, with its share of the light of such lobes."""

    shape: Shape
    tensor: Tensor
    share: Array


@dataclass(frozen=True)
class _Diffuse:
    """Diffuse light, over all directions: a polynomial of numbers (C, 1), and beside it what a medium scatters, with
    the share of samples that it has at cosines (K,); None without one."""

    polynomial: Remainder
    medium: TopMedium | None = None
    chance: Any = None

    @classmethod
    def fitted(
        cls,
        nodes: Nodes,
        incidences: Array,
        light: Array,
        albedos: Array,
        medium: TopMedium | None = None,
        scattered: Sequence[Array] = (),
        cosines: Any = None,
    ) -> _Diffuse:
        """Fit to light (C, modes, N, I) from cosines `incidences`, of a material of these albedos (C, I). What the
        medium has `scattered` once is known, and so is light of its wider phase functions, whose shares are fitted."""
        own, *others = scattered or (0.0,)
        others = [np.broadcast_to(each, light.shape) for each in others]
        numbers, shares = remainder.fit(nodes, light - own, incidences, albedos, others)
        polynomial = Remainder(*(x[:, None] for x in vars(numbers).values()))
        if medium is None:
            return cls(polynomial)
        energy = _energy(own + sum(share[:, None, None, None] * each for share, each in zip(shares, others)))
        chance = top_medium.chances(incidences, energy, _energy(light), cosines)
        return cls(polynomial, replace(medium, shares=tuple(shares[..., None])), chance)

    @property
    def numbers(self) -> list[Array]:
        """Those of the polynomial, and shares of the medium."""
        return [*vars(self.polynomial).values(), *(self.medium.shares if self.medium else ())]


class _Weighed(NamedTuple):
    """The energy of a lobe, that over its integral, and how it is to be sampled."""

    energy: Array
    weight: Array
    wanted: Demand


@dataclass(frozen=True)
class Solver:
    """How materials of NumPy's values are solved for the directions of a grid, in a number of colours.

    `shape` is that of the grid on which a renderer has the columns. `samples` are those of `reciprocal_balance`;
    `normals` are those of facets, and of lobes that are integrated, None for as many as usual, or as are asked for by
    `finely`. A medium on top scatters by `phase_of` its values. Light that is too `wide` for lobes has a shape of its
    own.
    """

    model: Model
    variance: type[Variance]
    grid: Grid
    shape: tuple[int, ...]
    colours: int
    tables: Tables
    samples: int | None = None
    normals: int | None = None
    finely: bool = False
    phase_of: Callable[[SlabValues], PhaseFunction] = of_material.phase_of
    wide: bool = False

    @classmethod
    def of(cls, model: Model, variance: type[Variance], context: Context, material: Material | None = None) -> Solver:
        """The solver of a material of numbers, or None for those of tables."""
        assert context.colour is not None
        colours = RGB if context.colour is channels else len(context.colour())
        return cls.over(colours, model, variance, context, material)

    @classmethod
    def over(
        cls,
        colours: int,
        model: Model,
        variance: type[Variance],
        context: Context,
        material: Material | None = None,
    ) -> Solver:
        """Like `of`, for another channel count than the renderer's."""
        isotropic = variance is Isotropic
        shape = directional_grid.LINE if isotropic else directional_grid.PLANE
        grid = Grid.of(isotropic, material)
        if isotropic and model.form == "symmetric" and material and not material.transmits:
            # Factors bend where all light from outside is reflected
            grid = replace(grid, cosines=grid.cosines * (1 + _reflects_all(parts(material))))
        return cls(model, variance, grid, shape, colours, context.tables)

    @property
    def isotropic(self) -> bool:
        return self.variance is Isotropic

    @property
    def kind(self) -> type[Variance]:
        """Kind of the lobes' variance; lobes of isotropic interfaces have axes in the plane of incidence."""
        return PerAxis if self.isotropic else Covariance

    def layouts(self, materials: Sequence[Material]) -> list[Layout]:
        """Layouts of each side, valid for all `materials`."""
        veiled: set[int] = set()
        for material in materials:
            veiled = veiled.union(*map(_veils, sides(material)))
        found = [layout_of(seen, veiled) for seen in zip(*map(sides, materials))]
        return [replace(layout, apart=any(each.apart for each in found)) for layout in found]

    def solve(self, material: Material, layouts: Sequence[Layout]) -> list[SolvedSide]:
        """A material with values of NumPy, each side."""
        each = list(zip(sides(material), layouts))
        # A medium between interfaces that do nothing looks alike from both sides
        alike = layouts[0].alone and not any(facets.step for facets in interfaces(parts(material)))
        found = [self._side(*of_side, Folded.of(self.grid, of_side[0])) for of_side in (each[:1] if alike else each)]
        found *= len(each) // len(found)
        if self.model.form == "forward":
            return found
        numbers, folded = self.body(material, found, layouts), Folded.of(self.grid.coarser(material), material)
        factors, wanted = reciprocal_balance.factors(
            numbers, folded, self.samples, sample_allocation.share(len(material.interfaces))
        )

        def spread(values: Array) -> Array:
            return folded.grid.refined(folded.everywhere(values), self.grid)

        demands: list[Demand | None] = [each and Demand(*map(spread, each)) for each in wanted]
        return [side.weighed(list(map(spread, each)), of) for side, each, of in zip(found, factors, demands)]

    def body(self, material: Material, found: Sequence[SolvedSide], layouts: Sequence[Layout]) -> Solved:
        """The BSDF in NumPy."""
        made: list[Side] = []
        for seen, side, layout in zip(sides(material), found, layouts):
            curves = directional_grid.curves(list(self.spread(side)), self.shape, None)
            made.append(self._in_numpy(seen, side.numbers, layout, curves))
        return self.bsdf(material, made)

    def _in_numpy(self, material: Material, numbers: Array, layout: Layout, curves: Any) -> Side:
        each = [*numbers.reshape(-1, self.colours, 1)]
        stacked = compiled.Colour(np.ones((self.colours, 1)))
        return self.side(material, layout, curves, each, Context(colour=stacked, tables=self.tables))

    def side(self, material: Material, layout: Layout, curves: Any, numbers: Sequence[Value], context: Context) -> Side:
        """A side of a material of a renderer's values, those of one point or of all; `numbers` are colours in the order
        of `SolvedSide.numbers`."""
        assert context.colour is not None
        shapes = tuple(shapes_of(material, layout.lobes))
        each = iter(numbers)
        polynomial = _polynomial(each)
        top = self.medium(TopMedium, material, layout, _shares(each)) if layout.apart else None
        transmission = self.transmission(material, layout)
        if transmission and layout.alone:
            passed = _polynomial(each)
            through = ScatteredThrough(passed, self.medium(PassedMedium, material, layout, _shares(each)))
            transmission = replace(transmission, through=through)
        samples, colour, kind = polynomial.samples, context.colour, self.kind
        return Side(curves, shapes, polynomial, samples, transmission, colour, self.colours, kind, top, self.wide)

    def own(self, materials: Sequence[Material], layouts: Sequence[Layout]) -> Solver:
        """The solver for all of some materials of NumPy's values, with wide light if one of them may have any."""
        apart = any(layout.apart for layout in layouts)
        return replace(self, wide=not apart and any(wide.share(material) > 0 for material in materials))

    def medium(self, kind: type[Medium], material: Material, layout: Layout, shares: Sequence[Value]) -> Medium:
        """The medium on top of a material in any dialect, with shares of its wider phase functions."""
        if layout.top is None:
            return kind.of(None, HenyeyGreenstein(0.0), shares)
        layer = material.layers[layout.top]
        assert isinstance(layer, SlabValues)
        return kind.of(layer, self.phase_of(layer), shares)

    def transmission(self, material: Material, layout: Layout) -> Transmission | None:
        """Transmission of a material, but for what a medium alone scatters; None where nothing passes."""
        if not material.transmits:
            return None
        return direct.transmission(material, self.variance, layout.stepped, layout.rough, layout.cloudy)

    def bsdf(self, material: Material, made: Sequence[Side]) -> Solved:
        """A material of one side or two."""
        symmetric = self.model.form == "symmetric"
        if len(made) == 1:
            return Solved(made[0], None, 1.0, symmetric)
        return Solved(made[0], made[1], ops.mean(material.below) / ops.mean(material.exterior), symmetric)

    def lit(self, material: Material, wi: Direction) -> Lit:
        """The upper side of a material of NumPy's values, solved for light from directions wi, (M,) each, alone."""
        (layout, *_), upper = self.layouts([material]), sides(material)[0]
        solver = self.own([material], [layout])
        found = solver._side(upper, layout, Listed(self.isotropic, wi))
        return Lit(solver._in_numpy(upper, found.numbers, layout, None), found.columns, wi)

    def _side(self, material: Material, layout: Layout, folded: Folded | Listed) -> SolvedSide:
        """A side of a material at some directions, in the order of the physics."""
        light, diffuse, through = self._light(material, layout, folded)
        lobes = self._lobes(material, layout, folded, light)
        clipped, peak = _clipped(diffuse, folded.at_cosines)
        whole = diffuse.polynomial.albedo(folded.cosine) + folded.around(clipped)
        own = [lobe.share * energy for lobe, energy in zip(lobes, _in_veils(layout, material, light))]
        drawn, rest = self._hand_over(own, folded, lobes, light.rest, whole)
        scale = _scale(rest, whole)
        wanted = [*(each.wanted for each in drawn), Demand.of(rest + ENERGY_EPS, rest, scale * folded.around(peak))]
        transmission = self.transmission(_uncoloured(material), layout)
        shares, passes = self._allocate(material, layout, folded, light, wanted, transmission, through)
        columns = Columns(
            [self._colours(each.weight) for each in drawn],
            [tuple(np.broadcast_to(x, folded.count) for x in self._roughness(lobe.tensor)) for lobe in lobes],
            list(shares[:-1]),
            [self._colours(each.energy) for each in drawn],
            self._colours(scale if self.model.form == "forward" else 0 * scale + 1),
            shares[-1],
            self._colours(rest),
            passes,
            self._colours(light.passed) if passes else None,
            None if diffuse.chance is None else folded.around(diffuse.chance),
        )
        found = [number for each in (diffuse, through) if each for number in each.numbers]
        numbers = np.array([self._colours(number)[:, 0] for number in found])
        if self.wide and transmission:
            inner = [lobe.interface > 0 for lobe in layout.lobes]
            wide_shares = wide.share(material), wide.straight_share(material)
            columns, shares = wide_light.columns(columns, *wide_shares, inner, light, transmission, folded)
            lit = Lit(self._in_numpy(material, numbers, layout, None), columns, folded.directions)
            columns = wide_light.shared(columns, shares, lit.view, folded)
        edged = self._edged(material, lobes, folded.phi)
        forward = transmission if self.model.form == "forward" else None
        count, clipped = len(fields(Remainder)), self._colours(clipped)
        polynomial, top = Remainder(*numbers[:count]), [*numbers[count:]]
        return SolvedSide(folded.unfolded(columns), polynomial, clipped, edged, forward, top)

    def _light(
        self, material: Material, layout: Layout, folded: Folded | Listed
    ) -> tuple[Energies, _Diffuse, _Diffuse | None]:
        """Solve for the energies of all parts, and fit the remainder beside what a medium on top scatters back, and
        what passes it where it is alone."""
        incidences = _incidences(layout)
        also = wide_light.cosines(folded) if self.wide else incidences[:0]
        solved = energies(
            material,
            np.concatenate([folded.cosine, incidences]),
            np.concatenate([folded.phi, 0 * incidences]),
            self.tables if self.model.microsurface else None,
            widths.nearly_straight,
            np.concatenate([incidences, also]),
            samples=self.normals or (FINELY[0] if self.finely else SAMPLES),
            like=layout.indices,
            events=layout.top is not None,
            modes=len(wide.TERMS) if self.wide else MODES,
        )
        if self.wide:
            straight = wide.straight_share(material) * (solved.passing - solved.around)
            solved = replace(solved, passing=solved.around + straight)
        by_node = "remainder", "around", "again"
        few = {name: getattr(solved, name)[:, :MODES, :, : len(incidences)] for name in by_node}
        solved = replace(solved, **few)
        albedos = (solved.lobes.sum(axis=0) + solved.veils.sum(axis=0) + solved.rest)[:, folded.count :]
        seen, cosines = (solved.nodes, incidences), folded.at_cosines[2]
        first, reflected = solved.first(folded.count), (solved.remainder, albedos)
        if not layout.apart:
            return first, _Diffuse.fitted(*seen, *reflected), None
        grey, nothing = _uncoloured(material), [np.zeros((1, 1))] * len(ORDERS)
        top = self.medium(TopMedium, grey, layout, nothing)
        if layout.top is None:
            return first, replace(_Diffuse.fitted(*seen, *reflected), medium=top, chance=0 * cosines), None
        back, through = _scattered(top, solved.nodes, layout.alone)
        diffuse = _Diffuse.fitted(*seen, *reflected, top, back, cosines)
        if not layout.alone:
            return first, diffuse, None
        passed, medium = (solved.around, _energy(solved.around)), self.medium(PassedMedium, grey, layout, nothing)
        return first, diffuse, _Diffuse.fitted(*seen, *passed, medium, through, cosines)

    def _lobes(self, material: Material, layout: Layout, folded: Folded | Listed, light: Energies) -> list[_Lobe]:
        """Work out the widths of lobes, veils and tails."""
        found, energy = parts(material), np.array([ops.mean(each) for each in light.lobes])
        known = widths.each(found, folded.cosine, folded.phi, energy)
        whole = np.ones_like(folded.cosine)

        def width(spec: LobeSpec) -> tuple[Tensor, Array]:
            tensor, near, tail = known[spec.interface]
            if spec.veil:
                return widths.veil(found, spec.interface, folded.cosine, tensor), whole
            if spec.tail:
                return tail or (tensor, 0 * whole)
            return near, 1 - tail.share if tail else whole

        shapes = shapes_of(_uncoloured(material), layout.lobes)
        return [_Lobe(shape, *width(spec)) for shape, spec in zip(shapes, layout.lobes)]

    def _hand_over(
        self, energies: Sequence[Array], folded: Folded | Listed, lobes: Sequence[_Lobe], rest: Array, whole: Array
    ) -> tuple[list[_Weighed], Array]:
        """Divide energies of lobes by their integrals; the remainder takes what light it can, by which a lobe would be
        too bright, and has the energy that is returned. `whole` is its albedo without a scale. What its scale cannot
        make of that, lobes have besides."""
        drawn, of_lobes = [], sum(energies)
        short = np.clip(rest - BRIGHTEST * whole, 0, of_lobes)
        rest, share = rest - short, 1 + ops.divide(short, of_lobes)
        normals = self.normals or (
            FINELY[1] if self.finely else round(sample_allocation.share(len(lobes)) * NORMALS[self.isotropic])
        )
        for (shape, tensor, _), own in zip(lobes, energies):
            lobe = shape.lobe(1.0, tensor.roughness(folded.phi))
            z, squares, largest = refracted_lobe.integrals(lobe, folded.directions, normals)
            more = np.clip(share * own - combined.MAX_GAIN * z, 0, np.maximum(BRIGHTER * whole - rest, 0))
            rest = rest + more
            energy = share * own - more
            weight = np.where(z > ENERGY_EPS, ops.divide(energy, z), 1.0)
            wanted = Demand.of(energy, weight * ops.divide(squares, z), weight * largest)
            drawn.append(_Weighed(energy, weight, wanted))
        return drawn, rest

    def _allocate(
        self,
        material: Material,
        layout: Layout,
        folded: Folded | Listed,
        light: Energies,
        wanted: Sequence[Demand],
        transmission: Transmission | None,
        through: _Diffuse | None,
    ) -> tuple[Array, Parts | None]:
        """Share samples among what is reflected, and what passes, which gets its weights."""
        # Light of a single isotropic interface is the same there and back
        alike = self.isotropic and len(material.layers) == 1
        least = MIN_DEFENSIVE_SHARE if self.model.form == "symmetric" and not alike else 0.0
        reflected = _evened(Demand.together(wanted)) if least else Demand.together(wanted)
        if not transmission:
            return sample_allocation.shared(reflected), None
        facets = None
        if len(layout.lobes) == 1:
            # What passes is sampled with the facets that reflect
            facets = wanted[0]
            reflected = Demand(*(np.concatenate([0 * x[:1], x[1:]]) for x in reflected))
        met = [*(None if each.veil or each.tail else each.interface for each in layout.lobes), None]
        whole = None
        if through:
            gained, peak = map(folded.around, _clipped(through, folded.at_cosines))
            whole = np.maximum(through.polynomial.albedo(folded.cosine) + gained, ALBEDO_MIN)
            diffuse = [folded.around(through.chance), *(0 * folded.cosine for _ in EVEN[1:])]
        else:
            *diffuse, peak = folded.around(_passing(transmission, layout, light, folded.at_cosines[2]))
        passes, shares = combined.parts(
            transmission,
            folded.directions,
            *(light.straight, light.bounced, light.passed),
            reflected,
            met,
            facets,
            diffuse,
            peak,
            whole,
        )
        passes = _evenly(passes, least)
        return shares, replace(passes, **{name: self._colours(getattr(passes, name)) for name in Parts.COLOURS})

    def _edged(self, material: Material, lobes: Sequence[_Lobe], phi: Array) -> list[Shape | None]:
        """Lobes whose integrals have edges between directions; those are lost in the error of few normals."""
        sharp = self.normals is None and _reflects_all(parts(material))
        return [shape if sharp and np.min(tensor.roughness(phi)[:2]) < NARROW else None for shape, tensor, _ in lobes]

    def spread(self, side: SolvedSide) -> Array:
        """All columns of a side over a renderer's grid, (rows, prod(shape)). The remainder of the forward form has its
        energy there, too, and lobes where integrals have edges; energies have the sum that is interpolated, and shares
        of samples sum up to 1."""
        declared, proportions = side.declaration, side.declaration.proportions(self.colours)
        light = np.sum([side.rows[k : k + self.colours] for k, _ in proportions], axis=0)
        rows = self.grid.spread(np.concatenate([side.rows, light, side.columns.chance[None]]), self.shape)
        rows, whole, left = np.split(rows, [-1 - self.colours, -1])
        if any(side.edged):
            self._lobes_between(rows, side)
        self._scale_energies(rows, proportions, whole)
        if side.transmission:
            self._pass_between(rows, side.transmission, *proportions[-1])
        chances = declared.chances(self.colours)
        rows[chances] /= rows[chances].sum(axis=0) + left
        if self.model.form == "forward":
            cosine = np.maximum(np.linspace(0, 1, self.shape[0]) ** 2, COS_ON_GRID_MIN)
            polynomial = Remainder(*(x[:, None] for x in vars(side.polynomial).values()))
            whole = polynomial.albedo(cosine) + self.grid.along(side.clipped, self.shape[0])
            whole = np.repeat(whole, math.prod(self.shape[1:]), axis=-1)
            firsts = (declared.first_rows(name, self.colours)[0] for name in ("scale", "rest"))
            scale, rest = (slice(k, k + self.colours) for k in firsts)
            rows[scale] = _scale(rows[rest], whole)
        return rows

    def _pass_between(self, rows: Array, transmission: Transmission, energy: int, weights: Sequence[int]) -> None:
        """Give diffuse light what the other parts lack of all that passes, about the critical angles of inner media,
        where weights jump from one node to the next."""
        inner = np.array([float(np.mean(n)) for n in transmission.indices[1:-1]])
        nodes = self.grid.cosines - 1
        edges = np.floor((1 - inner[inner < 1] ** 2) ** 0.25 * nodes)
        wi = directional_grid.directions(self.shape, None)
        there = np.flatnonzero(np.isin(np.floor(np.sqrt(wi[2]) * nodes + 1e-9), edges))
        if not len(there):
            return
        x, y, z = (w[there] for w in wi)
        light, straight, bounces = (rows[k : k + self.colours, there] for k in (energy, *weights[:2]))
        left = light - combined.energy(transmission, (x, y, z), straight, bounces)
        rest = slice(weights[2], weights[2] + self.colours)
        rows[rest, there] = combined.rest(transmission, (x, y, z), left)

    def _scale_energies(self, rows: Array, proportions: Sequence[tuple[int, Sequence[int]]], whole: Array) -> None:
        """So that energies, and what is in proportion to them, have the sum that is interpolated, `whole`. What is grey
        stays so: other energies make up for the colours of the rest, as far as that is little."""
        groups = [[slice(k, k + self.colours) for k in (energy, *others)] for energy, others in proportions]
        found = np.sum([rows[energy] for energy, *_ in groups], axis=0)
        share = ops.divide(ops.mean(whole), ops.mean(found))
        share = np.where(share > 0, share, 1)
        coloured = [group for group in groups if any(np.ptp(rows[each], axis=0).any() for each in group)]
        light = share * sum((rows[energy] for energy, *_ in coloured), np.zeros_like(found))
        rest = np.where(light > 0, ops.divide(whole - share * found + light, light), 1)
        rest = np.clip(rest, 1 - LITTLE, 1 + LITTLE)
        for group in groups:
            for each in group:
                rows[each] *= share * rest if group in coloured else share

    def _lobes_between(self, rows: Array, side: SolvedSide) -> None:
        """Set weights of lobes whose integrals have edges between directions, as near to the light that is
        interpolated as those at the nodes beside allow. What one lobe has too much of, or lacks, is left to others."""
        wi = directional_grid.directions(self.shape, None)
        found = []
        places = side.declaration.first_rows("weight", self.colours)
        for shape, place, weight, roughness in zip(side.edged, places, side.columns.weights, side.columns.roughness):
            if shape:
                at_nodes = self._integral(shape, roughness, self.grid.directions)
                z = self._integral(shape, [self.grid.spread(x[None], self.shape)[0] for x in roughness], wi)
                light = self.grid.spread(weight * at_nodes, self.shape)
                ends = self.grid.beside(weight, self.shape)
                there = slice(place, place + self.colours)
                rows[there] = np.clip(np.where(z > ENERGY_EPS, light / np.maximum(z, ENERGY_EPS), rows[there]), *ends)
                found.append((there, z, light, ends))
        lacks = sum(light - rows[there] * z for there, z, light, _ in found)
        rooms = [np.where(lacks > 0, high - rows[there], rows[there] - low) for there, _, _, (low, high) in found]
        share = np.clip(ops.divide(lacks, sum(z * room for (_, z, *_), room in zip(found, rooms))), -1, 1)
        for (there, *_), room in zip(found, rooms):
            rows[there] += share * room

    def _integral(self, shape: Shape, numbers: Sequence[Array], wi: Direction) -> Array:
        lobe = shape.lobe(1.0, self.kind(*numbers).roughness(ROOTS))
        return refracted_lobe.integral(lobe, wi, BETWEEN[self.isotropic])

    def _colours(self, values: Array) -> Array:
        return np.broadcast_to(values, (self.colours, np.shape(values)[-1]))

    def _roughness(self, tensor: Tensor) -> Iterator[Array]:
        """Roughness of a lobe with the plane of incidence, as it is interpolated."""
        roughness = tensor.roughness(np.zeros_like(tensor.xx))
        if self.isotropic:  # axes lie in the plane of incidence, and across it
            u, v = (np.minimum(tensor.width(np.array(axis)), WIDTH_ALPHA_MAX) for axis in widths.AXES)
            roughness = Roughness(u, v, 0.0)
        yield from vars(self.kind.of(roughness, ROOTS)).values()


def solve(material: Material, model: Model, variance: type[Variance], context: Context) -> Solved:
    """The BSDF of a material with constants of a renderer; differentiable."""
    material = material.solid()
    given = Variables.of(material)
    start = given.start
    solver = Solver.of(model, variance, context, start)
    layouts = solver.layouts([start, *given.ends(start)])
    solver = solver.own([start], layouts)

    packings: list[Packing] = []

    def arrays(numbers: list[float]) -> list[Array]:
        # After the values come their differences
        found = replace(solver, finely=bool(packings)).solve(given.replaced(start, numbers), layouts)
        if not packings:
            # Both sides lie in the same tables, so that either is one fetch
            groups = found[0].declaration.groups(solver.colours)
            rows = np.concatenate([side.rows for side in found], axis=1)
            packings.append(Packing.of(rows, groups, shared=not given.given))
        spread = np.concatenate([solver.spread(side) for side in found], axis=1)
        return [*(x.T.ravel() for x in packings[0].split(spread)), *(side.numbers for side in found)]

    flat, made = iter(finite_differences.differentiable(arrays, given.given, given.around, context.number)), []
    (packing,), nodes = packings, (len(layouts) * solver.shape[0], *solver.shape[1:])
    tables = [directional_grid.interleaved(next(flat), nodes, context.number) for _ in packing.tables]
    of_sides = zip(*(table.grids(solver.shape) for table in tables))
    for seen, layout, of_side in zip(sides(material), layouts, of_sides):
        curves, column = packing.curves(of_side), next(flat)
        numbers = column[:, None] if context.colour is channels else finite_differences.numbers(column, context.number)
        made.append(solver.side(seen, layout, curves, coloured(numbers, solver, context), context))
    return solver.bsdf(material, made)


def coloured(numbers: Sequence[Value], solver: Solver, context: Context) -> list[Value]:
    """A renderer's numbers, those of each colour in a row, as colours."""
    assert context.colour is not None
    width = solver.colours
    each = [ops.channel(x, k % width) for k, x in enumerate(numbers)]
    return [context.colour(*each[k : k + width]) for k in range(0, len(each), width)]


def _incidences(layout: Layout) -> Array:
    """Cosines at which diffuse light is known: that of a medium on top has a shape at slants, too."""
    return INCIDENCES if layout.top is None else SLANTED


def _polynomial(numbers: Iterator[Value]) -> Remainder:
    """The next of a side's numbers, as those of a polynomial."""
    return Remainder(*islice(numbers, len(fields(Remainder))))


def _shares(numbers: Iterator[Value]) -> list[Value]:
    """And as shares of wider phase functions."""
    return list(islice(numbers, len(ORDERS)))


def _energy(light: Array) -> Array:
    """Energies (C, I) of light (C, modes, N, I)."""
    return np.asarray(light[:, 0].sum(axis=1))


def _scattered(top: TopMedium, nodes: Nodes, through: bool) -> tuple[list[Array], list[Array]]:
    """Light (C, modes, N, I) that a medium scatters back once by its phase function, and by wider ones without loss,
    from cosines `SLANTED`; and likewise what goes `through` it."""
    depth, basis, p = np.ravel(top.depth), Relative(nodes, tuple(range(MODES))), np.sqrt(1 - SLANTED**2)
    phases = enumerate((top.phase, *top.wider))
    each = [escaped(phase, depth, basis, p, k if through else None) for k, phase in phases]
    found = []
    for own, *others in zip(*each):
        found.append([np.reshape(top.albedo, (-1, 1, 1, 1)) * own, *others])
    return found[0], found[1] if through else []


def layout_of(materials: Sequence[Material], veiled: Set[int] = frozenset()) -> Layout:
    """Layout valid for all `materials`, seen from above; the first is the central one."""
    each = [interfaces(parts(material)) for material in materials]
    steps = np.max([[facets.step for facets in found] for found in each], axis=0)
    turns = np.max([[facets.step * max(facets.alpha_u, facets.alpha_v) for facets in found] for found in each], axis=0)
    kinds = [(k, veil, False) for k in range(len(steps)) for veil in (False, True) if not veil or k in veiled]
    kinds += [(len(steps) - 1, False, True)] if any(map(brushing.parts_lobe, filter(None, each))) else []
    rough = widths.stepped(turns, widths.LEAST_TURN)
    above = np.array([[np.mean(facets.above) / np.mean(found[0].above) for facets in found] for found in each])
    denser = np.all(above >= 1, axis=0).tolist()
    firsts = [widths.first_step(steps[:k]) for k in range(len(steps))]
    edged = [k is not None and bool(np.any(above[:, k + 1] > own * CLOSE)) for k, own in zip(firsts, above.T)]
    near = np.any((1 - RELATIVE) * above < 1, axis=0).tolist()
    lobes = [
        LobeSpec(k, firsts[k], veil, tail, denser[k], (near if denser[k] else edged)[k]) for k, veil, tail in kinds
    ]
    cloudy = sorted(set().union(*map(_cloudy, materials)))
    stepped = widths.stepped(steps)
    last, top = rough[-1] if rough else None, _top(materials, stepped)
    alone = top is not None and not stepped and has_one_medium(materials[0])
    return Layout(lobes, stepped, last, cloudy, media_of(materials[0]), top, top is not None, alone)


def has_one_medium(material: Material) -> bool:
    """Whether a material transmits, and has one medium and no films."""
    slabs = sum(isinstance(layer, SlabValues) for layer in material.layers)
    return material.transmits and slabs == 1 and not any(material.films)


def _top(materials: Sequence[Material], stepped: Sequence[int]) -> int | None:
    """Place of a medium that scatters light and has no step of the index above it; None without one."""
    for place, layer in enumerate(materials[0].layers):
        if isinstance(layer, SlabValues):
            slabs = (each.layers[place] for each in materials)
            return place if any(isinstance(slab, SlabValues) and np.any(slab.tau_s > 0) for slab in slabs) else None
        if not isinstance(layer, InterfaceValues) or layer.kind != "dielectric" or layer.films or place in stepped:
            return None
    return None


def _cloudy(material: Material) -> set[int]:
    """Slabs that scatter light, by the number of interfaces above them."""
    found, above = set(), 0
    for layer in material.layers:
        above += isinstance(layer, InterfaceValues)
        if isinstance(layer, SlabValues) and np.any(layer.tau_s > 0):
            found.add(above)
    return found


def sides(material: Material) -> list[Material]:
    """A material as it is seen from above and, where it transmits, from below."""
    return [material, material.reversed()] if material.transmits else [material]


def _reflects_all(found: Sequence[Part]) -> bool:
    """Whether an interface reflects all light from outside beyond an angle."""
    glass = ((x.above, x.below) for x in interfaces(found) if x.k is None and x.below is not None)
    return any(np.min(below / above) * np.mean(above) < 1 for above, below in glass)


def _uncoloured(material: Material) -> Material:
    """The material with grey colours as one channel: what integrals need."""

    def channels(colour: Array) -> Array:
        alike = (colour == colour[0]).all()
        return np.asarray(colour[:1] if alike else colour, float)

    return material.each(lambda _, value: channels(value) if np.ndim(value) else value)


def _clipped(diffuse: _Diffuse, wi: Direction) -> tuple[Array, Array]:
    """Albedo that a polynomial gains by a medium beside it, and by being clipped, and the largest weight of samples,
    (C, M)."""
    numbers, top = direct.wider(diffuse.polynomial), direct.wider(diffuse.medium)
    x, y, z = (each[:, None] for each in wi)
    # Not where it is sampled: directions of samples jump with the numbers
    cosine, turn = low_discrepancy.fibonacci(EVENLY)
    sine, phi = np.sqrt(1 - cosine * cosine), 2 * np.pi * turn
    wo: Direction = (sine * np.cos(phi), sine * np.sin(phi), cosine)
    samples: RemainderSamples | TopSamples = numbers.samples
    value, density = numbers.value, np.full(EVENLY, 1 / (2 * np.pi))
    if top:
        samples = TopSamples(numbers.samples, top, diffuse.chance[:, None])
        value, (wo, density) = partial(top_medium.value, numbers, top), top.lattice((x, y, z), wo, cosine, turn)
    light = value((x, y, z), wo)
    gained = (light - numbers.unclipped((x, y, z), wo)[1] * (wo[2] / np.pi)) / density
    return gained.mean(axis=-1), ops.divide(light, samples.density((x, y, z), wo)).max(axis=-1)


def _passing(transmission: Transmission, layout: Layout, solved: Energies, cosines: Array) -> Array:
    """Numbers of light from directions wi that passes neither straight nor after bounces, and the largest weight of its
    samples, (6, M)."""
    incidences = _incidences(layout)
    wi = _of_cosines(incidences)
    light = np.mean(
        solved.around - internal_reflections.share(internal_reflections.bounced(transmission, wi)) * solved.again,
        axis=0,
    )
    sines = internal_reflections.seen_below(transmission, wi)[0]
    at_incidences = remainder.passing(
        solved.nodes, light, float(ops.mean(internal_reflections.bound(transmission))), sines
    )
    numbers = np.array([np.interp(cosines, incidences, each) for each in at_incidences])
    i = internal_reflections.seen_below(transmission, _of_cosines(cosines[:, None]))
    evenly = low_discrepancy.even_in_projection(EVENLY)
    numbers = numbers / internal_reflections.diffuse([*numbers[..., None]], i, evenly).mean(axis=-1)
    value, density = internal_reflections.eval_pdf_rest(Rest(None, 1.0, 1.0, [*numbers[..., None]]), i, evenly)
    return np.concatenate([numbers, np.max(value / density, axis=-1)[None]])


def _of_cosines(cosine: Array) -> Direction:
    return np.sqrt(1 - cosine * cosine), 0 * cosine, cosine


def _scale(energy: Array, albedo: Array) -> Array:
    """Factor that brings a remainder of that albedo to that energy."""
    return np.clip(energy / np.maximum(albedo, ALBEDO_MIN), 0, BRIGHTEST)


def _in_veils(layout: Layout, material: Material, light: Energies) -> list[Array]:
    """Energies of the lobes of a layout, (C, M) each: a lobe has what its veil has not."""
    drawn, shares = {spec.interface for spec in layout.lobes if spec.veil}, _veils(material)

    def own(spec: LobeSpec) -> Array:
        share = shares.get(spec.interface, 0.0) if spec.interface in drawn else 0.0
        if spec.veil:
            return share * light.veils[spec.interface]
        return light.lobes[spec.interface] + (1 - share) * light.veils[spec.interface]

    return list(map(own, layout.lobes))


def _veils(material: Material) -> dict[int, float]:
    """Shares of light that media above scatter by little that are drawn as veils, by interface, where there are any."""
    veils: dict[int, float] = {}
    share, k = 0.0, 0
    for layer in material.layers:
        if isinstance(layer, SlabValues):
            slab = Slab.of(layer, 1.0, widths.nearly_straight)
            assert slab.straight is not None
            events = slab.straight * float(np.max(layer.tau_s))
            share = max(share, min((events - VEILS[0]) / (VEILS[1] - VEILS[0]), 1.0))
        elif isinstance(layer, InterfaceValues):
            veils |= {k: share} if share > 0 else {}
            k += 1
    return veils


def _evened(wanted: Demand) -> Demand:
    """The demand with samples for a share `MIN_DEFENSIVE_SHARE` of the energy at least of the last part."""
    *lobes, rest = wanted.energy
    least = np.maximum(MIN_DEFENSIVE_SHARE * wanted.energy.sum(axis=0), ENERGY_EPS)
    return wanted._replace(energy=np.array([*lobes, np.maximum(rest, least)]))


def _evenly(of: Parts, least: float) -> Parts:
    """The parts with a share of the samples of what passes at least for its rest."""
    even = np.maximum(least * of.share - of.of_rest, 0) / np.maximum(of.share - of.of_rest, ENERGY_EPS)
    straight, bounced = (1 - even) * of.of_straight, (1 - even) * of.of_bounced
    return replace(of, of_straight=straight, of_bounced=bounced, of_rest=of.share - straight - bounced)


def shapes_of(material: Material, drawn: Sequence[LobeSpec]) -> list[Shape]:
    """One for each lobe."""
    found, indices = smooth_interfaces(material), [MediumIndex.of(1.0)]
    for layer in found:
        indices.append(MediumIndex.of(indices[-1].n * layer.n12))
    alphas = [(layer.alpha_u, layer.alpha_v) for layer in material.interfaces]
    opaque = [each for layer, each in zip(material.interfaces, alphas) if layer.kind != "dielectric"]
    of_metal = next((each for each in opaque if not is_same(*each)), None)

    def steeper(coat: int, interface: int) -> Value | None:
        metal, alpha = of_metal if interface == len(alphas) - 1 else None, alphas[coat]
        return widths.steeper(*alpha, metal) if metal or not is_same(*alpha) else None

    shapes = []
    for lobe in drawn:
        own, k = found[lobe.interface], lobe.first
        facets = own if k is None or not own.opaque else None
        out = (indices[0], None) if k is None else (indices[k], found[k], steeper(k, lobe.interface))
        n = replace(indices[lobe.interface], denser=lobe.denser, edged=lobe.edged)
        shapes.append(Shape(lobe.interface, n, facets, *out))
    return shapes
