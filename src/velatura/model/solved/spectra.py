"""A material with values that depend on wavelength, solved once over direction and wavelength.

It is solved in channels (`velatura.model.solved.solve`): those of the fixed wavelengths that stand for all light, and
those of wavelengths between which its values bend little. Colours are kept over direction and wavelength; numbers,
which shape lobes and share samples among them, over direction alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.films.of_material import greatest_optical_thickness_nm
from velatura.model.base import Body, Model
from velatura.model.context import Context
from velatura.model.rotation_frame import Frame, frame
from velatura.model.rough_interface import Facets
from velatura.model.solved import monotone_cubic
from velatura.model.solved.columns import Declaration
from velatura.model.solved.energies.adding import Lambert, Part, parts
from velatura.model.solved.solve import Layout, SolvedSide, Solver, plain, sides
from velatura.model.solved.texture_axes import Wavelengths
from velatura.model.variance import Variance
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import directional_grid, finite_differences
from velatura.renderer.differentiated import Variables
from velatura.renderer.directional_grid import Curves
from velatura.stack import Material

Array = NDArray[np.floating]

NODES = 64  # even over the spectrum, between which colours are interpolated linearly;
SLANTS = np.array([1.0, 0.75, 0.5, 0.25])  # cosines, with which the waves of films move
PER_NM, NODES_MAX = 0.07, 256  # for thin films as many by optical thickness
CLOSE = 0.002  # reflectances and transmittances between wavelengths for which the material is solved


@dataclass(frozen=True, eq=False)
class _Side:
    """Numbers over direction, colours over direction and wavelength, and those of the remainder over wavelength.

    `order` says which columns are colours.
    """

    order: Sequence[bool]
    numbers: Curves
    colours: Curves
    polynomial: Curves


@dataclass(frozen=True, eq=False)
class _OfRay:
    """The columns of a side for a direction, at the wavelengths of a ray."""

    side: _Side
    places: Value
    width: int

    def __call__(self, w: Direction) -> Iterator[Value]:
        numbers, colours = iter(self.side.numbers(w)), iter(self.side.colours(w, self.places))
        for is_colour in self.side.order:
            yield from [next(colours)] * self.width if is_colour else [next(numbers)]


@dataclass(frozen=True, eq=False)
class Spectra:
    """Both sides of a material, the lower one where it transmits."""

    frame: Frame
    solver: Solver
    layouts: Sequence[Layout]
    sides: Sequence[_Side]

    @property
    def symmetric(self) -> bool:
        return self.solver.model.form == "symmetric"

    def at(self, material: Material, places: Value) -> Body:
        """The BSDF at the wavelengths of a ray, by their places on the spectrum from 0 to 1; `material` has its values
        there. The fixed wavelengths come first, in both."""
        turned, spectrum = material.solid(), type(places)
        material = self.frame.back(turned)
        solver = replace(self.solver, colours=len(places))
        context = Context(constant=False, colour=lambda *channels: spectrum(list(channels)), tables=solver.tables)
        made = []
        for seen, layout, side in zip(sides(material), self.layouts, self.sides):
            curves = _OfRay(side, places, solver.colours)
            numbers = ops.interpolate(side.polynomial, places)
            made.append(solver.side(seen, layout, curves, numbers, context))
        return self.frame.turned(solver.bsdf(material, made), turned)


def solve(material: Material, places: Array, model: Model, variance: type[Variance], context: Context) -> Spectra:
    """A material with constants of a renderer, solved over the spectrum; differentiable.

    Colours have channels at `places` on the spectrum from 0 to 1 (C,): the fixed ones, and then even ones.
    """
    material = material.solid()
    own = frame(material)
    material, variance = own.back(material), own.kind(variance)
    chosen, nodes = _chosen(plain(material), places), len(places) - ops.FIXED
    material, places = material.each(lambda _, value: _channels(value, chosen)), places[chosen]
    material = replace(material, light=_channels(material.light, chosen))
    given, start = Variables.of(material), plain(material)
    solver = Solver.over(len(places), model, variance, context, start)
    layouts = solver.layouts([start, *given.ends(start)])
    solver = solver.own([start], layouts)
    declared: list[Declaration] = []

    def arrays(numbers: list[float]) -> list[Array]:
        # After the values come their differences
        found = replace(solver, finely=bool(declared)).solve(given.replaced(start, numbers), layouts)
        declared[:] = [side.declaration for side in found]
        return [flat for side in found for flat in _flat(side, solver, places, nodes)]

    flat = iter(finite_differences.differentiable(arrays, given.given, given.around, context.number))
    shapes = solver.shape, (*solver.shape, nodes), (nodes,)
    made = []
    for order in ([column.colour for column in each.columns] for each in declared):
        curves = (directional_grid.interleaved(next(flat), shape, context.number) for shape in shapes)
        made.append(_Side(order, *curves))
    return Spectra(own, solver, layouts, made)


def nodes_of(material: Material) -> int:
    """How many nodes resolve the spectra of a material of numbers."""
    return int(min(max(NODES, PER_NM * greatest_optical_thickness_nm(material)), NODES_MAX))


def axis(material: Material, places: Array) -> Wavelengths:
    """The spectrum as an axis of tables, for a material with channels at places on it, as `solve` takes it."""
    start = plain(material.solid())
    chosen = _chosen(start, places)
    spectra = {address.name: np.ravel(x)[chosen].tolist() for address, x in start.values() if np.size(x) == len(places)}
    nm = np.asarray(start.light)[chosen]
    named = tuple((name, tuple(x)) for name, x in spectra.items())
    return Wavelengths(tuple(places[chosen].tolist()), tuple(nm.tolist()), named)


def _flat(side: SolvedSide, solver: Solver, places: Array, nodes: int) -> list[Array]:
    """The numbers, the colours and the remainder of a side, at nodes, flat."""
    counts = [column.rows(len(places)) for column in side.declaration.columns]
    columns = np.split(solver.spread(side), np.cumsum(counts)[:-1])
    # A table has one column at least; without lobes none is read
    numbers = np.concatenate([each for each in columns if len(each) == 1] or [np.zeros_like(columns[0][:1])])
    colours = over_nodes(np.array([each.T for each in columns if len(each) > 1]), places, nodes)
    polynomial = side.numbers.reshape(-1, len(places))
    return [numbers.T.ravel(), np.moveaxis(colours, 0, -1).ravel(), over_nodes(polynomial, places, nodes).T.ravel()]


def over_nodes(values: Array, places: Array, nodes: int) -> Array:
    """Values at places on the spectrum, (..., C), interpolated at even nodes, (..., nodes)."""
    places, first = np.unique(places, return_index=True)
    return monotone_cubic.interpolated(places, values[..., first], np.linspace(0, 1, nodes))


def _channels(value: Value, chosen: Sequence[int]) -> Value:
    """A colour in some of its channels; one that is the same in all, and a number, as it is."""
    return type(value)([value[k] for k in chosen]) if np.ndim(value) and len(value) > 1 else value


def _chosen(material: Material, places: Array) -> list[int]:
    """Channels that represent all: the fixed ones, and others in order, until what layers reflect and transmit along
    the normal is close to its interpolation everywhere."""
    rows = [np.broadcast_to(row, len(places)) for part in parts(material) for row in _seen(part)]
    light = np.array([row for row in rows if np.ptp(row)] or [np.zeros(len(places))])
    even = list(range(ops.FIXED, len(places)))
    chosen = [*range(ops.FIXED), even[0], even[-1]]
    while True:
        error = np.abs(over_nodes(light[:, chosen], places[chosen], len(even)) - light[:, even]).max(axis=0)
        if error.max() < CLOSE:
            return chosen
        chosen.append(even[int(error.argmax())])


def _seen(part: Part) -> list[Array]:
    """Reflectances and transmittances (C,) along the normal, and of films from other directions, too."""
    if isinstance(part, Facets):
        return list(part.reflectance(np.ones(1) if part.films is None else SLANTS).T)
    if isinstance(part, Lambert):
        return [part.albedo]
    return [np.exp(-part.tau_a), np.exp(-part.tau_s)]
