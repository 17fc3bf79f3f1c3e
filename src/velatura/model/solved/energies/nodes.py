"""Nodes of the length of tangential momentum, and how light is shared among them.

Lengths run from 0 to the highest index. They are divided where a medium ends, since there total reflection sets in, and
every part has nodes in a variable in which what interfaces do is smooth: near an index n like sqrt(n^2 - p^2). Light of
any length goes to the four nodes about it by Lagrange's polynomials, which keep its energy and three more moments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

CLOSE = 1.04  # ratio of indices that share an end
SHORT = 1.01  # ratio of the ends of a part at least
INNER = 0.6  # share of nodes below the lowest index
STENCIL = 4
QUADRATURE = 4000


@dataclass(frozen=True)
class Nodes:
    """Nodes on the parts [ends[0], ends[1]], ...; `cells` says how many intervals each part has."""

    ends: tuple[float, ...]
    cells: tuple[int, ...]

    @classmethod
    def of(cls, indices: Sequence[float], count: int, like: Sequence[float] | None = None) -> Nodes:
        """Nodes for media of such indices, about `count`. Given media `like` these, as many as for them on each
        part, so that results do not jump from one to the other, unless that leaves a part too short."""
        if like is None or len(like) != len(indices):
            like = indices
        media: list[int] = []
        for k in sorted(range(len(like)), key=like.__getitem__):
            if not media or like[k] >= like[media[-1]] * CLOSE:
                media.append(k)
        ends, known = ([0.0, *(float(n[k]) for k in media[:-1]), float(max(n))] for n in (indices, like))
        if any(b < a * SHORT for a, b in pairwise(ends[1:])):
            return cls.of(indices, count)
        if len(ends) == 2:
            return cls(tuple(ends), (count - 1,))
        inner = int(INNER * count)
        lengths = [np.sqrt(1 - (a / b) ** 2) for a, b in pairwise(known[1:])]
        outer = [max(STENCIL - 1, round((count - inner) * length / sum(lengths))) for length in lengths]
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
        ends, cells = np.array(self.ends), np.array(self.cells)
        # In many samples and few parts, the ends that light lies beyond are faster counted than searched
        part = np.zeros(np.shape(p), np.intp)
        for end in self.ends[1:-1]:
            part += p > end

        def of_part(values: Array) -> Array:
            return values[0] if len(cells) == 1 else values.take(part, mode="clip")

        squares = ends * ends
        share = np.clip((p * p - of_part(squares[:-1])) * of_part(1 / np.diff(squares)), 0, 1)
        u = np.arcsin(np.sqrt(share)) * of_part(2 / np.pi * cells)
        lowest, highest = np.r_[-1, np.zeros(len(cells) - 1)], cells - STENCIL + 1.0
        start = np.clip(np.floor(np.minimum(u, of_part(cells - 1.0))) - 1, of_part(lowest), of_part(highest))
        t = u - start
        t_1, t_2, t_3 = t - 1, t - 2, t - 3
        outer, inner = t_2 * t_3 / 6, t * t_1 / 2
        shares, index = np.empty((*np.shape(p), STENCIL)), np.empty((*np.shape(p), STENCIL), np.int32)
        for k, each in enumerate((-t_1 * outer, 3 * t * outer, -inner * t_3, inner * t_2 / 3)):
            shares[..., k] = each
        first = start.astype(np.int32) + of_part(np.r_[0, np.cumsum(cells)[:-1]].astype(np.int32))
        for k in range(STENCIL):
            index[..., k] = first + np.int32(k)
        index[..., 0] = np.where(first < 0, self.count, first)
        return index, shares

    def weights(self, n: float) -> Array:
        """Integrals over p^2 in [0, n^2] of the functions that light is shared by, (N,)."""
        p2 = (np.arange(QUADRATURE) + 0.5) / QUADRATURE * n * n
        index, shares, _ = self.shares(np.sqrt(p2))
        return np.bincount(index.ravel(), shares.ravel(), self.count) * (n * n / QUADRATURE)
