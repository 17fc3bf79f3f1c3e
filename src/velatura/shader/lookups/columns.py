"""A uniform material of a solved model in a shader: a texture of its columns over direction, and numbers for the rest.

The columns are those of `velatura.model.solved.solve`, four to a texel: first what light is drawn with, then energies,
which few programs read. Where a user changes values, they all have a place; else columns that are the same are one, and
constant ones are numbers in the code.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import count, cycle, islice
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.media import of_material
from velatura.media.of_material import two_lobes
from velatura.media.tabulated import Tabulated
from velatura.model import Model, rotation_frame
from velatura.model.base import Body
from velatura.model.context import Context, at_a_point
from velatura.model.rotation_frame import Frame, Turned
from velatura.model.solved import solve, wide_light
from velatura.model.solved.bsdf import Side, Solved
from velatura.model.solved.columns import WIDE_SIDES, Columns, Declaration
from velatura.model.solved.lobes import top_medium, wide
from velatura.model.solved.lobes.remainder import Remainder
from velatura.model.solved.lobes.top_medium import PassedMedium, TopMedium
from velatura.model.solved.solve import Layout, SolvedSide, Solver
from velatura.model.solved.transmission import direct
from velatura.model.solved.transmission.combined import Parts
from velatura.model.solved.transmission.direct import Transmission
from velatura.model.variance import Covariance, Isotropic, Variance, is_same
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.optics.phase import HenyeyGreenstein, PhaseFunction, TwoLobes
from velatura.shader.lookups.lookup import Group, LookUp, Texels, sides_read, texture, together, untextured
from velatura.shader.recorder.seen import Seen
from velatura.shader.recorder.symbol import LAYOUT, REMAINDER, SHOWN, colour, number
from velatura.stack import InterfaceValues, Material, MediumValues, SlabValues, Stack

OF_TOP = 4  # numbers of a medium on top
FAINTLY = 1e-3  # chance that is added to that of every reflected part, where some are shown alone
NORMAL = (0.0, 0.0, 1.0)
COARSE = 12, 144  # cosines, and normals
BRUSHED = 0.3, 0.1  # roughnesses of interfaces that cross
SCATTERING = 1.0, 0.9  # optical depth and asymmetry of media below which veils are seen

Array = NDArray[np.floating]


@dataclass(frozen=True)
class SolvedContents:
    """Contents of a material for a shader: texels (height, width, 4), colours (K sides, 3) of the remainders and of
    media on top, and numbers of its layout."""

    texels: Array
    remainder: Array
    layout: Array


@dataclass(frozen=True, kw_only=True)
class SolvedLookUp(LookUp):
    """A material, or all of its kind, whose columns are read from a texture; it was turned back by an `angle`, None for
    0."""

    straight: Solved
    angle: Value | None
    solver: Solver
    layouts: Sequence[Layout]
    places: Sequence[int | float]
    solved: SolvedContents | None = None  # of one material

    @property
    def interfaces(self) -> list[int]:
        """Number of the interface of each lobe, from the top."""
        return [each.interface for each in self.layouts[0].lobes]

    @property
    def shown(self) -> list[str]:
        """Parts that have a weight: interfaces, by the first lobe of each, the remainder, and what passes."""
        first = [f"reflected[{self.interfaces.index(k)}]" for k in dict.fromkeys(self.interfaces)]
        return [*first, "remainder", *(["transmitted"] if self.sides > 1 else [])]

    def seen(self, wi: Direction, weighed: bool) -> Seen:
        body: Body = self.straight if self.angle is None else Turned(self.straight, self.angle)
        fields, energies = self._fields(wi, weighed), self._energies(wi)
        return Seen(body, fields, *((self.shown, self._shares) if weighed else ([], [])), energies)

    def _fields(self, wi: Direction, general: bool) -> dict[str, Value]:
        """All that values and samples take from wi, by its place in the struct; in `general`, the two parts of samples
        of light that goes straight through as well."""
        wi = self._turned_back(wi)
        seen, _ = self.straight.seen(wi)
        columns, found = seen.columns, dict[str, Value]()
        for k, (lobe, chance) in enumerate(zip(seen.lobes, columns.chances)):
            roughness = lobe.roughness
            if self.angle is not None:
                roughness = roughness._replace(rotation=roughness.rotation + self.angle)
            parts = {"weight": lobe.weight, **roughness._asdict(), "chance": chance}
            found |= {f"reflected[{k}].{part}": value for part, value in parts.items()}
        found |= {"remainder": columns.scale, "remainder_chance": columns.chance}
        if columns.passes:
            names = self.declaration.parts
            found |= {f"passed_{name}": getattr(columns.passes, name) for name in names}
        for side in WIDE_SIDES if columns.wide_passed else ():
            energy, *numbers = getattr(columns, side)
            found |= {f"{side}_energy": energy, **{f"{side}[{k}]": x for k, x in enumerate(numbers)}}
        if general and columns.passes and seen.transmission:
            passes = ops.mean(direct.entered(seen.transmission, seen.turned(wi, wi)).passes[0])
            straight = columns.passes.of_straight
            found |= {"passed_refracted": straight * passes, "passed_mirrored": straight * (1 - passes)}
        return found

    @property
    def _shares(self) -> list[str]:
        """The fields by which samples are shared in `general`, in the order in which they follow one another."""
        through = ["refracted", "mirrored", "of_bounced", "of_rest"] if self.sides > 1 else []
        chances = [f"reflected[{k}].chance" for k in range(len(self.interfaces))]
        return [*(f"passed_{name}" for name in through), *chances, "remainder_chance"]

    def _energies(self, wi: Direction) -> list[Value]:
        """Energies of what `shown` names, colours."""
        columns = self.straight.seen(self._turned_back(wi))[0].columns
        lobes = list(zip(columns.energies, self.interfaces))
        found = [sum(energy for energy, each in lobes if each == k) for k in dict.fromkeys(self.interfaces)]
        return [*found, columns.rest, *([] if columns.passed is None else [columns.passed])]

    def _turned_back(self, w: Direction) -> Direction:
        return w if self.angle is None else ggx.rotate(w, self.angle)

    @property
    def declaration(self) -> Declaration:
        """That of the columns of each side."""
        return self.straight.above.declaration

    def rows(self, solved: SolvedContents) -> Array:
        """Columns of a stack of this kind, where all have a place: (rows, sides, nodes over the cosine, and over the
        azimuth)."""
        channels = untextured(solved.texels, self.groups, self.sides, self.nodes)
        return channels[[int(place) for place in self.places]]

    def is_alike(self, a: SolvedContents, b: SolvedContents) -> bool:
        """Whether light takes the same ways in two stacks of this kind: they differ in numbers alone."""
        turned = int(self.angle is not None)
        return bool(np.array_equal(a.layout[turned:], b.layout[turned:]))

    def solve(self, stack: Stack, coarse: bool = False, both: bool = False) -> SolvedContents:
        """A stack of this kind. A `coarse` one is quicker, and is for light from above alone, unless for that from
        `both` sides: that from below has the same columns where a program reads one side at a time."""
        numbers, frame = _numbers(stack)
        material = frame.back(numbers)
        solver = replace(self.solver, variance=frame.kind(self.solver.variance))
        if coarse:
            cosines, normals = COARSE
            solver = replace(solver, grid=replace(solver.grid, cosines=cosines), normals=normals)
        # All that its kind may draw, of its own shape
        own = [_of_kind(layout, kind) for layout, kind in zip(solver.layouts([material]), self.layouts)]
        solver = replace(solver, wide=solver.wide and wide.share(material) > 0)
        if coarse and not both and solver.model.form == "forward":
            found = solver.solve(material, own[:1]) * self.sides
        else:
            found = solver.solve(material, own)
        if self.solver.wide and not solver.wide:
            found = [replace(side, columns=wide_light.none(side.columns)) for side in found]
        texels = _texture(_rows(solver, found), self.places, self.groups, self.nodes)
        degrees = None if self.angle is None else frame.degrees(numbers)
        numbers_of_layout = _layout_numbers(solver, material, own, self.layouts, degrees)
        return SolvedContents(texels, _remainders(found, _colours_of(self.layouts[0])), numbers_of_layout)


def tabulated(stack: Stack, material: Material, model: Model, variance: type[Variance], general: bool) -> SolvedLookUp:
    """The recorded body of a stack; a `general` one is that of all values, and has weights of its parts."""
    numbers, frame = _numbers(stack)
    plain, flags = frame.back(numbers), map(number, (f"{LAYOUT}[{k}]" for k in count()))
    degrees: Value = frame.degrees(numbers)
    if not general:
        material, variance = frame.back(material), frame.kind(variance)
    elif variance is Covariance:
        degrees = by = next(flags)
        material = material.each(lambda address, x: x - by if address.key == "rotation" else x)
    solver = Solver.of(model, variance, Context(), None if general else plain)
    solver = replace(solver, phase_of=_of_numbers if general else _printed)
    layouts = solver.layouts([_eventful(plain, material, variance) if general else plain])
    if general and layouts[0].apart and solve.has_one_medium(plain):
        layouts = [replace(layout, alone=True) for layout in layouts]
    may_be_wide = general and _may_be_wide(plain, layouts[0], variance)
    solver = replace(solver, wide=may_be_wide) if general else solver.own([plain], layouts)
    found = None if general else solver.solve(plain, layouts)
    rows = None if found is None else _rows(solver, found)
    sides, of_side = [], _colours_of(layouts[0])
    for k, (seen, layout) in enumerate(zip(solve.sides(material.solid()), layouts)):
        colours = [colour(f"{REMAINDER}[{of_side * k + j}]") for j in range(of_side)]
        context = replace(at_a_point(), colour=together)
        side = solver.side(seen, layout, None, [*_colours(found[k])] if found else colours, context)
        if general:
            transmission = side.transmission and _any(side.transmission, flags)
            top = side.top and _any_top(seen, side.top, flags)
            if transmission and transmission.through and top:
                medium = PassedMedium(**vars(top) | {"shares": transmission.through.medium.shares})
                through = replace(transmission.through, medium=medium, is_alone=next(flags))
                transmission = replace(transmission, through=through)
            side = replace(side, transmission=transmission, top=top)
        sides.append(side)
    groups, places = _placed(sides[0], rows)
    for k, beam in enumerate(sides_read(len(sides), model)[: len(sides)]):
        curves = _Curves(places, tuple(Texels(solver.shape, group, beam) for group in groups))
        sides[k] = replace(_WeighedSide(**vars(sides[k])) if general else sides[k], curves=curves)
    angle = None if is_same(degrees, 0.0) else degrees * (pi / 180)
    solved = None
    if found is not None and rows is not None:
        layout_numbers = _layout_numbers(solver, plain, layouts, layouts, None if angle is None else degrees)
        solved = SolvedContents(_texture(rows, places, groups, solver.shape), _remainders(found), layout_numbers)
    flagged = sum(len(_flags(side.transmission)) for side in sides if side.transmission)
    flagged += sum(OF_TOP for side in sides if side.top) + sum(layout.alone for layout in layouts)
    return SolvedLookUp(
        nodes=solver.shape,
        groups=groups,
        sides=len(sides),
        known=solved.texels if solved else None,
        colours=of_side * len(sides),
        numbers=flagged + (angle is not None),
        straight=solver.bsdf(material.solid(), sides),
        angle=angle,
        solver=solver,
        layouts=layouts,
        places=places,
        solved=solved,
    )


def _texture(rows: Array, places: Sequence[int | float], groups: Sequence[Group], nodes: tuple[int, ...]) -> Array:
    """The texture of columns, (rows, sides, nodes), but for constant ones."""
    placed = ((place, row) for row, place in zip(rows, places, strict=True) if isinstance(place, int))
    return texture(placed, groups, rows.shape[1], nodes)


def _remainders(found: Sequence[SolvedSide], count: int = 0) -> Array:
    """Colours of the remainders of all sides, at least so many of each."""
    each = map(_colours, found)
    return np.concatenate([np.pad(x, ((0, max(count - len(x), 0)), (0, 0))) for x in each])


def _layout_numbers(
    solver: Solver, material: Material, layouts: Sequence[Layout], kinds: Sequence[Layout], degrees: Value | None
) -> Array:
    """The angle by which a material was turned back, if it may be, and the flags of its layout, of all `kinds` has."""
    flags: list[Value] = [] if degrees is None else [degrees]
    for side, layout, kind in zip(solve.sides(material), layouts, kinds):
        transmission = solver.transmission(side, layout)
        flags += _flags(transmission) if transmission else []
        flags += _of_top(side, layout) if layout.apart else []
        flags += [float(layout.alone)] if kind.alone else []
    return np.array(flags, np.float32)


def _flags(transmission: Transmission) -> list[Value]:
    """Flags of the interfaces that shape the light that passes."""
    return [*transmission.faces, *transmission.under, *transmission.scattered]


def _any(transmission: Transmission, flags: Iterator[Value]) -> Transmission:
    """A transmission of any layout."""
    faces, under, scattered = (tuple(next(flags) for _ in transmission.refractions) for _ in range(3))
    bounces = len(transmission.refractions) > 1
    return replace(transmission, faces=faces, under=under, scattered=scattered, bounces=bounces)


def _of_kind(layout: Layout, kind: Layout) -> Layout:
    """The layout of a material with all that its kind draws, and nothing else."""
    top = layout.top if kind.apart else None
    return replace(layout, lobes=kind.lobes, top=top, apart=kind.apart, alone=layout.alone and kind.alone)


def _may_be_wide(material: Material, layout: Layout, variance: type[Variance]) -> bool:
    """Whether code of all values draws light that is too wide for lobes: that of panes whose interfaces are written
    with one roughness."""
    return material.transmits and len(material.interfaces) > 1 and variance is Isotropic and not layout.apart


def _colours_of(layout: Layout) -> int:
    """How many colours a side has: of its remainder and of a medium on top, and of what that passes alone."""
    return (len(fields(Remainder)) + (len(top_medium.ORDERS) if layout.apart else 0)) * (1 + layout.alone)


def _of_numbers(layer: SlabValues) -> PhaseFunction:
    """The phase function of a medium by the numbers that stand for any in code."""
    return two_lobes(of_material.phase_of(layer))


def _printed(layer: SlabValues) -> PhaseFunction:
    """The phase function of a medium in code, which has no table of it but two lobes."""
    phase = of_material.phase_of(layer)
    return two_lobes(phase) if isinstance(phase, Tabulated) else phase


def _of_top(material: Material, layout: Layout) -> list[float]:
    """Numbers of the medium on top of a side: 1 where there is one, and its phase function as two lobes."""
    if layout.top is None:
        return [0.0] * OF_TOP
    layer = material.layers[layout.top]
    assert isinstance(layer, SlabValues)
    lobes = two_lobes(of_material.phase_of(layer))
    return [1.0, float(lobes.first.g), float(lobes.second.g), lobes.share]


def _any_top(material: Material, top: TopMedium, flags: Iterator[Value]) -> TopMedium:
    """A medium on top of any layout, on either side."""
    is_on_top, first, second, share = islice(flags, OF_TOP)
    slab = next(layer for layer in material.layers if isinstance(layer, SlabValues))
    phase = TwoLobes(HenyeyGreenstein(first), HenyeyGreenstein(second), share)
    top = TopMedium.of(slab, phase, top.shares)
    return replace(top, albedo=is_on_top * top.albedo)


def _placed(side: Side, rows: Array | None) -> tuple[Sequence[Group], Sequence[int | float]]:
    """Groups of texels that are read together, and of each column its place in them, or its value if it is constant.

    Columns that are the same, if they are known, lie in one place.
    """
    seldom = side.declaration.groups(side.colours)
    total = len(seldom)
    constants: list[float | None] = [None] * total
    first = list(range(total))
    if rows is not None:
        rows = rows.astype(np.float32)
        constants = [float(row.flat[0]) if np.ptp(row) == 0 else None for row in rows]
        alike = ([k for k, other in enumerate(rows) if np.array_equal(row, other)] for row in rows)
        first = [min(same, key=seldom.__getitem__) for same in alike]
    groups, places, begin = [], dict[int, int](), 0
    for name, wanted in (("columns", 0), ("energies", 1)):
        own = [k for k in range(total) if first[k] == k and constants[k] is None and seldom[k] == wanted]
        places |= {k: 4 * begin + j for j, k in enumerate(own)}
        texels = -(-len(own) // 4)
        groups += [Group(name, begin, texels)] if texels else []
        begin += texels
    return groups, [x if x is not None else places[k] for k, x in zip(first, constants)]


@dataclass(frozen=True)
class _Curves:
    """The columns for a direction, as the code reads them."""

    places: Sequence[int | float]
    textures: tuple[Texels, ...]

    def __call__(self, w: Direction) -> list[Value]:
        read = [x for texture in self.textures for x in texture(w)]
        return [read[place] if isinstance(place, int) else place for place in self.places]


@dataclass(frozen=True)
class _WeighedSide(Side):
    """A side with a weight, 0 or 1, for each interface, the remainder, and what passes."""

    def at(self, w: Direction) -> Columns:
        columns, numbers = super().at(w), [shape.interface for shape in self.shapes]
        count = max(numbers, default=-1) + 1  # a base below media alone has no interface
        shown = [number(f"{SHOWN}[{k}]") for k in (*numbers, count, count + 1)]
        *lobes, rest, through = shown
        kept = [x * (chance + FAINTLY) for x, chance in zip(shown, [*columns.chances, columns.chance])]
        passes = columns.passes
        total = sum(kept) + (through * passes.share if passes else 0.0)
        chances = [ops.divide(x, total) for x in kept]
        if passes:
            weights = {name: through * getattr(passes, name) for name in Parts.COLOURS}
            shares = {name: ops.divide(through * getattr(passes, name), total) for name in Parts.CHANCES}
            passes = replace(passes, **weights, **shares)
        reflected, passed = columns.wide_reflected, columns.wide_passed
        return replace(
            columns,
            weights=[x * weight for x, weight in zip(lobes, columns.weights)],
            chances=chances[:-1],
            energies=[x * energy for x, energy in zip(lobes, columns.energies)],
            scale=rest * columns.scale,
            chance=chances[-1],
            rest=rest * columns.rest,
            passes=passes,
            passed=None if columns.passed is None else through * columns.passed,
            wide_reflected=[*(rest * energy for energy in reflected[:1]), *reflected[1:]],
            wide_passed=[*(through * energy for energy in passed[:1]), *passed[1:]],
        )


def _numbers(stack: Stack) -> tuple[Material, Frame]:
    """A stack of numbers, and the axes that it is solved in."""
    material = solve.plain(Material.of(stack).solid())
    return material, rotation_frame.frame(material)


def _rows(solver: Solver, found: Sequence[SolvedSide]) -> Array:
    """Columns on the grid that is read, (rows, sides, nodes)."""
    return np.stack([solver.spread(side) for side in found], axis=1)


def _colours(side: SolvedSide) -> Array:
    return side.numbers.reshape(-1, side.polynomial.c_00.shape[-1])


def _eventful(material: Material, written: Material, variance: type[Variance]) -> Material:
    """A material that draws all that layers like those that are `written` may have: media scatter, all indices differ,
    and interfaces that can be brushed cross."""
    depth, g = SCATTERING
    crossed = cycle((BRUSHED, BRUSHED[::-1]))

    def eventful(k: int, layer: Any) -> Any:
        if isinstance(layer, MediumValues):
            return replace(layer, depth=depth, sigma_s=np.ones((3, 1)), g=g, phase=None)
        if not isinstance(layer, InterfaceValues):
            return layer
        seen = written.layers[k]
        assert isinstance(seen, InterfaceValues)
        if variance is Covariance and not is_same(seen.alpha_u, seen.alpha_v):
            u, v = next(crossed)
            layer = replace(layer, alpha_u=u, alpha_v=v, rotation=0.0)
        return replace(layer, eta=material.exterior * (1.5 + 0.1 * k)) if layer.kind == "dielectric" else layer

    return replace(material, layers=tuple(eventful(k, layer) for k, layer in enumerate(material.layers)))
