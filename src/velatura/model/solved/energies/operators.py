"""Operators on light: matrices on the nodes, and beside them single directions, exactly.

A beam is light of one direction that no rough interface has met, and no medium has scattered. Its length lies between
nodes, and so it is kept apart: what an operator makes of it is a share that stays in the beam and a column of light at
the nodes. That is an algebra of block triangular matrices, one for each beam, that share the block of the nodes. An
operator that beams do not reach, below the first rough interface, is made for none (M = 0), and leaves none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from velatura.model.solved.energies.matrices import (
    Blocks,
    Matrix,
    applied,
    composed,
    family,
    product,
    repeated,
    scaled,
    total,
)
from velatura.model.solved.guards import TRAPPED

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Operator:
    """`nodes`, a matrix (C, F, n, n), what becomes of light at the nodes; of beams, `columns` (C, F, n, M) and `beams`
    (C, 1, 1, M), for C colours, or 1 for all, and F independent families of modes.
    """

    nodes: Matrix
    columns: Array
    beams: Array

    @classmethod
    def nothing(cls, n: int, beams: int) -> Operator:
        return cls.of(Blocks.diagonal(np.zeros((1, 1, n))), np.zeros((1, 1, n, beams)))

    @classmethod
    def of(cls, nodes: Matrix, columns: Array) -> Operator:
        """An operator that leaves nothing in a beam."""
        return cls(nodes, columns, np.zeros((1, 1, 1, columns.shape[-1])))

    def of_colours(self, which: NDArray[np.integer]) -> Operator:
        """The operator for colours of these numbers, where it is not the same for all."""
        nodes = self.nodes if len(self.nodes) == 1 else self.nodes[which]
        columns, beams = (x if len(x) == 1 else x[which] for x in (self.columns, self.beams))
        return Operator(nodes, columns, beams)

    @property
    def light(self) -> Operator:
        """The operator on beams alone."""
        return replace(self, nodes=self.columns[..., :0])

    def __matmul__(self, first: Operator) -> Operator:
        nodes, columns = product(self.nodes, first.nodes), applied(self.nodes, first.columns)
        if self.columns.shape[-1] and first.columns.shape[-1]:
            return Operator(nodes, columns + self.columns * first.beams, self.beams * first.beams)
        return Operator.of(nodes, columns)

    def __add__(self, other: Operator) -> Operator:
        return Operator(total(self.nodes, other.nodes), self.columns + other.columns, self.beams + other.beams)

    def __rmul__(self, share: float) -> Operator:
        return Operator(scaled(self.nodes, share), share * self.columns, share * self.beams)

    def repeated(self, trapped: float = TRAPPED) -> Operator:
        """The sum of all of its powers, (1 - A)^-1, with a share lost each time."""
        # No light reaches what smooth interfaces trap for ever
        inverse = repeated(self.nodes, trapped)
        beams = 1 / np.maximum(1 - self.beams, trapped)
        return Operator(inverse, applied(inverse, self.columns) * beams, beams)


@dataclass(frozen=True)
class Functional:
    """Shares of light that K outcomes have: of the first family at the nodes (C, K, n), and of beams (C, K, M)."""

    nodes: Array
    beams: Array

    @classmethod
    def energy(cls, counted: Array, beams: int) -> Functional:
        """All energy: of light at the nodes what is `counted` (n,)."""
        return cls(counted[None, None], np.ones((1, 1, beams)))

    def __matmul__(self, first: Operator) -> Functional:
        nodes, beams = (composed(self.nodes[:, None], x)[:, 0] for x in (family(first.nodes), first.columns[:, :1]))
        if self.beams.shape[-1] and first.columns.shape[-1]:
            beams = beams + self.beams * first.beams[:, 0]
        return Functional(nodes, beams)

    @property
    def outcomes(self) -> Iterator[Array]:
        """Shares (C, M) of beams by outcome."""
        return iter(self.beams.swapaxes(0, 1))

    def __add__(self, other: Functional) -> Functional:
        return Functional(self.nodes + other.nodes, self.beams + other.beams)

    @classmethod
    def together(cls, found: Sequence[Functional]) -> Functional:
        """All outcomes of some."""
        return cls(_joined([each.nodes for each in found]), _joined([each.beams for each in found]))


def _joined(outcomes: Sequence[Array]) -> Array:
    """Shares (C, K, ...) of all outcomes, of as many colours as those of the most."""
    colours = max(map(len, outcomes))
    return np.concatenate([np.broadcast_to(each, (colours, *each.shape[1:])) for each in outcomes], axis=1)


@dataclass(frozen=True)
class Layer:
    """Operators of a layer, or of a stack of layers, on light from above (`r`, `t`) and on light from below."""

    r: Operator
    t: Operator
    r_below: Operator
    t_below: Operator

    def map(self, change: Callable[[Operator], Operator]) -> Layer:
        r, t = change(self.r), change(self.t)
        alike = self.r_below is self.r and self.t_below is self.t
        return Layer(r, t, r, t) if alike else Layer(r, t, change(self.r_below), change(self.t_below))

    def reversed(self) -> Layer:
        """The same turned over."""
        return Layer(self.r_below, self.t_below, self.r, self.t)

    def mixed(self, other: Layer, share: float) -> Layer:
        """A layer that does what another one does to a share of light."""
        both = zip(vars(self).values(), vars(other).values())
        return Layer(*((1 - share) * own + share * there for own, there in both))
