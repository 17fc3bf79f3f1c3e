"""Matrices on the nodes, dense (C, F, n, n) or of blocks along the diagonal, for C colours and F families.

Smooth interfaces and media that do not scatter scale light (blocks of one node). Beside brushed interfaces, all other
layers treat each mode of the azimuth by itself (blocks of all nodes).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

ALONE = 2**18  # multiplications that OpenBLAS leaves to one thread
ROWS = 40  # of a block of larger products, about as many as columns
LARGE = 100  # rows of a matrix of which it shares the inverse among threads


@dataclass(frozen=True)
class Blocks:
    """A matrix that acts on each of B blocks of m rows alone, by values (C, F, B, m, m), n = B m."""

    values: Array

    @classmethod
    def diagonal(cls, values: Array) -> Blocks:
        """A matrix that scales by (C, F, n)."""
        return cls(values[..., None, None])

    @property
    def width(self) -> int:
        """Rows of a block."""
        return self.values.shape[-1]

    @property
    def count(self) -> int:
        return self.values.shape[-3]

    @property
    def rows(self) -> int:
        return self.count * self.width

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, colours: NDArray[np.integer]) -> Blocks:
        return Blocks(self.values[colours])

    def wider(self, width: int) -> Blocks:
        """The same matrix, of wider blocks."""
        if self.width == width:
            return self
        values = np.zeros((*self.values.shape[:2], self.rows // width, width, width))
        inner = self.values.reshape(*values.shape[:3], -1, self.width, self.width)
        for k in range(inner.shape[3]):
            place = slice(k * self.width, (k + 1) * self.width)
            values[..., place, place] = inner[..., k, :, :]
        return Blocks(values)

    @property
    def dense(self) -> Array:
        return self.wider(self.rows).values[:, :, 0]


Matrix = Array | Blocks


def product(first: Matrix, second: Matrix) -> Matrix:
    """The product of matrices."""
    for each in (first, second):
        if isinstance(each, Blocks) and not each.values.any():
            return each
    if not isinstance(second, Blocks):
        return applied(first, second)
    if not isinstance(first, Blocks):
        return composed(first, second)
    width = max(first.width, second.width)
    if width == 1:
        return Blocks(first.values * second.values)
    return Blocks(first.wider(width).values @ second.wider(width).values)


def applied(matrix: Matrix, columns: Array) -> Array:
    """A matrix times columns (C, F, n, M)."""
    if not isinstance(matrix, Blocks):
        return _dense(matrix, columns)
    each = columns.reshape(*columns.shape[:2], matrix.count, matrix.width, columns.shape[-1])
    found = matrix.values * each if matrix.width == 1 else matrix.values @ each
    return found.reshape(*found.shape[:2], *columns.shape[-2:])


def composed(rows: Array, matrix: Matrix) -> Array:
    """Rows (C, F, K, n) times a matrix."""
    if not isinstance(matrix, Blocks):
        return _dense(rows, matrix)
    transposed = Blocks(matrix.values.swapaxes(-1, -2))
    return applied(transposed, rows.swapaxes(-1, -2)).swapaxes(-1, -2)


def total(first: Matrix, second: Matrix) -> Matrix:
    """The sum of matrices."""
    if isinstance(first, Blocks) and isinstance(second, Blocks):
        width = max(first.width, second.width)
        return Blocks(first.wider(width).values + second.wider(width).values)
    return np.asarray(sum(each.dense if isinstance(each, Blocks) else each for each in (first, second)))


def scaled(matrix: Matrix, share: float) -> Matrix:
    return Blocks(share * matrix.values) if isinstance(matrix, Blocks) else share * matrix


def family(matrix: Matrix) -> Matrix:
    """The part that acts on the first family."""
    return Blocks(matrix.values[:, :1]) if isinstance(matrix, Blocks) else matrix[:, :1]


def repeated(matrix: Matrix, lost: float) -> Matrix:
    """The sum of all powers of a matrix, (1 - A)^-1, with a share lost each time."""
    if isinstance(matrix, Blocks):
        if matrix.width == 1:
            return Blocks(1 / (1 + lost - matrix.values))
        return Blocks(_inverse((1 + lost) * np.eye(matrix.width) - matrix.values))
    return _inverse((1 + lost) * np.eye(matrix.shape[-1]) - matrix)


def _dense(matrix: Array, columns: Array) -> Array:
    """Block by block: larger products BLAS would share among threads, which wait for a busy machine."""
    count, width = matrix.shape[-2], columns.shape[-1]
    if count * width * matrix.shape[-1] <= ALONE:
        return np.asarray(matrix @ columns)
    rows = min(ROWS, count)
    across = max(ALONE // (rows * matrix.shape[-1]), 1)
    found = np.empty((*np.broadcast_shapes(matrix.shape[:-2], columns.shape[:-2]), count, width))
    for i in range(0, count, rows):
        for k in range(0, width, across):
            place = found[..., i : i + rows, k : k + across]
            np.matmul(matrix[..., i : i + rows, :], columns[..., k : k + across], out=place)
    return found


def _inverse(matrix: Array) -> Array:
    """Inverses, by blocks where LAPACK would share one among threads."""
    half = matrix.shape[-1] // 2
    if 2 * half < LARGE:
        return np.asarray(np.linalg.inv(matrix))
    (a, b), (c, d) = ((rows[..., :half], rows[..., half:]) for rows in (matrix[..., :half, :], matrix[..., half:, :]))
    first = _inverse(a)
    there, back = _dense(first, b), _dense(c, first)
    last = _inverse(d - _dense(c, there))
    right = -_dense(there, last)
    upper = np.concatenate([first - _dense(right, back), right], axis=-1)
    return np.concatenate([upper, np.concatenate([-_dense(last, back), last], axis=-1)], axis=-2)
