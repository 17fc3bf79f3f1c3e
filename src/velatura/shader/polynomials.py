"""The closures of a material as polynomials of the direction of view, for programs without tables."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import directional_grid
from velatura.shader.closures import Closure, ColumnReader, TabulatedClosures, bounded

MODES = 7  # of azimuth where lobes are brushed: a constant, cosines and sines of 2, 4 and 6 times the angle
DEGREES = {1: 8, MODES: 6}  # of the root of the cosine, by the number of modes
NEGLIGIBLE = 3e-4  # of a weight or a roughness, over directions
SINE2_MIN = 1e-6  # squared sine of a direction that has an azimuth

Array = NDArray[np.floating]


class PolynomialFit:
    """The columns of closures as polynomials: coefficients (modes, degrees, columns).

    Modes are 1, and cosine and sine of 2, 4 and 6 times the azimuth where lobes are brushed.
    """

    def __init__(self, baked: TabulatedClosures) -> None:
        self.baked = baked
        self.modes = MODES if len(baked.shape) > 1 else 1
        x, y, z = (np.ravel(w) for w in directional_grid.directions(baked.shape, None))
        powers = np.sqrt(z) ** np.arange(DEGREES[self.modes] + 1)[:, None]
        basis = (np.stack(np.broadcast_arrays(*_modes((x, y, z), self.modes)))[:, None] * powers).reshape(-1, len(z))
        weight = np.sqrt(z)  # as many nodes are at grazing directions, where little light is
        rows = baked.rows[0]
        fitted = np.linalg.lstsq((basis * weight).T, rows * weight[:, None], rcond=None)[0]
        self.coefficients = fitted.reshape(self.modes, len(powers), -1)

    def above(self, wi: Direction) -> list[Closure]:
        """The closures for light from above, in any dialect; weights that are negative by the errors of fits are 0."""
        found = self.baked.at(wi, self._read, self.baked.etas[0])
        return [
            closure._replace(weight=ops.maximum(closure.weight, 0.0), roughness=bounded(closure.roughness))
            for closure in found
        ]

    def _read(self, w: Direction) -> ColumnReader:
        x, modes = ops.sqrt(w[2]), _modes(w, self.modes)

        def polynomial(coefficients: Array) -> Value:
            """Sum over the modes that count, by Horner's rule."""
            total: Value = 0.0
            for k, (mode, each) in enumerate(zip(modes, coefficients)):
                if k == 0 or np.abs(each).sum(axis=0).max() >= NEGLIGIBLE:
                    found: Value = each[-1]
                    for one in each[-2::-1]:
                        found = found * x + one
                    total = total + found * mode
            return total

        def colour(k: int) -> Value:
            return polynomial(self.coefficients[..., k : k + 3, None])

        return ColumnReader(lambda k: polynomial(self.coefficients[..., k]), colour)


def _modes(w: Direction, count: int) -> list[Value]:
    """1, and cosine and sine of two, four and six times the azimuth: as many as there are."""
    if count == 1:
        return [1.0]
    u, v, _ = w
    length = ops.maximum(u * u + v * v, SINE2_MIN)
    c, s = (u * u - v * v) / length, 2 * u * v / length
    c_4, s_4 = c * c - s * s, 2 * c * s
    return [1.0, c, s, c_4, s_4, c_4 * c - s_4 * s, s_4 * c + c_4 * s]
