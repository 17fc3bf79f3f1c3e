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
INNER = 0.6  # share of nodes below the lowest index
STENCIL = 4
QUADRATURE = 4000


@dataclass(frozen=True)
class Nodes:
    """Nodes on the parts [ends[0], ends[1]], ...; `cells` says how many intervals each part has."""

    ends: tuple[float, ...]
    cells: tuple[int, ...]

    @classmethod
    def of(cls, indices: Sequence[float], count: int) -> Nodes:
        """About `count` nodes for media of such indices."""
        ends = [0.0]
        for n in sorted(indices):
            if len(ends) > 1 and n < ends[-1] * CLOSE:
                continue
            ends.append(float(n))
        ends[-1] = max(ends[-1], float(max(indices)))
        if len(ends) == 2:
            return cls(tuple(ends), (count - 1,))
        inner = int(INNER * count)
        lengths = [np.sqrt(1 - (a / b) ** 2) for a, b in pairwise(ends[1:])]
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
        ends, cells = np.array(self.ends), np.array(self.cells)
        first = np.concatenate([[0], np.cumsum(cells)[:-1]])
        # In many samples and few parts, the ends that light lies beyond are faster counted than searched
        part = np.zeros(np.shape(p), np.intp)
        for end in self.ends[1:-1]:
            part += p > end
        lo, size = ends[part] ** 2, (ends[1:] ** 2 - ends[:-1] ** 2)[part]
        share = np.clip((p * p - lo) / size, 0, 1)
        u = np.arcsin(np.sqrt(share)) * (2 / np.pi * cells)[part]
        start = np.minimum(u.astype(int), cells[part] - 1) - 1
        start = np.clip(start, np.where(part > 0, 0, -1), cells[part] - STENCIL + 1)
        t = u - start
        t_1, t_2, t_3 = t - 1, t - 2, t - 3
        outer, inner = t_2 * t_3, t * t_1
        shares = np.stack([-t_1 * outer / 6, t * outer / 2, -inner * t_3 / 2, inner * t_2 / 6])
        index = start + np.arange(STENCIL).reshape(-1, *(1,) * np.ndim(p))
        beyond = index < 0
        return first[part] + np.abs(index), shares, beyond

    def weights(self, n: float) -> Array:
        """Integrals over p^2 in [0, n^2] of the functions that light is shared by, (N,)."""
        p2 = (np.arange(QUADRATURE) + 0.5) / QUADRATURE * n * n
        index, shares, _ = self.shares(np.sqrt(p2))
        return np.bincount(index.ravel(), shares.ravel(), self.count) * (n * n / QUADRATURE)

    def interpolated(self, values: Array, p: Array, odd: bool = False) -> Array:
        """A function given at the nodes, (..., N), at lengths p; `odd` in p, where it is not even."""
        index, shares, beyond = self.shares(p)
        sign = np.where(beyond, -1.0, 1.0) if odd else 1.0
        return np.asarray((values[..., index] * (sign * shares)).sum(axis=-1 - np.ndim(p)))
