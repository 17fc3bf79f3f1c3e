"""Modes of the azimuth of light.

Stacks of isotropic interfaces treat every mode by itself, relative to the azimuth that light came with (`Relative`).
In others (`Even`), modes 0 and 2 act on one another; odd ones do not act on energies, since a stack does not
distinguish a direction from its opposite.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from velatura.model.transport.nodes import Nodes

Array = NDArray[np.floating]

ROOT = np.sqrt(2)
TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class Light:
    """Samples of light: components of their momentum (sources, samples), and weights (C, sources, samples)."""

    x: Array
    y: Array
    weight: Array


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
    def size(self) -> int:
        """Rows and columns of a matrix, n."""

    @abstractmethod
    def relative(self, phi: Array, rotation: float) -> Array:
        """Azimuths of beams from the first axis of an interface."""

    @abstractmethod
    def operators(self, light: Light, rotation: float) -> Array:
        """Matrices (C, families, n, n) of what becomes of light from the nodes, azimuth by azimuth."""

    @abstractmethod
    def columns(self, light: Light, rotation: float) -> Array:
        """What becomes of single directions, (C, families, n, M)."""

    @abstractmethod
    def rows(self, values: Array, rotation: float) -> Array:
        """A share of light (C, J * N) by azimuth and node, as a functional (C, modes, N)."""

    @abstractmethod
    def outer(self, emitted: Array, taken: Array) -> Array:
        """Matrices that emit as (C, modes, N) what (C, modes, N) takes, or columns for what (C, M) takes of beams."""

    @abstractmethod
    def diagonal(self, values: Array) -> Array:
        """Matrices that scale light at the nodes by (C, N)."""

    @abstractmethod
    def energy(self, measure: Array) -> Array:
        """Energies (C, sources) of measures."""


@dataclass(frozen=True)
class Relative(Basis):
    """The modes cos(m phi), m = 0 to `count` - 1, each a family of its own, for isotropic interfaces.

    phi is relative to the azimuth of the source.
    """

    nodes: Nodes
    count: int = 1

    azimuths = np.zeros(1)

    @property
    def size(self) -> int:
        return self.nodes.count

    def relative(self, phi: Array, rotation: float) -> Array:
        return np.zeros_like(phi)

    def columns(self, light: Light, rotation: float) -> Array:
        cosine = light.x / np.maximum(np.hypot(light.x, light.y), TINY)
        angular = [np.ones_like(cosine), cosine, 2 * cosine * cosine - 1][: self.count]
        return _deposited(self.nodes, light, angular, [m % 2 == 1 for m in range(self.count)])

    operators = columns

    def rows(self, values: Array, rotation: float) -> Array:
        return values[:, None]

    def outer(self, emitted: Array, taken: Array) -> Array:
        found = np.zeros((len(emitted), self.count, self.nodes.count, taken.shape[-1]))
        found[:, 0] = emitted[:, 0, :, None] * taken.reshape(len(taken), 1, -1)
        return found

    def diagonal(self, values: Array) -> Array:
        return values[:, None, :, None] * np.eye(self.nodes.count)

    def energy(self, measure: Array) -> Array:
        return np.asarray(measure[:, 0].sum(axis=-2))


@dataclass(frozen=True)
class Even(Basis):
    """Modes 1, sqrt(2) cos(m phi), sqrt(2) sin(m phi) of the azimuth, m = 2, 4, ..., in one family, modes first.

    Sources meet an interface at azimuths of one quarter of a turn: its axes mirror the others.
    """

    nodes: Nodes
    orders: tuple[int, ...] = (2,)
    quarter: int = 3

    @property
    def modes(self) -> int:
        return 1 + 2 * len(self.orders)

    @property
    def size(self) -> int:
        return self.modes * self.nodes.count

    def relative(self, phi: Array, rotation: float) -> Array:
        return phi - rotation

    @property
    def azimuths(self) -> Array:  # type: ignore[override]
        return (np.arange(self.quarter) + 0.5) * np.pi / (2 * self.quarter)

    def columns(self, light: Light, rotation: float) -> Array:
        found = self._turned(rotation).T @ self._deposited(light).reshape(len(light.weight), self.modes, -1)
        return found.reshape(len(found), 1, self.modes * self.nodes.count, -1)

    def operators(self, light: Light, rotation: float) -> Array:
        n, modes, azimuths = self.nodes.count, self.modes, self.azimuths
        found = self._deposited(light).reshape(-1, modes, n, len(azimuths), n)
        matrix = np.einsum("cajqn,bq->cajbn", found, self._basis(azimuths)) / len(azimuths)
        # Cosines and sines do not mix, by the mirror symmetry of the axes
        sine = np.arange(modes) % 2 == 0
        sine[0] = False
        matrix *= (sine[:, None] == sine)[None, :, None, :, None]
        turn = self._turned(rotation)
        matrix = np.einsum("ax,cajbn,by->cxjyn", turn, matrix, turn)
        return matrix.reshape(len(matrix), 1, modes * n, modes * n)

    def rows(self, values: Array, rotation: float) -> Array:
        each = values.reshape(len(values), len(self.azimuths), self.nodes.count)
        basis = self._basis(self.azimuths)
        basis[2::2] = 0
        projected = np.einsum("cqn,bq->cbn", each, basis) / len(self.azimuths)
        return np.asarray(np.einsum("ax,can->cxn", self._turned(rotation), projected))

    def outer(self, emitted: Array, taken: Array) -> Array:
        flat = emitted.reshape(len(emitted), 1, -1, 1)
        return np.asarray(flat * taken.reshape(len(taken), 1, 1, -1))

    def diagonal(self, values: Array) -> Array:
        return np.tile(values, self.modes)[:, None, :, None] * np.eye(self.modes * self.nodes.count)

    def energy(self, measure: Array) -> Array:
        return np.asarray(measure[:, 0, : self.nodes.count].sum(axis=-2))

    def _basis(self, azimuth: Array) -> Array:
        waves = [ROOT * wave(m * azimuth) for m in self.orders for wave in (np.cos, np.sin)]
        return np.stack([np.ones_like(azimuth), *waves])

    def _deposited(self, light: Light) -> Array:
        turn = (light.x + 1j * light.y) / np.maximum(np.hypot(light.x, light.y), TINY)
        waves = [ROOT * part(turn**m) for m in self.orders for part in (np.real, np.imag)]
        return _deposited(self.nodes, light, [np.ones_like(light.x), *waves], [False] * self.modes)

    def _turned(self, rotation: float) -> Array:
        """Coefficients in a frame that is turned."""
        found = np.eye(self.modes)
        for i, m in enumerate(self.orders):
            c, s = np.cos(m * rotation), np.sin(m * rotation)
            found[2 * i + 1 : 2 * i + 3, 2 * i + 1 : 2 * i + 3] = [[c, s], [-s, c]]
        return found


def _deposited(nodes: Nodes, light: Light, angular: Sequence[Array], odd: Sequence[bool]) -> Array:
    """Sums over the samples of each source, (C, modes, N, sources)."""
    sources, samples = light.x.shape
    index, shares, beyond = nodes.shares(np.hypot(light.x, light.y))
    # Samples are columns of a sparse matrix; what lies on the far side of 0 has a row of its own
    rows = np.where(beyond, nodes.count, index) * sources + np.arange(sources)[:, None]
    shape = (nodes.count + 1) * sources, sources * samples
    last = (1, 2, 0)
    entries = shares.transpose(last).ravel(), rows.transpose(last).ravel(), np.arange(0, shares.size + 1, len(shares))
    weights = np.stack([(each * values).ravel() for each in light.weight for values in angular], axis=-1)
    found = (csc_array(entries, shape) @ weights).T.reshape(len(light.weight), len(angular), nodes.count + 1, sources)
    sign = np.where(odd, -1, 1)[:, None]
    found[:, :, 1] += sign * found[:, :, -1]
    return found[:, :, :-1]
