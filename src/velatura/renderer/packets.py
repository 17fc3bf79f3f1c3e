"""Values of several functions at the nodes of a grid, as a renderer of Dr.Jit fetches them: several at once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from threading import Lock
from typing import Any, ClassVar

import numpy as np

WIDTH = 8  # values that are fetched at once, at most; a power of two
ALIGNED = 16  # values between addresses that the widest instructions read from

_uploading = Lock()


@dataclass(frozen=True, eq=False)
class Packets:
    """Flat values, `stride` of one node after those of another, of which the first `count` count."""

    values: Any
    stride: int
    count: int

    @property
    def parts(self) -> Iterator[tuple[int, int]]:
        """Where values that are fetched together begin at a node, and how many they are: a power of two."""
        for begin in range(0, self.count, WIDTH):
            yield begin, 1 << (min(self.count - begin, WIDTH) - 1).bit_length()


class SampledGrid:
    """Values at the nodes of a grid, `data` with channels on the last axis; a Dr.Jit module gets them at first use."""

    data: np.ndarray
    first: ClassVar[int] = 0
    _packets: dict[Any, Packets]

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the grid, without the channels."""
        return self.data.shape[:-1]

    def packets(self, dialect: Any) -> Packets:
        """The values for a Dr.Jit module (`drjit.llvm.ad`, say)."""
        with _uploading:
            if dialect not in self._packets:
                self._packets[dialect] = packets(self.data.ravel(), self.data.shape[-1], dialect)
            return self._packets[dialect]


def packets(flat: Any, count: int, dialect: Any, double: bool = False) -> Packets:
    """All `count` channels of a flat array of NumPy or Dr.Jit, where those of one node follow those of another;
    differentiable.

    `dialect` is the module of Dr.Jit; values of NumPy are in single precision there, or `double`. While it records a
    kernel, arrays must be those of NumPy.
    """
    stride = -(-count // WIDTH) * WIDTH if count > WIDTH else 1 << (count - 1).bit_length()
    nodes, k = np.arange(0, len(flat), count)[:, None], np.minimum(np.arange(stride), count - 1)
    places = (nodes + k).ravel()
    if not isinstance(flat, np.ndarray):
        import drjit as dr

        values = dr.gather(type(flat), flat, dialect.UInt32(aligned(places, np.uint32)))
        dr.eval(values)
        return Packets(values, stride, count)
    number, dtype = (dialect.Float64, np.float64) if double else (dialect.Float, np.float32)
    return Packets(number(aligned(flat[places], dtype)), stride, count)


def aligned(flat: np.ndarray, dtype: Any = np.float32) -> np.ndarray:
    """A copy, in single precision, at an address that any instruction reads from.

    Dr.Jit reads arrays of NumPy where they lie; at other addresses value by value, and by another kernel.
    """
    held: np.ndarray = np.empty(len(flat) + ALIGNED, dtype)
    begin = -(held.ctypes.data // held.itemsize) % ALIGNED
    held[begin : begin + len(flat)] = flat
    return held[begin : begin + len(flat)]
