"""The plain grid of Belcour 2018 (5.1), 64^4 values of the directional albedo, which the low-rank tables replace."""

from __future__ import annotations

import numpy as np

from velatura import ops
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.tables.build.single_scattering import Progress, density_over_plane, fine_cosines
from velatura.tables.store import Table

NODES = 64
INDEX_MAX = 4.0  # of eta and of kappa; both begin at 0


def build(progress: Progress = lambda done: None) -> Table:
    """The grid over (cos_theta, alpha, eta, kappa), as one matrix product of weights and Fresnel."""
    unit = np.linspace(0, 1, NODES)
    weights = density_over_plane("cos_d", unit, unit, progress=progress).astype(np.float32)
    eta, kappa = np.meshgrid(INDEX_MAX * unit, INDEX_MAX * unit, indexing="ij")
    curves = fresnel.conductor(fine_cosines()[:, None], eta.ravel(), kappa.ravel()).astype(np.float32)
    return Table((weights @ curves).reshape(NODES, NODES, NODES, NODES, 1))


def fgd(grid: Table, cos_theta: Value, alpha: Value, eta: Value, kappa: Value) -> Value:
    """Multilinear look-up in the grid."""
    return ops.interpolate(grid, cos_theta, alpha, eta / INDEX_MAX, kappa / INDEX_MAX)[0]
