"""Axes of tables over what textures change."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, pi
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.films import textured as textured_films
from velatura.model.solved import monotone_cubic
from velatura.ops import Value
from velatura.stack import Address, Material

Array = NDArray[np.floating]
Range = tuple[Sequence[Address], float, float]  # values that one texture gives, its least and its greatest

WAVING = frozenset({"film_thickness_nm", "film_eta"})  # over which colours are waves: no table is coarser than others
WAVES_MAX = {1: 161, 2: 81}  # nodes of one, likewise,
WAVES_OF_TWO = 25  # and of each of two
NODES_MAX = {1: 17, 2: 7, 3: 7}  # by the number of axes of a table
BESIDE = 9  # nodes of an axis in a table beside one that others resolve
COARSE = 5  # nodes of an axis in a table that another one resolves
FINE = {1: 3, 2: 3, 3: 2}  # likewise, places of a table from one node to the next
FINE_WAVES = 4
ROOTS = frozenset(
    {"alpha_u", "alpha_v", "depth", "sigma_a", "sigma_s", "k", "film_k"}
)  # of which nodes are even in the root
STEPS = {"rotation": 22.5}
STEP = 0.1
COARSER = 1.2  # times, where there would be too many nodes
QUARTER = 90.0  # of a turn, to either side

#: What textures span that cannot be looked at, by role; values beyond take the nearest.
UNKNOWN = {**dict.fromkeys(("depth", "sigma_a", "sigma_s"), (0.0, 6.25)), **textured_films.UNKNOWN}


@dataclass(frozen=True)
class TextureAxis:
    """The values that one texture gives, and the least and the greatest of its coordinates.

    A coordinate is a value, or the root of one, in which energies and widths vary smoothly. Nodes lie on a fixed
    lattice, so that a texture that changes by little keeps its axis.
    """

    addresses: tuple[Address, ...]
    low: float
    high: float
    count: int
    fine: int = FINE[2]

    @classmethod
    def of(cls, given: Range, together: int, step: float | None = None, waves_max: int = 0) -> TextureAxis:
        """The axis of a texture, in a table of so many axes; of waves, with a `step` between nodes, and so many of
        them at most."""
        addresses, *ends = given
        first = addresses[0]
        if first.key == "rotation":
            return cls(tuple(addresses), -QUARTER, QUARTER, round(2 * QUARTER / STEPS["rotation"]) + 1)
        least, most = (_coordinate(first, end) for end in first.declared.within)
        low, high = (_coordinate(first, end) for end in ends)
        step, waving = step or STEPS.get(first.key, STEP), first.role in WAVING
        nodes_max = waves_max if waving else NODES_MAX[together]
        while (nodes := _around(low, high, step))[1] - nodes[0] >= nodes_max:
            step *= COARSER
        # Slopes of waves are those of splines at either end, too
        begin, end = ((node + more * waving) * step for node, more in zip(nodes, (-1, 1)))
        if end > most:
            begin, end = min(begin, most - step), most
        begin = max(begin, least)
        fine = FINE_WAVES if waving else FINE[together]
        return cls(tuple(addresses), float(begin), float(end), max(2, round((end - begin) / step) + 1), fine)

    @property
    def middle(self) -> float:
        return float(self._values(np.array(0.5 * (self.low + self.high))))

    @property
    def middle_node(self) -> int:
        """Number of the node in the middle, of an odd number of nodes."""
        return self.count // 2

    def with_middle(self, most: int) -> TextureAxis:
        """The axis with as many nodes at most, an odd number of them."""
        if self.waves:
            return replace(self, count=self.count | 1)
        return replace(self, count=min(self.count | 1, most), fine=FINE[2])

    @property
    def waves(self) -> bool:
        """Whether it is a thickness of films, or their index."""
        return self.addresses[0].role in WAVING

    def covers(self, other: TextureAxis | Wavelengths) -> bool:
        return (
            isinstance(other, TextureAxis)
            and self.addresses == other.addresses
            and self.low <= other.low
            and other.high <= self.high
        )

    @property
    def values(self) -> list[float]:
        """Values at the nodes."""
        found: list[float] = self._values(np.linspace(self.low, self.high, self.count)).tolist()
        return found

    def _values(self, coordinates: Array) -> Array:
        return coordinates**2 if self.addresses[0].role in ROOTS else coordinates

    @property
    def places(self) -> int:
        return self.fine * (self.count - 1) + 1

    def at(self, material: Material) -> Value:
        """The place of a material's value, from 0 to 1."""
        address = self.addresses[0]
        x = _coordinate(address, material.flat()[address.name])
        if address.key == "rotation":
            double = x * (pi / QUARTER)
            x = ops.arctan2(ops.sin(double), ops.cos(double)) * (QUARTER / pi)
        return (x - self.low) / (self.high - self.low)

    def changed(self, x: float) -> dict[str, float]:
        """Values by flat name, at one of the axis."""
        return {address.name: x for address in self.addresses}

    def refined(self, values: Array, axis: int) -> Array:
        """Values at the nodes, at all places."""
        from scipy.interpolate import CubicSpline  # slow to import

        nodes = np.linspace(0, 1, self.count)
        return np.asarray(CubicSpline(nodes, values, axis=axis)(np.linspace(0, 1, self.places)))


