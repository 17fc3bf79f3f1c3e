"""Solutions of a material along each of its values, between which a page without Python interpolates.

What changes along an axis is a sum of few shapes over direction, whose shares are functions of the coordinate: those
of splines through the solutions at nodes, tabulated finely. Of a colour, each channel has its own coordinate, and
solutions are of grey values, as with textures (`velatura.model.solved.textures`).

Where values of several axes move, `page/tabulated.js` puts together what each of them does alone: columns that are
nowhere negative are scaled, and others change by sums.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.editor.messages import Answer, array
from velatura.editor.shading import solved_look_up
from velatura.model import Model
from velatura.model.guards import ALPHA_MIN
from velatura.model.solved import solve
from velatura.model.solved.columns import WIDE_SIDES
from velatura.model.solved.solve import RGB
from velatura.model.solved.texture_axes import ROOTS, TextureAxis
from velatura.shader.lookups.columns import SolvedContents, SolvedLookUp
from velatura.stack import Address, InterfaceValues, LayerValues, Material, MediumValues, Stack, Varying
from velatura.stack.spectra import Measured

Array = NDArray[np.floating]

#: Least and greatest coordinate of an axis, of roots for those in `ROOTS`, and the number of nodes, by key; of
#: coefficients they are those of optical depths.
SPANS = {
    "alpha_u": (ALPHA_MIN**0.5, 1.0, 10),
    "alpha_v": (ALPHA_MIN**0.5, 1.0, 10),
    "rotation": (-90.0, 90.0, 9),
    "eta": (1.05, 2.65, 7),
    "k": (0.0, 2.5, 6),
    "sigma_a": (0.0, 2.5, 11),
    "sigma_s": (0.0, 2.5, 9),
    "g": (-0.1, 0.95, 7),
    "albedo": (0.0, 1.0, 5),
}
OF_METALS = 0.1, 4.0  # the span of their index
APART = 0.04  # of an index from those of other media, at which light has a kink
FINE = 6  # places from one node to the next
COSINES, PLANE = 32, (16, 9)  # at which shapes are kept: cosines, and azimuths of brushed materials
FLOOR = 0.01  # of greatest values, below which nothing is scaled
CLOSE = 4e-3  # root mean square of all that shapes may lack
WIDTHS = 0.1  # the unit of widths, whose errors are seen sooner
OF_WIDTHS = 4  # the power of the root of a roughness that adds up over interfaces
SHARPEST = 1e-3  # root of a roughness

#: Columns that are numbers of light, and its energy; they mean nothing without any.
WEIGHED = {side: f"{side}_energy" for side in WIDE_SIDES} | {"scale": "rest"}
WEIGHED |= {f"passed_{number}": "passed_rest" for number in ("even", "cosine", "grazing", "once", "twice")}


@dataclass(frozen=True)
class Axis:
    """Values that change together, beside their `own` mean; a coefficient of a medium counts `times` its depth, by flat
    name."""

    along: TextureAxis
    own: float
    times: str | None = None

    @property
    def names(self) -> list[str]:
        """Flat names of all values that move along it."""
        return [*(address.name for address in self.along.addresses), *([self.times] if self.times else [])]

    @property
    def spreads(self) -> bool:
        """Whether it is of roughness: light that several interfaces scatter adds up, while other factors multiply."""
        return self.along.addresses[0].role.startswith("alpha")

    @property
    def colour(self) -> bool:
        return self.along.addresses[0].colour


class Row(NamedTuple):
    """Where a row lies among the channels of texels, None of what chances leave; its channel of a colour, None of what
    all share; the power of it that changes by factors, None where differences add up; the floor of what is scaled; the
    unit of differences; the number of the row that weighs it, None where none does; and its greatest value."""

    place: int | None
    channel: int | None
    power: int | None
    floor: float
    unit: float
    weight: int | None
    most: float


def tabulated(stack: Stack, model: Model) -> Answer:
    """The table by which the page interpolates: no axes of a stack that is not solved."""
    look = solved_look_up(stack, model)
    if look is None:
        return {"axes": []}
    own = look.solve(stack)
    solved = [found for axis in axes(stack) if (found := _solved(look, stack, own, axis))]
    columns = [np.array([_columns(look, node) for node in nodes]) for _, nodes in solved]
    rows = _rows(look, np.concatenate([_columns(look, own)[None], *columns]))
    colours = np.array([node.remainder for node in (own, *(node for _, nodes in solved for node in nodes))], float)
    parts = look.sides * (1 + look.layouts[0].alone)
    sizes = np.abs(colours).reshape(len(colours), parts, -1, RGB).sum(axis=2)
    return {
        "axes": [_along(axis, nodes, _changing(rows, each)) for (axis, nodes), each in zip(solved, columns)],
        "rows": [row._asdict() for row in rows],
        "floors": (FLOOR * np.maximum(sizes.max(axis=(0, 2)), ops.TINY)).tolist(),
        "chances": look.declaration.chances(RGB),
        "sides": look.sides,
        "nodes": [*look.nodes],
    }


def _rows(look: SolvedLookUp, columns: Array) -> list[Row]:
    """All rows of columns (materials, rows, ...), of which the last one is what chances leave."""
    named: list[tuple[str, int | None]] = []
    for column in look.declaration.columns:
        named += [(column.name, k if column.colour else None) for k in range(column.rows(RGB))]
    firsts = {number: look.declaration.first_rows(energy, RGB) for number, energy in WEIGHED.items()}
    found, places = [], [*map(int, look.places), None]
    for row, (place, (name, channel)) in enumerate(zip(places, [*named, ("", None)], strict=True)):
        weight = firsts[name][0] + (channel or 0) if firsts.get(name) else None
        values = columns[:, row] if weight is None else columns[:, row] * columns[:, weight]
        most, wide = float(values.max()), name == "roughness"
        power = None if values.min() < 0 else OF_WIDTHS if wide else 1
        unit = WIDTHS if wide else float(np.mean(np.abs(values))) + ops.TINY
        floor = SHARPEST if wide else FLOOR * max(most, ops.TINY)
        found.append(Row(place, channel, power, floor, unit, weight, most))
    return found


def _changing(rows: Sequence[Row], columns: Array) -> Array:
    """Changes of columns (nodes, rows, ...) along an axis, in its units."""
    weights = (1.0 if row.weight is None else columns[:, row.weight] for row in rows)
    return np.stack([columns[:, k] * weight / rows[k].unit for k, weight in enumerate(weights)], axis=1)


def axes(stack: Stack) -> list[Axis]:
    """The axes of a stack: roughnesses, rotations of what is brushed, optical depths of media and how they scatter,
    albedos, and indices by number, and of dielectrics, where there are no films."""
    numbers = solve.plain(Material.of(stack).solid())
    addresses: list[dict[str, Address]] = [{} for _ in numbers.layers]
    for address, value in stack.values():
        if address.layer is not None and not isinstance(value, Varying):
            is_named = isinstance(value, Measured) and stack.kinds[address.layer] == "conductor"
            if not is_named and not (address.role in ("eta", "k") and any(stack.films)):
                addresses[address.layer][address.key] = address
    return [axis for layer, of in zip(numbers.layers, addresses) for axis in _of_layer(numbers, layer, of)]


def _of_layer(numbers: Material, layer: LayerValues, of: Mapping[str, Address]) -> Iterator[Axis]:
    """The axes of a layer, by the addresses of what may move of it."""
    spans = {key: span for key, span in SPANS.items() if key in of}
    together: dict[str, tuple[Address, ...]] = {key: (of[key],) for key in spans}
    times: dict[str, str] = {}
    if isinstance(layer, InterfaceValues):
        if layer.alpha_u == layer.alpha_v:
            together["alpha_u"] += together.pop("alpha_v")
            del together["rotation"]
        elif sum(each.alpha_u != each.alpha_v for each in numbers.interfaces) == 1:
            spans["rotation"] = (*SPANS["rotation"][:2], 2)  # all turns
        if "eta" in of:
            spans["eta"] = (*(_between(numbers, layer) if layer.kind == "dielectric" else OF_METALS), SPANS["eta"][2])
    elif isinstance(layer, MediumValues):
        coefficients = "sigma_a", "sigma_s"
        for key in coefficients if layer.depth > 0 else ():
            low, high, count = SPANS[key]
            spans[key], times[key] = (low, high / float(layer.depth) ** 0.5, count), of["depth"].name
        lacks = {*coefficients} - {*times} | ({"sigma_s", "g"} if not np.any(layer.tau_s > 0) else set())
        together = {key: addresses for key, addresses in together.items() if key not in lacks}
    for key, addresses in together.items():
        own = np.asarray(getattr(layer, key), float)
        at, (low, high, count) = np.sqrt(own) if key in ROOTS else own, spans[key]
        if not key.startswith("alpha"):  # facets are never smoother
            low = min(low, float(at.min()))
        along = TextureAxis(addresses, low, max(high, float(at.max())), count, FINE)
        yield Axis(along, float(own.mean()), times.get(key))


def _between(numbers: Material, layer: InterfaceValues) -> tuple[float, float]:
    """The span of an index among those of other media."""
    media = [numbers.exterior, *(each.eta for each in numbers.interfaces if each.kind == "dielectric")]
    others, own = [float(np.mean(eta)) for eta in media], float(np.mean(layer.eta))
    low = max([SPANS["eta"][0], *(other + APART for other in others if other < own)])
    return low, min([SPANS["eta"][1], *(other - APART for other in others if other > own)])


def _solved(
    look: SolvedLookUp, stack: Stack, own: SolvedContents, axis: Axis
) -> tuple[Axis, list[SolvedContents]] | None:
    """An axis with the solutions at its nodes, as far as light takes the same ways as in the stack; None where that is
    at one node at most."""
    along, coarse = axis.along, len(look.nodes) > 1
    found = dict[int, SolvedContents]()

    def reach(numbers: Iterable[int]) -> None:
        for k in numbers:
            node = look.solve(stack.replace(**along.changed(along.values[k])), coarse=coarse, both=True)
            if not look.is_alike(own, node):
                return
            found[k] = node

    start = int(np.abs(np.array(along.values) - axis.own).argmin())
    reach(range(start, -1, -1))
    if start in found:
        reach(range(start + 1, along.count))
    if len(found) < 2:
        return None
    kept = sorted(found)
    low, high = np.linspace(along.low, along.high, along.count)[[kept[0], kept[-1]]].tolist()
    return replace(axis, along=replace(along, low=low, high=high, count=len(kept))), [found[k] for k in kept]


def _columns(look: SolvedLookUp, contents: SolvedContents) -> Array:
    """Columns, (rows, sides, cosines, azimuths), where shapes are kept, and after them what the chances leave."""
    rows = look.rows(contents).astype(float)
    left = 1 - rows[look.declaration.chances(RGB)].sum(axis=0, keepdims=True)
    rows = np.concatenate([rows, np.maximum(left, 0)])
    cosines, azimuths = PLANE if len(look.nodes) > 1 else (COSINES, 1)
    for axis, count in ((2, cosines), (3, azimuths)):
        places = np.linspace(0, rows.shape[axis] - 1, count)
        cell = np.minimum(places.astype(int), max(rows.shape[axis] - 2, 0))
        share = (places - cell).reshape(-1, *(1,) * (3 - axis))
        above = np.minimum(cell + 1, rows.shape[axis] - 1)
        rows = (1 - share) * rows.take(cell, axis) + share * rows.take(above, axis)
    return rows


def _along(axis: Axis, nodes: Sequence[SolvedContents], columns: Array) -> Answer:
    """The shares and shapes of columns (nodes, rows, ...) along an axis, with diffuse colours and layouts."""
    along, flat = axis.along, (columns - columns[0]).reshape(len(columns), -1)
    shares, sizes, shapes = np.linalg.svd(flat, full_matrices=False)
    lacks = np.sqrt(np.append(np.cumsum((sizes**2)[::-1])[::-1], 0) / flat.size)
    count = int(np.argmax(lacks < CLOSE))
    # Whole numbers, by which all shapes have errors of one size
    weighed = shares[:, :count] * sizes[:count]
    level = CLOSE / np.maximum(np.ptp(weighed, axis=0), ops.TINY)
    levels = np.round(shapes[:count] / level[:, None])
    numbers = np.array([np.concatenate([node.remainder.ravel(), node.layout]) for node in nodes], float)
    return {
        "names": [address.name for address in along.addresses],
        "times": axis.times,
        "colour": axis.colour,
        "spreads": axis.spreads,
        "root": along.addresses[0].role in ROOTS,
        "low": along.low,
        "high": along.high,
        "shares": array(along.refined(weighed * level, 0)),
        "shapes": array(levels.reshape(count, *columns.shape[1:]), "int16"),
        "numbers": array(along.refined(numbers, 0)),
    }
