"""Functions of the direction of one material, sampled once, so that all of them are one fetch."""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import pi, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer.low_discrepancy import integers
from velatura.renderer.packets import Packets, packets

LINE = (512,)  # nodes, where functions depend on the cosine alone
SAME = 1e-12  # ratio, from 1, of values of functions that are one
SINE_MIN = 1e-6  # so that there is an azimuth at the normal
PLANE = (64, 33)  # nodes over the cosine and the azimuth; the latter one more than a multiple of four


@dataclass(frozen=True, eq=False)
class Curves:
    """Values at the nodes: packets of Dr.Jit, or an array of NumPy, with channels on the last axis. They may hold other
    grids besides; this one begins at the node of a number."""

    data: Any
    shape: tuple[int, ...]
    first: Value = 0

    def grids(self, shape: tuple[int, ...]) -> list[Curves]:
        """Each of the grids of a shape that a table has one after the other."""
        return [Curves(self.data, shape, begin) for begin in range(0, prod(self.shape), prod(shape))]

    def packets(self, dialect: Any) -> Packets:
        found: Packets = self.data
        return found

    def only(self, channels: Sequence[int]) -> Curves:
        """Some of the functions, of NumPy."""
        return Curves(self.data[..., channels], self.shape)

    def __call__(self, w: Direction, *others: Value) -> list[Value]:
        """Values for a direction, and coordinates from 0 to 1 on axes that come after those of directions."""
        interpolate = ops.interpolate_in_simplices if others else ops.interpolate
        return interpolate(self, *places(w, len(self.shape) - len(others)), *others)


@dataclass(frozen=True)
class Packing:
    """Functions in several tables: `tables` are the numbers of those that each one has, and `places` those of all
    functions among what is read. Those that are the same are one."""

    tables: tuple[tuple[int, ...], ...]
    places: tuple[int, ...]

    @classmethod
    def of(cls, rows: NDArray[np.floating], groups: Sequence[int], shared: bool = True) -> Packing:
        """Packing of values (rows, ...), each group in a table of its own; `shared` where the same ones are one."""
        first: dict[Any, int] = {}
        own = [*range(len(rows))]
        for k, row in enumerate(rows if shared else ()):
            like = first.setdefault((groups[k], row.astype(np.float32).tobytes()), k)
            # Those that are alike by chance, to single precision, would have another kernel than their neighbours
            if (np.abs(row - rows[like]) <= SAME * np.abs(row)).all():
                own[k] = like
        tables = [tuple(k for k in sorted({*own}) if groups[k] == group) for group in sorted({*groups})]
        order = [k for table in tables for k in table]
        return cls(tuple(tables), tuple(map(order.index, own)))

    def split(self, values: NDArray[np.floating], axis: int = 0) -> list[NDArray[np.floating]]:
        """The values of each table, with functions along an axis."""
        return [np.take(values, table, axis) for table in self.tables]

    def curves(self, tables: Iterable[Curves]) -> Packed:
        return Packed(tuple(tables), self.places)


@dataclass(frozen=True, eq=False)
class Packed:
    """Functions in several tables. A renderer fetches those that it uses one of."""

    tables: tuple[Curves, ...]
    places: tuple[int, ...]

    def __call__(self, w: Direction, *others: Value) -> list[Value]:
        """Values, like those of `Curves`."""
        return self._placed(table(w, *others) for table in self.tables)

    def either(self, other: Packed, where: Value) -> Packed:
        """These functions where a condition holds, else others that lie in the same tables."""
        firsts = (ops.select(where, a.first, b.first) for a, b in zip(self.tables, other.tables))
        return replace(self, tables=tuple(replace(a, first=first) for a, first in zip(self.tables, firsts)))

    def at(self, *coordinates: Value) -> list[Value]:
        """Values for coordinates from 0 to 1 on all axes, those of directions included."""
        return self._placed(ops.interpolate_in_simplices(table, *coordinates) for table in self.tables)

    def _placed(self, tables: Iterable[list[Value]]) -> list[Value]:
        read = [x for table in tables for x in table]
        return [read[k] for k in self.places]


