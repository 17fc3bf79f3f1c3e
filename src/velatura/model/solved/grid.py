"""Directions at which a material is solved: cosines times azimuths, even in the root of the cosine and in half a turn.

Stacks look alike from opposite sides, and mirrored in the axes that all of their brushed interfaces share.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model.guards import ALPHA_MIN
from velatura.model.solved import monotone_cubic
from velatura.model.solved.columns import Columns
from velatura.model.solved.guards import COS_ON_GRID_MIN
from velatura.model.solved.transmission.combined import Parts
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import directional_grid
from velatura.stack import InterfaceValues, Material

Array = NDArray[np.floating]

COSINES = 32  # as many for isotropic interfaces as for others, so that light does not jump between them
AZIMUTHS = {False: 12, True: 24}  # in half a turn, where some are brushed, and where some sharply so
SHARP = 8.0  # roughness across over that along, beyond which inner lobes turn within few degrees
ALIKE = 1e-6  # steps between azimuths, by which axes may differ


@dataclass(frozen=True)
class Grid:
    """All directions, and how columns are spread over a finer grid."""

    isotropic: bool
    cosines: int
    azimuths: int

    @classmethod
    def of(cls, isotropic: bool, material: Material | None = None) -> Grid:
        """The grid of a material of numbers, or None for any of those of tables."""
        sharp = material is not None and any(map(_is_sharp, material.interfaces))
        return cls(isotropic, COSINES, AZIMUTHS[sharp])

    def coarser(self, material: Material) -> Grid:
        """The grid for factors of the symmetric form, which vary by less than columns where interfaces are brushed, but
        bend about critical angles of glass."""
        if self.isotropic:
            return self
        return replace(self, cosines=self.cosines // (1 if material.transmits else 2), azimuths=self.azimuths // 2)

    @property
    def nodes(self) -> Array:
        return np.linspace(0, 1, self.cosines)

    @property
    def turns(self) -> int:
        return 1 if self.isotropic else self.azimuths

    @property
    def count(self) -> int:
        return self.cosines * self.turns

    @cached_property
    def cosine(self) -> Array:
        return np.repeat(np.maximum(self.nodes**2, COS_ON_GRID_MIN), self.turns)

    @cached_property
    def phi(self) -> Array:
        return np.tile(np.pi * np.arange(self.turns) / self.turns, self.cosines)

    @cached_property
    def directions(self) -> tuple[Array, Array, Array]:
        sine = np.sqrt(1 - self.cosine * self.cosine)
        return sine * np.cos(self.phi), sine * np.sin(self.phi), self.cosine

    @property
    def closed(self) -> tuple[int, ...]:
        """Cosines, and azimuths from 0 to half a turn, which is 0 again, between which functions are interpolated."""
        return (self.cosines,) if self.isotropic else (self.cosines, self.azimuths + 1)

    def places(self, w: Direction) -> list[Value]:
        """Coordinates from 0 to 1 of a direction above, on any dialect."""
        turns = ops.arctan2(w[1], w[0]) * (1 / np.pi)
        return [ops.sqrt(w[2]), *([] if self.isotropic else [turns - ops.floor(turns)])]

    def stencils(self, w: Direction) -> list[tuple[Value, list[Value]]]:
        """Nodes that a direction above lies between, of those that are `closed`: the first of some that lie side by
        side, and shares of linear interpolation."""
        cells = []
        for x, count in zip(self.places(w), self.closed):
            place = ops.minimum(x, 1.0) * (count - 1)
            cell = ops.minimum(ops.floor(place), count - 2)
            cells.append((cell, place - cell))
        (cell, share), *others = cells
        if not others:
            return [(cell, [1 - share, share])]
        (turn, upper), width = others[0], self.closed[1]
        return [((cell + k) * width + turn, [x * (1 - upper), x * upper]) for k, x in enumerate((1 - share, share))]

    def spread(self, rows: Array, shape: tuple[int, ...]) -> Array:
        """Values at the nodes, (..., M), interpolated, (..., prod(shape)): by splines over the cosine, by waves over
        the azimuth, which do not fall below 0 where no value does."""
        x, y, _ = directional_grid.directions(shape, None)
        return self._spread(rows, shape[0], np.arctan2(y, x).reshape(shape)[0] if len(shape) > 1 else None)

    def refined(self, rows: Array, finer: Grid) -> Array:
        """Values at the nodes, (..., M), interpolated likewise at those of a finer grid."""
        if finer == self:
            return rows
        return self._spread(rows, finer.cosines, None if self.isotropic else finer.phi[: finer.turns])

    def _spread(self, rows: Array, cosines: int, phi: Array | None) -> Array:
        values = rows.reshape(*rows.shape[:-1], self.cosines, self.turns)
        if phi is not None:
            order = np.arange(self.turns // 2 + 1)
            both = np.where((order == 0) | (2 * order == self.turns), 1, 2)
            waves = np.fft.rfft(values, axis=-1) / self.turns * both
            least = values.min(axis=-1, keepdims=True)
            values = np.maximum((waves @ np.exp(2j * order[:, None] * phi)).real, np.minimum(least, 0))
        return self.along(values.swapaxes(-1, -2), cosines).swapaxes(-1, -2).reshape(*rows.shape[:-1], -1)

    def beside(self, rows: Array, shape: tuple[int, ...]) -> tuple[Array, Array]:
        """The lesser and the greater of the values at the two cosines beside each place of `spread`, of its shape."""
        values = self.spread(rows, (self.cosines, *shape[1:])).reshape(*rows.shape[:-1], self.cosines, -1)
        cell = np.minimum(np.linspace(0, self.cosines - 1, shape[0]).astype(int), self.cosines - 2)
        ends = values[..., cell, :], values[..., cell + 1, :]
        low, high = (each(*ends).reshape(*rows.shape[:-1], -1) for each in (np.minimum, np.maximum))
        return low, high

    def along(self, values: Array, count: int) -> Array:
        """Values at the cosines, (..., cosines), interpolated by splines at as many places."""
        return monotone_cubic.interpolated(self.nodes, values, np.linspace(0, 1, count))


@dataclass(frozen=True)
class Folded:
    """The directions of a grid but for mirror images of others: those at the azimuths of numbers `kept`. The azimuth of
    every number looks like the one that `source` numbers among these, or, where `mirrored`, like its mirror image."""

    grid: Grid
    kept: NDArray[np.integer]
    source: NDArray[np.integer]
    mirrored: NDArray[np.bool_]

    @classmethod
    def of(cls, grid: Grid, material: Material) -> Folded:
        """Directions for a material of numbers, mirrored in its axes where azimuths lie on one or between two."""
        turns = grid.turns
        brushed = [layer for layer in material.interfaces if layer.alpha_u != layer.alpha_v]
        axes = [(layer.rotation * turns / 90) % turns for layer in brushed] or [0.0]  # the sum of those mirrored
        steps = round(axes[0])
        numbers = np.arange(turns)
        image = (steps - numbers) % turns
        if any(abs((axis - steps + ALIKE) % turns) > 2 * ALIKE for axis in axes):
            image = numbers
        kept, source = np.unique(np.minimum(numbers, image), return_inverse=True)
        return cls(grid, kept, source, image < numbers)

    @property
    def count(self) -> int:
        return self.grid.cosines * len(self.kept)

    @cached_property
    def cosine(self) -> Array:
        return self._of(self.grid.cosine)

    @cached_property
    def phi(self) -> Array:
        return self._of(self.grid.phi)

    @cached_property
    def directions(self) -> tuple[Array, Array, Array]:
        x, y, z = map(self._of, self.grid.directions)
        return x, y, z

    @cached_property
    def at_cosines(self) -> tuple[Array, Array, Array]:
        """One direction for each cosine."""
        x, y, z = (each.reshape(-1, len(self.kept))[:, 0] for each in self.directions)
        return x, y, z

    def _of(self, values: Array) -> Array:
        return values.reshape(-1, self.grid.turns)[:, self.kept].ravel()

    @property
    def closed(self) -> NDArray[np.integer]:
        """Numbers of these directions that the nodes of the grid, `closed`, look like: (cosines, azimuths)."""
        source = self.source if self.grid.isotropic else np.r_[self.source, self.source[:1]]
        return np.arange(self.grid.cosines)[:, None] * len(self.kept) + source

    def around(self, values: Array) -> Array:
        """Values for cosines, (..., cosines), at all of these directions."""
        return np.repeat(values, len(self.kept), axis=-1)

    def everywhere(self, values: Array) -> Array:
        """Values at these directions, (..., count), that look alike in mirrors, at all of the grid."""
        found = values.reshape(*values.shape[:-1], self.grid.cosines, len(self.kept))[..., self.source]
        return found.reshape(*values.shape[:-1], self.grid.count)

    def unfolded(self, columns: Columns) -> Columns:
        """Columns at these directions, at all of the grid. Matrices are of the frame of the plane of incidence, where
        middle entries change sign in mirrors; now they are of that of the material, where they hardly vary."""

        def each(values: Any) -> Any:
            if values is None or isinstance(values, float):
                return None
            if isinstance(values, (list, tuple)):
                return type(values)(each(x) for x in values)
            if isinstance(values, Parts):
                return Parts(*(each(x) for x in vars(values).values()))
            return self.everywhere(values)

        found = Columns(*(each(x) for x in vars(columns).values()))
        sign = np.tile(np.where(self.mirrored, -1, 1), self.grid.cosines)
        return found if self.grid.isotropic else _of_material(found, self.grid.phi, sign)


@dataclass(frozen=True)
class Listed:
    """A list of directions (M,), each by itself, in place of those of a grid."""

    isotropic: bool
    directions: tuple[Array, Array, Array]

    @property
    def count(self) -> int:
        return len(self.cosine)

    @property
    def cosine(self) -> Array:
        return np.maximum(self.directions[2], COS_ON_GRID_MIN)

    @property
    def phi(self) -> Array:
        return np.asarray(np.arctan2(self.directions[1], self.directions[0]))

    @property
    def at_cosines(self) -> tuple[Array, Array, Array]:
        return self.directions

    def around(self, values: Array) -> Array:
        return values

    def unfolded(self, columns: Columns) -> Columns:
        return columns if self.isotropic else _of_material(columns, self.phi, np.ones(1))


def _of_material(columns: Columns, phi: Array, sign: Array) -> Columns:
    """Columns with matrices of the frame of the plane of incidence at azimuths phi, or of its mirror image where the
    sign is -1, in that of the material."""
    c, s = np.cos(phi), np.sin(phi)

    def turned(xx: Array, xy: Array, yy: Array) -> tuple[Array, ...]:
        mixed = 2 * c * s * sign * xy
        across = c * s * (xx - yy) + (c * c - s * s) * sign * xy
        return c * c * xx - mixed + s * s * yy, across, s * s * xx + mixed + c * c * yy

    return replace(columns, roughness=[turned(*matrix) for matrix in columns.roughness])


def _is_sharp(interface: InterfaceValues) -> bool:
    u, v = (max(float(alpha), ALPHA_MIN) for alpha in (interface.alpha_u, interface.alpha_v))
    return max(u, v) > SHARP * min(u, v)
