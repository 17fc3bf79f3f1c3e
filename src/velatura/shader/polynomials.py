"""The closures of a material as polynomials of the direction of view, for programs without tables."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from velatura.optics.ggx import Direction
from velatura.sampling import directional_grid
from velatura.shader.closures import Closure, Tabulated, bounded

DEGREE = 8
MODES = 3  # of azimuth, the first a constant: cosines and sines of 2 and 4 times the angle

Array = NDArray[np.floating]


class Fit:
    """The columns of closures as polynomials: coefficients (modes, degrees, columns).

    Modes are 1, and cosine and sine of 2 and 4 times the azimuth where lobes are brushed.
    """

    def __init__(self, baked: Tabulated) -> None:
        self.baked = baked
        self.modes = 2 * MODES - 1 if len(baked.shape) > 1 else 1
        x, y, z = (np.ravel(w) for w in directional_grid.directions(baked.shape, None))
        basis = self._basis((x, y, z))
        rows = baked.rows[0]
        weight = np.sqrt(z)  # as many nodes are at grazing directions, where little light is
        fitted = np.linalg.lstsq((basis.reshape(-1, len(rows)) * weight).T, rows * weight[:, None], rcond=None)[0]
        self.coefficients = fitted.reshape(self.modes, DEGREE + 1, -1)

    def _basis(self, w: Direction) -> Array:
        """(modes, degrees, N)."""
        x, angle = np.sqrt(w[2]), 2 * np.arctan2(w[1], w[0])
        trigonometry = [np.ones_like(x), *(f(k * angle) for k in range(1, MODES) for f in (np.cos, np.sin))]
        return np.array([[mode * x**k for k in range(DEGREE + 1)] for mode in trigonometry[: self.modes]])

    def read(self, w: Direction) -> list[Array]:
        """The columns at directions, those that are negative by the errors of fits 0."""
        return list(np.einsum("mdn,mdc->cn", self._basis(w), self.coefficients))

    def above(self, wi: Direction) -> list[Closure]:
        """The closures for light from above."""
        found = self.baked.at(wi, self.read, lambda *channels: np.stack(channels), self.baked.etas[0])
        return [
            closure._replace(weight=np.maximum(closure.weight, 0), roughness=bounded(closure.roughness))
            for closure in found
        ]
