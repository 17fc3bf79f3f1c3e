"""Cells on a hemisphere, fine where samples fall, for histograms and for integrals.

Coordinates are the azimuth from the mirror direction and the height 1 - |cos theta|, in which equal areas are equal
solid angles. Along each axis some lines follow the samples, some those of a high density, some their tail, and some
are spread evenly: so lobes of any width are resolved, a narrow one among wide light, too, and nothing is missed where
no sample falls. A column of azimuth has lines of height of its own, half of which follow the samples within it, for
oblique lobes. (For even sharper ones, .001 by .3, the integrals are noisy, and report it.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from velatura.checks.probe import Array

CELLS = 32  # along each axis
NODES = 8  # of integration, along each axis of a cell

_SCALES = 4.0 ** np.arange(1, 11)  # by which the distance of samples from their middle is stretched, to reach the tail


@dataclass(frozen=True)
class HemisphereGrid:
    """Cells and nodes of one hemisphere, seen from one direction.

    Args:
        azimuth: of the mirror direction, radians.
        side: 1 above the surface, -1 below.
        columns: lines of azimuth; every NODES-th of them bounds a column of cells.
        rows: lines of height in each column (CELLS, ...); every NODES-th of them bounds a cell.
    """

    azimuth: float
    side: int
    columns: Array
    rows: Array

    @classmethod
    def around(cls, wi: Array, wo: Array, density: Array, side: int) -> HemisphereGrid:
        """The grid for light from wi (3,), fine where the directions wo (n, 3) lie, which have a density (n,)."""
        azimuth, there = float(np.arctan2(-wi[1], -wi[0])), wo[:, 2] * side > 0
        (phi, height), density = _coordinates(wo[there], azimuth), density[there]
        columns, everywhere = _lines(phi, density, -np.pi, np.pi), _lines(height, density, 0.0, 1.0)
        within = np.searchsorted(_bounds(columns), phi, "right")
        own = (within == column for column in range(CELLS))
        rows = [_lines(height[here], density[here], 0.0, 1.0) for here in own]
        return cls(azimuth, side, columns, np.array([np.sort([*everywhere[1:], *row])[::2] for row in rows]))

    def nodes(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """Directions (n, 3), one at random within each of the smallest meshes, and the solid angles of those (n,)."""
        u = rng.random((2, CELLS * NODES, CELLS * NODES))
        rows = np.repeat(self.rows, NODES, axis=0)
        width, depth = np.diff(self.columns)[:, None], np.diff(rows)
        phi = self.azimuth + self.columns[:-1, None] + width * u[0]
        height = rows[:, :-1] + depth * u[1]
        sin_theta = np.sqrt(height * (2 - height))
        wo = np.stack([sin_theta * np.cos(phi), sin_theta * np.sin(phi), self.side * (1 - height)], axis=-1)
        return wo.reshape(-1, 3), (width * depth).ravel()

    def count(self, wo: Array) -> Array:
        """How many of the directions fall in each cell, (CELLS, CELLS)."""
        phi, height = _coordinates(wo[wo[:, 2] * self.side > 0], self.azimuth)
        within = np.searchsorted(_bounds(self.columns), phi, "right")
        counts = [
            np.bincount(np.searchsorted(_bounds(row), height[within == column], "right"), minlength=CELLS)
            for column, row in enumerate(self.rows)
        ]
        return np.array(counts)


def integrate(values: Array) -> tuple[Array, Array]:
    """Integrals over cells, and their variances, from values (nodes, ...) times solid angles.

    The variance of a sum is at most that of the differences between neighbours, be they noisy or merely different.
    """
    meshes = values.reshape(CELLS, NODES // 2, 2, CELLS, NODES, *values.shape[1:])
    return meshes.sum(axis=(1, 2, 4)), np.square(meshes[:, :, 0] - meshes[:, :, 1]).sum(axis=(1, 3))


def _coordinates(wo: Array, azimuth: float) -> tuple[Array, Array]:
    x, y, z = wo.T
    phi = np.mod(np.arctan2(y, x) - azimuth + np.pi, 2 * np.pi) - np.pi
    return phi, (x * x + y * y) / (1 + np.abs(z))  # 1 - |z| without the loss of digits near the pole


def _bounds(lines: Array) -> Array:
    """The lines between cells."""
    return lines[NODES:-1:NODES]


def _lines(samples: Array, density: Array, low: float, high: float) -> Array:
    """A quarter of the lines follow the samples, one those of high density, one their tail on every scale, and one is
    spread evenly."""
    middle = np.median(samples) if len(samples) else 0.0
    scales = np.resize(_SCALES, len(samples))
    tail = middle + scales * (samples - middle)
    tail = tail[(tail > low) & (tail < high)]
    even = np.linspace(low, high, max(len(samples), 2))
    # Quicker than to select so many quantiles
    ordered = np.sort(np.concatenate([samples, _sharpest(samples, density), tail, even]))
    lines = np.interp(np.linspace(0, len(ordered) - 1, CELLS * NODES + 1), np.arange(len(ordered)), ordered)
    lines[0], lines[-1] = low, high
    return lines


def _sharpest(samples: Array, density: Array) -> Array:
    """Samples, as many as there are, each as often as the root of its density says, where that is a number."""
    order = np.argsort(samples)
    reached = np.cumsum(np.sqrt(np.nan_to_num(np.maximum(density[order], 0.0), posinf=0.0)))
    wanted = (np.arange(len(samples)) + 0.5) / max(len(samples), 1) * reached[-1:]
    return np.asarray(samples[order[np.searchsorted(reached, wanted)]])
