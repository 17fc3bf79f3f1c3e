"""Bins of outgoing directions, fine about the direction of a mirror, and nodes that integrate over each.

A side of the surface is seen as the disc of x and y, with polar coordinates about the centre c where a smooth stack
would send the light: phi, the azimuth from the plane of incidence, forwards, and t, the share of the way from c to the
rim. Bins are those of `RADII` in t, and equal ones in phi. So they cover the disc, and are symmetric about the plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from velatura.renderer.low_discrepancy import gauss

Array = NDArray[np.floating]

RADIAL, AZIMUTHAL = 16, 16
FINEST = 0.01
RADII = np.array([0.0, *np.geomspace(FINEST, 1, RADIAL)])
FARTHEST = 0.97  # of the centre from the middle of the disc, where light is totally reflected
NODES = 4  # along either side of a bin
CROWDED = 4  # power by which nodes of the first row crowd towards the centre, where there are more of them

SIDES = ("reflected", "transmitted")


@dataclass(frozen=True)
class Bins:
    """Bins of one side for light from one direction.

    forward: azimuth of the direction that the light goes on to; centre: distance of c from the middle of the disc;
    up: whether the side is above the surface.
    """

    forward: float
    centre: float
    up: bool

    @classmethod
    def of(cls, wi: Array, side: str, eta: float) -> Bins:
        """Bins for light from wi (3,), with z < 0 from below, and the index eta below over that above."""
        through, below = side == "transmitted", wi[2] < 0
        index = (eta if below else 1 / eta) if through else 1.0
        centre = min(float(np.hypot(wi[0], wi[1])) * index, FARTHEST if through else 1.0)
        return cls(float(np.arctan2(-wi[1], -wi[0])), centre, bool(below == through))

    def number(self, wo: Array) -> NDArray[np.intp]:
        """The number (n,) of the bin of directions (3, n), which count over t, then phi; whichever side they are on."""
        x, y = self._turned(wo[0], wo[1], -self.forward)
        x = x - self.centre
        phi = np.arctan2(y, x)
        t = np.hypot(x, y) / self._rim(phi)
        row = np.clip(np.searchsorted(RADII, t, side="right") - 1, 0, RADIAL - 1)
        column = np.clip(((phi + pi) / (2 * pi) * AZIMUTHAL).astype(int), 0, AZIMUTHAL - 1)
        return np.asarray(row * AZIMUTHAL + column)

    def nodes(self, count: int = NODES, central: int | None = None) -> tuple[Array, Array]:
        """Directions (3, n) and solid angles (n,): `count` squared nodes for each bin, bin by bin.

        `central` are those along t in the first row, where they crowd towards the centre, for lobes that are narrow.
        """
        x, w = gauss(count)
        t, dt = RADII[:-1, None] + np.diff(RADII)[:, None] * x, np.diff(RADII)[:, None] * w
        rows = [(t, dt)]
        if central:
            x_0, w_0 = gauss(central)
            first = FINEST * x_0**CROWDED, FINEST * CROWDED * x_0 ** (CROWDED - 1) * w_0
            rows = [(first[0][None], first[1][None]), (t[1:], dt[1:])]
        step = 2 * pi / AZIMUTHAL
        phi = (step * (np.arange(AZIMUTHAL)[:, None] + x)).ravel() - pi
        rim, width = self._rim(phi), np.tile(step * w, AZIMUTHAL)
        parts = [self._nodes(*each, phi, rim, width) for each in rows]
        return np.concatenate([wo for wo, _ in parts], axis=1), np.concatenate([weight for _, weight in parts])

    def _nodes(self, t: Array, dt: Array, phi: Array, rim: Array, width: Array) -> tuple[Array, Array]:
        """Nodes of rows t (rows, n) of widths dt, and of azimuths of their distances from the rim, and widths."""
        away = np.outer(t, rim)
        px, py = self._turned(self.centre + away * np.cos(phi), away * np.sin(phi), self.forward)
        cosine = np.sqrt(np.maximum(1 - px * px - py * py, 1e-12))
        weight = np.outer(t * dt, rim**2 * width) / cosine

        def by_bin(values: Array) -> Array:
            """Values over t and phi, with those of one bin together."""
            return values.reshape(*t.shape, AZIMUTHAL, -1).swapaxes(1, 2).reshape(-1)

        return np.stack([by_bin(each) for each in (px, py, cosine if self.up else -cosine)]), by_bin(weight)

    def _rim(self, phi: Array) -> Array:
        """Distance from the centre to the rim of the disc."""
        across = self.centre * np.sin(phi)
        return np.sqrt(np.maximum(1 - across**2, 0)) - self.centre * np.cos(phi)

    @staticmethod
    def _turned(x: Array, y: Array, angle: float) -> tuple[Array, Array]:
        c, s = np.cos(angle), np.sin(angle)
        return c * x - s * y, s * x + c * y


def mirrored(grid: Array) -> Array:
    """Values (RADIAL, AZIMUTHAL, ...) on the other side of the plane of incidence."""
    return grid[:, ::-1]
