"""Modes of the azimuth of light.

Layers that look alike all around treat every mode by itself, relative to the azimuth that light came with
(`Relative`). In stacks with brushed interfaces (`Even`), even modes act on one another; odd ones do not act on
energies, since a stack does not distinguish a direction from its opposite. The more an interface is brushed the more
modes it needs; each one fades in, so that light does not jump.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model.rough_interface import Scatter
from velatura.model.solved.energies.matrices import Blocks
from velatura.model.solved.energies.nodes import Nodes
from velatura.model.solved.energies.operators import Operator
from velatura.model.solved.guards import MOMENTUM_MIN
from velatura.ops import Value
from velatura.renderer import compiled
from velatura.renderer.compiled import Alike, Deposit, Found, Number

Array = NDArray[np.floating]

#: Ratios of two roughnesses from which one more order of the azimuth fades in, and from which it is needed as a whole.
RATIOS = ((1.6, 2.0), (4.5, 5.5), (9.0, 11.0))
SQUARE = 1e-6  # of a right angle, within which two axes are at one
ROOT = float(np.sqrt(2))


class Basis(ABC):
    """Coefficients of light: measures are (C, families, n, sources), n rows being nodes, or modes times nodes.

    Attributes:
        nodes: those of the length of momentum.
        azimuths: at which light from the nodes meets an interface, (J,), from its first axis.
    """

    nodes: Nodes
    azimuths: Array

    @property
    @abstractmethod
    def deposits(self) -> Hashable:
        """All that `deposited` depends on, but for the ends of the nodes."""

    @property
    @abstractmethod
    def kind(self) -> Hashable:
        """All that `angular` depends on."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Rows and columns of a matrix, n."""

    @abstractmethod
    def relative(self, phi: Array, rotation: float) -> Array:
        """Azimuths of beams from the first axis of an interface."""

    @abstractmethod
    def angular(self, cosine: Value, sine: Value) -> list[Value]:
        """The modes at an azimuth."""

    @property
    @abstractmethod
    def odd(self) -> list[bool]:
        """Whether modes change sign in half a turn."""

    def deposited(
        self,
        scatter: Scatter,
        p: Array,
        psi: Array,
        samples: Sequence[Array],
        numbers: Sequence[Any],
        kind: Hashable,
    ) -> tuple[list[Array], Array]:
        """Sums over the samples of sources of lengths p at azimuths psi (S,): of each light the K weights by mode and
        node, (K, modes, N, S), and of other values, (L, S). `kind` is all that `scatter` depends on beside numbers."""
        parts = self.nodes.numbers

        def function(sources: Sequence[Value], lattice: Sequence[Value], values: Any) -> Found:
            known, own = values
            lights, others = scatter(sources, lattice, own)

            def deposit(light: Sequence[Value]) -> Deposit:
                x, y, *weights = light
                length, cosine, sine = _polar(x, y)
                first, shares = self.nodes.stencil(length, known)
                return Deposit(first, shares, weights, self.angular(cosine, sine))

            each = ([light.x, light.y, *light.weights] for light in lights)
            return Found(others, (), [Alike([*group], deposit) for _, group in groupby(each, len)])

        kind = kind, self.kind, len(self.nodes.cells)
        others, _, lights = compiled.over(
            function, (p, psi), samples, ([*map(Number, parts)], numbers), self.nodes.count, kind
        )
        # What lies on the far side of 0
        sign = np.where(self.odd, -1, 1)[:, None]
        for light in lights:
            light[:, :, 1] += sign * light[:, :, -1]
        return [np.ascontiguousarray(light[:, :, :-1]) for light in lights], others

    @property
    @abstractmethod
    def symmetric(self) -> Relative:
        """The modes of layers that look alike all around."""

    @abstractmethod
    def of_symmetric(self, layer: Operator, phi: Array) -> Operator:
        """An operator of the `symmetric` modes, for beams at azimuths phi (M,)."""

    @abstractmethod
    def operators(self, light: Array, rotation: float) -> Array:
        """Matrices (C, families, n, n) of what becomes of light from the nodes, azimuth by azimuth, as deposited."""

    @abstractmethod
    def columns(self, light: Array, rotation: float) -> Array:
        """Light of single directions, (C, families, n, M), as deposited."""

    @abstractmethod
    def rows(self, values: Array, rotation: float) -> Array:
        """A share of light (C, J * N) by azimuth and node, as a functional (C, modes, N)."""

    @abstractmethod
    def outer(self, emitted: Array, taken: Array) -> Array:
        """Matrices that emit as (C, modes, N) what (C, modes, N) takes, or columns for what (C, M) takes of beams."""

    @abstractmethod
    def swung(self, light: Array, swing: float, there: Array, here: Array, phi: Array | None = None) -> Array:
        """Light of `outer` that goes on in the direction that it came in, by the sines `there` (N,) and `here`: with
        1 + swing (s cos(phi) + s^2 cos(2 phi)), s being their product. Of beams `phi` are the azimuths."""

    def diagonal(self, values: Array) -> Blocks:
        """Matrices that scale light at the nodes by (C, N)."""
        return Blocks.diagonal(np.tile(values, self.size // self.nodes.count)[:, None])

    @property
    def counted(self) -> Array:
        """Energies (n,) of the coefficients of the first family."""
        return np.repeat([1.0, 0.0], [self.nodes.count, self.size - self.nodes.count])


@dataclass(frozen=True)
class Relative(Basis):
    """The modes cos(m phi), each a family of its own, for layers that look alike all around.

    phi is relative to the azimuth of the source; `orders`, m, begin with 0 and rise.
    """

    nodes: Nodes
    orders: tuple[int, ...] = (0,)

    azimuths = np.zeros(1)

    @property
    def deposits(self) -> Hashable:
        return self.nodes.cells, self.orders

    @property
    def kind(self) -> Hashable:
        return Relative, self.orders

    @property
    def size(self) -> int:
        return self.nodes.count

    def relative(self, phi: Array, rotation: float) -> Array:
        return np.zeros_like(phi)

    def angular(self, cosine: Value, sine: Value) -> list[Value]:
        waves = [1.0, cosine]
        while len(waves) <= self.orders[-1]:
            waves.append(2 * cosine * waves[-1] - waves[-2])
        return [waves[m] for m in self.orders]

    @property
    def odd(self) -> list[bool]:
        return [m % 2 == 1 for m in self.orders]

    @property
    def symmetric(self) -> Relative:
        return self

    def of_symmetric(self, layer: Operator, phi: Array) -> Operator:
        return layer

    def columns(self, light: Array, rotation: float) -> Array:
        return light

    operators = columns

    def rows(self, values: Array, rotation: float) -> Array:
        return values[:, None]

    def outer(self, emitted: Array, taken: Array) -> Array:
        found = np.zeros((len(emitted), len(self.orders), self.nodes.count, taken.shape[-1]))
        found[:, 0] = emitted[:, 0, :, None] * taken.reshape(len(taken), 1, -1)
        return found

    def swung(self, light: Array, swing: float, there: Array, here: Array, phi: Array | None = None) -> Array:
        both = np.multiply.outer(there, here)
        waves = [0.5 * swing * (both**m if m < 3 else 0 * both) * light[:, 0] for m in self.orders[1:]]
        return np.stack([light[:, 0], *waves], axis=1)


@dataclass(frozen=True)
class Even(Basis):
    """Modes 1, sqrt(2) cos(m phi), sqrt(2) sin(m phi) of the azimuth, m = 2, 4, ..., of one family, modes first.

    Where all interfaces mirror light about the tangent (`mirrored`), sines do not act on energies, and are left out.
    Sources meet an interface at azimuths of one quarter of a turn: its axes mirror the others. Of the highest order and
    of the last azimuth there is a share `last`.
    """

    nodes: Nodes
    orders: tuple[int, ...] = (2,)
    mirrored: bool = False
    last: float = 1.0

    @classmethod
    def of(cls, nodes: Nodes, brushed: Sequence[tuple[float, float]], orders: int | None = None) -> Even:
        """The modes for interfaces of such ratios of their roughnesses, at least 1, and rotations: of that many orders
        at most, None for all."""
        most = max(ratio for ratio, _ in brushed)
        faded = [(most - low) / (high - low) for low, high in RATIOS if most > low][: orders and orders - 1]
        turns = [rotation / (np.pi / 2) for _, rotation in brushed]
        mirrored = bool(np.allclose(turns, np.round(turns), atol=SQUARE))
        return cls(nodes, tuple(range(2, 2 * len(faded) + 3, 2)), mirrored, min([1.0, *faded[-1:]]))

    @property
    def deposits(self) -> Hashable:
        return self.nodes.cells, self.orders, self.mirrored

    @property
    def kind(self) -> Hashable:
        return Even, self.orders, self.mirrored

    @property
    def waves(self) -> list[tuple[int, bool]]:
        """Orders of all modes but the first, and whether they are sines."""
        return [(m, sine) for m in self.orders for sine in ((False,) if self.mirrored else (False, True))]

    @property
    def modes(self) -> int:
        return 1 + len(self.waves)

    @property
    def size(self) -> int:
        return self.modes * self.nodes.count

    def relative(self, phi: Array, rotation: float) -> Array:
        return phi - rotation

    @property
    def azimuths(self) -> Array:  # type: ignore[override]
        return self.rule[0]

    @cached_property
    def rule(self) -> tuple[Array, Array]:
        """Azimuths and weights of Gauss' rule for means over a quarter of a turn, of two azimuths more than orders.

        With a share of the last entry of Jacobi's matrix (Golub 1969) it goes over into the rule of one azimuth less,
        and is as exact as that at least.
        """
        beside = np.full(len(self.orders) + 1, 0.5)
        beside[0] = ROOT / 2
        beside[-1] *= self.last
        cosines, vectors = np.linalg.eigh(np.diag(beside, 1) + np.diag(beside, -1))
        return 0.5 * np.arccos(cosines), vectors[0] ** 2

    @cached_property
    def _fading(self) -> Array:
        """Factors of the modes by which light takes to them, and comes from them."""
        found = np.ones(self.modes)
        found[[False, *(m == self.orders[-1] for m, _ in self.waves)]] = np.sqrt(self.last)
        return found

    def angular(self, cosine: Value, sine: Value) -> list[Value]:
        turn = cosine * cosine - sine * sine, 2 * cosine * sine
        turns = [turn]
        for _ in self.orders[1:]:
            c, s = turns[-1]
            turns.append((c * turn[0] - s * turn[1], c * turn[1] + s * turn[0]))
        return [1.0, *(ROOT * turns[self.orders.index(m)][sine] for m, sine in self.waves)]

    @property
    def odd(self) -> list[bool]:
        return [False] * self.modes

    @property
    def symmetric(self) -> Relative:
        return Relative(self.nodes, (0, *self.orders))

    def of_symmetric(self, layer: Operator, phi: Array) -> Operator:
        orders = self.symmetric.orders
        families = [0, *(orders.index(m) for m, _ in self.waves)]

        def by_mode(values: Array) -> Array:
            return np.broadcast_to(values, (len(values), len(orders), *values.shape[2:]))[:, families]

        if isinstance(layer.nodes, Blocks):
            values = by_mode(layer.nodes.values)
            nodes = Blocks(values.reshape(len(values), 1, -1, *values.shape[-2:]))
        else:
            nodes = Blocks(by_mode(layer.nodes)[:, None])
        columns = by_mode(layer.columns)
        columns = columns * self._basis(phi)[:, None] if columns.shape[-1] else columns
        return Operator(nodes, self._flat(columns), layer.beams)

    def columns(self, light: Array, rotation: float) -> Array:
        found = self._turned(rotation).T @ light.reshape(len(light), self.modes, -1)
        return self._flat(found.reshape(len(found), self.modes, self.nodes.count, -1))

    def operators(self, light: Array, rotation: float) -> Array:
        n, modes, (azimuths, weights) = self.nodes.count, self.modes, self.rule
        found = light.reshape(-1, modes, n, len(azimuths), n)
        matrix = (weights * self._basis(azimuths)) @ found
        # Cosines and sines do not mix, by the mirror symmetry of the axes
        if not self.mirrored:
            matrix *= (self._sines[:, None] == self._sines)[None, :, None, :, None]
        turn = self._turned(rotation).T
        matrix = turn @ (turn @ matrix.reshape(-1, modes, n * modes * n)).reshape(-1, modes * n, modes, n)
        return matrix.reshape(-1, 1, self.size, self.size)

    def rows(self, values: Array, rotation: float) -> Array:
        azimuths, weights = self.rule
        each = values.reshape(len(values), len(azimuths), self.nodes.count)
        basis = weights * self._basis(azimuths)
        basis[self._sines] = 0
        projected = np.einsum("cqn,bq->cbn", each, basis)
        return np.asarray(np.einsum("ax,can->cxn", self._turned(rotation), projected))

    def outer(self, emitted: Array, taken: Array) -> Array:
        rows = self._flat(emitted[..., None])
        if taken.ndim == 2:
            return rows * taken[:, None, None]
        return rows * self._flat(taken[..., None]).swapaxes(-1, -2)

    def swung(self, light: Array, swing: float, there: Array, here: Array, phi: Array | None = None) -> Array:
        count, colours = self.nodes.count, len(light)
        wave = 0.5 * swing * np.multiply.outer(there, here) ** 2 * light[:, 0, :count, : len(here)]
        of_second = [k for k, (m, _) in enumerate(self.waves, 1) if m == 2]
        if phi is not None:
            lit = np.zeros((colours, self.modes, count, len(here)))
            lit[:, of_second] = self._basis(phi)[of_second, None] * wave[:, None]
            return light + self._flat(lit)
        matrix = np.zeros((colours, self.modes, count, self.modes, count))
        for k in of_second:
            matrix[:, k, :, k] = wave
        return light + matrix.reshape(light.shape)

    def _flat(self, light: Array) -> Array:
        """Light (C, modes, N, M) as that of one family, (C, 1, n, M)."""
        return light.reshape(len(light), 1, self.size, -1)

    @property
    def _sines(self) -> NDArray[np.bool_]:
        return np.array([False, *(sine for _, sine in self.waves)])

    def _basis(self, azimuth: Array) -> Array:
        waves = [ROOT * (np.sin if sine else np.cos)(m * azimuth) for m, sine in self.waves]
        return np.stack([np.ones_like(azimuth), *waves])

    def _turned(self, rotation: float) -> Array:
        """Coefficients in a frame that is turned, faded."""
        found = np.eye(self.modes)
        for i, m in enumerate(self.orders):
            c, s = np.cos(m * rotation), np.sin(m * rotation)
            if self.mirrored:
                found[i + 1, i + 1] = c
            else:
                found[2 * i + 1 : 2 * i + 3, 2 * i + 1 : 2 * i + 3] = [[c, s], [-s, c]]
        return self._fading[:, None] * found


def _polar(x: Value, y: Value) -> tuple[Value, Value, Value]:
    """Lengths of momenta, and cosine and sine of their azimuths."""
    length = ops.sqrt(x * x + y * y)
    scale = 1 / ops.maximum(length, MOMENTUM_MIN)
    return length, x * scale, y * scale