@dataclass(frozen=True)
class Wavelengths:
    """Values at some places on the spectrum from 0 to 1, of all that depends on wavelength alone, by flat name; the
    fixed wavelengths come first. A material is solved at all of them at once, in channels: values are numbers of them,
    and None stands for all."""

    nodes: tuple[float, ...]
    nm: tuple[float, ...]
    spectra: tuple[tuple[str, tuple[float, ...]], ...]

    addresses: ClassVar[tuple[Address, ...]] = ()
    places: ClassVar[int] = 64
    values: ClassVar[list[None]] = [None]
    middle: ClassVar[int] = ops.FIXED // 2
    middle_node = middle

    @property
    def count(self) -> int:
        return len(self.nodes)

    def with_middle(self, most: int) -> Wavelengths:
        return self

    def covers(self, other: TextureAxis | Wavelengths) -> bool:
        return self == other

    def refined(self, values: Array, axis: int) -> Array:
        nodes, first = np.unique(self.nodes, return_index=True)
        along = np.moveaxis(values.take(first, axis), axis, -1)
        places = np.linspace(0, 1, self.places)
        return np.moveaxis(monotone_cubic.interpolated(nodes, along, places), -1, axis)

    def changed(self, x: float | None) -> dict[str, Any]:
        return {name: values if x is None else values[int(x)] for name, values in self.spectra}


def _around(low: float, high: float, step: float) -> tuple[int, int]:
    """Numbers of the nodes below and above two coordinates, at least one step apart."""
    begin = floor(low / step + 1e-6)
    return begin, max(ceil(high / step - 1e-6), begin + 1)


def _coordinate(address: Address, value: Value) -> Value:
    return ops.sqrt(value) if address.role in ROOTS else value


def refined(values: Array, axes: Sequence[TextureAxis | Wavelengths]) -> Array:
    """Values at the nodes of all axes, (nodes, ...), at all places: the axes are the leading ones."""
    found = values.reshape(*(axis.count for axis in axes), *values.shape[1:])
    for k, axis in enumerate(axes):
        found = axis.refined(found, k)
    return found


def placed(material: Material, axes: Sequence[TextureAxis | Wavelengths], values: Iterable[Any]) -> Material:
    """A material of NumPy's values with others on some axes."""
    changed: dict[str, Any] = {}
    for axis, x in zip(axes, values):
        changed.update(axis.changed(x))
        if isinstance(axis, Wavelengths):
            material = replace(material, light=np.array(axis.nm if x is None else [axis.nm[int(x)]]))

    def value(address: Address, old: Any) -> Any:
        new = changed.get(address.name)
        return old if new is None else np.reshape(new, (-1, 1)) if address.colour else new

    return material.each(value)