@dataclass(frozen=True, eq=False)
class Summed:
    """Functions that are sums of a few, which are `packed`: for each of these, its share of every function."""

    packed: Packed
    shares: Sequence[Sequence[Value]]

    def at(self, *coordinates: Value) -> list[Value]:
        """Values, like those of `Packed`."""
        first, *others = zip(self.packed.at(*coordinates), self.shares)
        found = [first[0] * share for share in first[1]]
        for x, shares in others:
            found = [total + x * share for share, total in zip(shares, found)]
        return found


def directions(shape: tuple[int, ...], number: type | None) -> Direction:
    """Directions at nodes, by Dr.Jit's type of numbers (None for NumPy, not to be written to). Shape: (cosines,) or
    (cosines, azimuths)."""
    return _in_numpy(shape) if number is None else _directions(shape, number)


@functools.lru_cache(maxsize=16)
def _in_numpy(shape: tuple[int, ...]) -> Direction:
    found = _directions(shape, None)
    for each in found:
        each.flags.writeable = False
    return found


def _directions(shape: tuple[int, ...], number: type | None) -> Direction:
    index, real = integers(prod(shape), number)
    turns = prod(shape[1:])
    return direction(real(index // turns) / (shape[0] - 1), real(index % turns) / max(turns - 1, 1))


def direction(x: Value, t: Value) -> Direction:
    """The direction at coordinates from 0 to 1: the root of its cosine, and its azimuth, defined at the normal too."""
    cosine, phi = x * x, _to_azimuth(t)
    sine = ops.maximum(ops.sqrt(1 - cosine * cosine), SINE_MIN)
    return sine * ops.cos(phi), sine * ops.sin(phi), cosine


def places(w: Direction, axes: int) -> list[Value]:
    """The coordinates of a direction, on one axis or two."""
    return [ops.sqrt(w[2]), *([_from_azimuth(w[0], w[1])] if axes > 1 else [])]


def curves(columns: Sequence[Value], shape: tuple[int, ...], number: type | None) -> Curves:
    """Functions by their values at the nodes; differentiable."""
    count = prod(shape)
    if number is None:
        return interleaved(np.stack([np.broadcast_to(column, count) for column in columns], axis=-1), shape, None)
    import drjit as dr

    dialect: Any = sys.modules[number.__module__]
    none: Any = dr.zeros(number, count)
    columns = [none + column for column in columns]
    dr.eval(columns)
    # Interleave
    flat: Any = dr.zeros(number, count * len(columns))
    row = dr.arange(dialect.UInt32, count) * len(columns)
    for k, column in enumerate(columns):
        dr.scatter(flat, column, row + k)
    return interleaved(flat, shape, number)


def interleaved(flat: Any, shape: tuple[int, ...], number: type | None) -> Curves:
    """Functions by a flat array of their values, those of one node after those of another; differentiable."""
    if number is None:
        return Curves(np.reshape(flat, (*shape, -1)), shape)
    if not isinstance(flat, np.ndarray):
        import drjit as dr

        dr.eval(flat)
    return Curves(packets(flat, len(flat) // prod(shape), sys.modules[number.__module__]), shape)


# Azimuths from 0 to pi as 0 to 1, without trigonometry: along the sides of a square instead of a circle


def _from_azimuth(x: Value, y: Value) -> Value:
    c, s = x * x - y * y + ops.TINY, 2 * x * y  # 0 at the normal
    p = ops.divide(c, ops.absolute(c) + ops.absolute(s))
    return 0.25 * ops.select(s < 0, 3 + p, 1 - p)


def _to_azimuth(t: Value) -> Value:
    back = t > 0.5
    p = ops.select(back, 4 * t - 3, 1 - 4 * t)
    s = 1 - ops.absolute(p)
    return 0.5 * ops.arctan2(ops.select(back, -s, s), p) + ops.select(back, pi, 0.0)
