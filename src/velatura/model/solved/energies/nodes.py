"""Nodes of the length of tangential momentum, and how light is shared among them.

Lengths run from 0 to the highest index. They are divided where a medium ends, since there total reflection sets in, and
every part has nodes in a variable in which what interfaces do is smooth: near an index n like sqrt(n^2 - p^2). Light of
any length goes to the four nodes about it by Lagrange's polynomials, which keep its energy and three more moments.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.ops import Value

Array = NDArray[np.floating]

CLOSE = 1.0001  # ratio of indices that share an end
PARTS = 8  # at most: where there are more, media share ends that lie apart by the least power of
WIDER = 1.04
INNER = 0.6  # share of nodes below the lowest index
FURTHER = 1  # nodes more for each further medium, so that light hardly jumps where a part gets one of another
STENCIL = 4
QUADRATURE = 4000


def _apart(indices: Sequence[float], close: float) -> list[int]:
    """Numbers of indices from the lowest that lie apart by a ratio."""
    found: list[int] = []
    for k in sorted(range(len(indices)), key=indices.__getitem__):
        if not found or indices[k] >= indices[found[-1]] * close:
            found.append(k)
    return found


@dataclass(frozen=True)
class Nodes:
    """Nodes on the parts [ends[0], ends[1]], ...; `cells` says how many intervals each part has."""

    ends: tuple[float, ...]
    cells: tuple[int, ...]

    @classmethod
    def of(cls, indices: Sequence[float], count: int, like: Sequence[float] | None = None) -> Nodes:
        """Nodes for media of such indices, about `count` for two. Given media `like` these, as many as for them on each
        part, so that results do not jump from one to the other, unless that leaves a part too short, or one medium
        within another's part, where no part ends at its total reflection."""
        if like is None or len(like) != len(indices):
            like = indices
        media, close = _apart(like, CLOSE), CLOSE
        while len(media) > PARTS:
            close *= WIDER
            media = _apart(like, close)
        ends, known = ([0.0, *(float(n[k]) for k in media[:-1]), float(max(n))] for n in (indices, like))
        if len(_apart(indices, close)) > len(media) or any(b < a * CLOSE for a, b in pairwise(ends[1:])):
            return cls.of(indices, count)
        if len(ends) == 2:
            return cls(tuple(ends), (count - 1,))
        inner = int(INNER * count)
        lengths = [np.sqrt(1 - (a / b) ** 2) for a, b in pairwise(known[1:])]
        left = (count - inner + FURTHER * (len(lengths) - 1)) / sum(lengths)
        outer = [max(STENCIL - 1, round(left * length)) for length in lengths]
        return cls(tuple(ends), (inner - 1, *outer))

    @cached_property
    def p(self) -> Array:
        """Lengths at the nodes, (N,), from 0."""
        parts = [self.ends[1] * np.sin(np.linspace(0, np.pi / 2, self.cells[0] + 1))]
        for lo, hi, cells in zip(self.ends[1:-1], self.ends[2:], self.cells[1:]):
            u = np.linspace(0, np.pi, cells + 1)[1:]
            parts.append(np.sqrt(lo * lo + (hi * hi - lo * lo) * 0.5 * (1 - np.cos(u))))
        return np.concatenate(parts)

    @property
    def count(self) -> int:
        return sum(self.cells) + 1

    def shares(self, p: Array) -> tuple[NDArray[np.integer], Array, NDArray[np.bool_]]:
        """Nodes (4, ...) that light of length p goes to, its shares, and which of them lie on the far side of 0."""
        index, shares = self.stencils(p)
        index = np.moveaxis(index, -1, 0)
        beyond = index == self.count
        return np.where(beyond, 1, index), np.moveaxis(shares, -1, 0), beyond

    def stencils(self, p: Array) -> tuple[NDArray[np.integer], Array]:
        """Nodes (..., 4) that light of length p goes to, and its shares; that of number `count` is node 1 on the far
        side of 0."""
        first, shares = self.stencil(p, self.numbers)
        index = np.asarray(first).astype(np.int32)[..., None] + np.arange(STENCIL, dtype=np.int32)
        return np.where(index < 0, self.count, index), np.stack(shares, axis=-1)

    @cached_property
    def numbers(self) -> list[float]:
        """Numbers for `stencil`: the inner ends, and of each part the square of its beginning, the inverse of its
        length in squares, its cells, and the number of its first node."""
        squares, cells = np.square(self.ends), np.array(self.cells, float)
        before = np.r_[0, np.cumsum(cells)[:-1]]
        parts = squares[:-1], 1 / np.diff(squares), cells, before
        return [*self.ends[1:-1], *np.concatenate(parts).tolist()]

    def stencil(self, p: Value, numbers: Sequence[Value]) -> tuple[Value, list[Value]]:
        """The first of the nodes that light of length p goes to, from -1, and its shares, by `numbers`, on any dialect.

        Lagrange's polynomials of four nodes.
        """
        count = len(self.cells)
        ends, parts = numbers[: count - 1], numbers[count - 1 :]
        beyond = [p > end for end in ends]

        def of_part(k: int) -> Value:
            found, *others = parts[k * count : (k + 1) * count]
            for there, value in zip(beyond, others):
                found = ops.select(there, value, found)
            return found

        begin2, inverse, cells, before = map(of_part, range(4))
        share = ops.clip((p * p - begin2) * inverse, 0.0, 1.0)
        u = ops.arctan2(ops.sqrt(share), ops.sqrt(1 - share)) * (cells * (2 / np.pi))
        # The first part goes on beyond 0
        lowest = ops.select(beyond[0], 0.0, -1.0) if beyond else -1.0
        start = ops.clip(ops.floor(ops.minimum(u, cells - 1)) - 1, lowest, cells - (STENCIL - 1))
        t = u - start
        t_1, t_2, t_3 = t - 1, t - 2, t - 3
        outer, inner = t_2 * t_3 / 6, t * t_1 / 2
        return start + before, [-t_1 * outer, 3 * t * outer, -inner * t_3, inner * t_2 / 3]

    def weights(self, n: float) -> Array:
        """Integrals over p^2 in [0, n^2] of the functions that light is shared by, (N,); not to be written to."""
        return _weights(self, n)


@functools.lru_cache(maxsize=256)
def _weights(nodes: Nodes, n: float) -> Array:
    p2 = (np.arange(QUADRATURE) + 0.5) / QUADRATURE * n * n
    index, shares, _ = nodes.shares(np.sqrt(p2))
    found = np.bincount(index.ravel(), shares.ravel(), nodes.count) * (n * n / QUADRATURE)
    found.flags.writeable = False
    return found
