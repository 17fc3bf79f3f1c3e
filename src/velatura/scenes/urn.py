"""A carved urn, made by formulas, standing on y = 0: fine relief, edges and a hollow, where other objects are plain.

From the foot up: a roped torus, a fluted scotia, a knop, a gadrooned bowl, a frieze of two waves that interlace around
bosses, between two rings of beads, a twisted neck, a lip, and a hollow inside. Texture coordinates are those of a
lathe: u is the azimuth, also the direction of its tangents, v the length along the profile; beads have their own.
"""

from __future__ import annotations

import numpy as np

from velatura.scenes.surfaces import Array, Mesh, arc, grid, join, lathe
from velatura.scenes.teapot import curve

COLUMNS = 384  # of points around
STEP = 0.013  # along the profile
WAVES, BEADS, BEAD = 12, 72, 0.028  # around; and the radius of a bead
LOW, HIGH = 1.03, 1.27  # of the frieze

# Profiles, cubic: four points (radius, height) each, the last one the first of the next

_OUTSIDE = [(0, 0), (0.2, 0), (0.4, 0), (0.5, 0), (0.57, 0), (0.57, 0.1), (0.5, 0.1), (0.45, 0.1), (0.45, 0.1)]
_OUTSIDE += [(0.45, 0.13), (0.45, 0.16), (0.2, 0.22), (0.16, 0.34), (0.14, 0.39), (0.25, 0.35), (0.25, 0.41)]
_OUTSIDE += [(0.25, 0.46), (0.16, 0.44), (0.17, 0.47), (0.18, 0.5), (0.22, 0.5), (0.34, 0.54), (0.62, 0.64)]
_OUTSIDE += [(0.8, 0.8), (0.8, 1.02), (0.8, 1.12), (0.8, 1.2), (0.79, 1.28), (0.775, 1.42), (0.56, 1.44), (0.52, 1.56)]
_OUTSIDE += [(0.5, 1.66), (0.52, 1.76), (0.6, 1.86), (0.63, 1.89), (0.69, 1.88), (0.69, 1.915)]
_OUTSIDE += [(0.69, 1.95), (0.62, 1.95), (0.58, 1.9)]
_INSIDE = [(0.58, 1.9), (0.49, 1.76), (0.46, 1.66), (0.47, 1.56), (0.51, 1.42), (0.72, 1.4), (0.74, 1.2)]
_INSIDE += [(0.74, 0.85), (0.5, 0.62), (0, 0.62)]


def urn() -> Mesh:
    """The whole urn."""
    rings = (_beads(height) for height in (LOW - 0.005, HIGH + 0.005))
    return join(_body(), *rings)


def _body() -> Mesh:
    """The turned body with its relief, its normals those of the relief."""
    outside = _even(_OUTSIDE, STEP)
    profile = np.concatenate([outside, _even(_INSIDE, 3 * STEP)[1:]])
    azimuth = np.linspace(-np.pi, np.pi, COLUMNS + 1)
    length = _length(profile)
    normal = np.gradient(profile, length, axis=0)[:, ::-1] * (1, -1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)

    # Raise the outside along the normal of the profile
    raised = np.zeros((len(profile), azimuth.size))
    raised[: len(outside)] = _relief(outside[:, 1:], azimuth)
    raised[(0, -1), :] = 0.0
    radius, height = np.moveaxis(profile[:, None] + raised[..., None] * normal[:, None], -1, 0)
    positions = np.stack([radius * np.sin(azimuth), height, radius * np.cos(azimuth)], axis=-1)
    return grid(positions, _normals(positions), 1.0 - length / length[-1])


def _relief(height: Array, azimuth: Array) -> Array:
    """How far the outside is raised, (rows, columns), from heights (rows, 1) and azimuths."""
    rope = -0.016 * _between(height, 0.02, 0.08, 0.02) * np.sin(18 * azimuth + 30.0 * height) ** 2
    scotia = -0.016 * _between(height, 0.16, 0.32, 0.03) * np.cos(12 * azimuth) ** 2
    gadroons = 0.05 * _between(height, 0.64, 0.95, 0.08) * np.sqrt(np.cos(12 * azimuth) ** 2 + 0.01)
    flutes = -0.02 * _between(height, 1.5, 1.83, 0.04) * np.sin(14 * azimuth + 7.0 * height) ** 2
    return rope + scotia + gadroons + flutes + _frieze(height, azimuth)


def _frieze(height: Array, azimuth: Array) -> Array:
    """Two waves, one over the other at every second crossing, with a boss in each eye."""
    y = (2.0 * height - LOW - HIGH) / (HIGH - LOW)  # -1 to 1
    phase = WAVES * azimuth
    slant = np.sqrt(1.0 + np.cos(phase) ** 2)  # keeps bands as wide where they rise, at about 45 degrees
    bands = [_bump((y - sign * 0.55 * np.sin(phase)) / (0.3 * slant)) for sign in (1.0, -1.0)]
    over = [1.0 + sign * 0.3 * np.cos(phase) for sign in (1.0, -1.0)]
    eye = np.hypot(y, 0.8 * np.cos(phase))  # 0 where the waves are farthest apart
    raised = np.maximum(bands[0] * over[0], bands[1] * over[1]) + 0.75 * _bump(eye / 0.45)
    return 0.022 * _between(height, LOW + 0.01, HIGH - 0.01, 0.02) * raised


def _beads(height: float) -> Mesh:
    """A ring of beads around the body, half sunk."""
    outside = _even(_OUTSIDE, STEP)
    radius = np.interp(height, *outside[np.abs(outside[:, 1] - height) < 0.1].T[::-1])
    bead = lathe(arc((0.0, 0.0), BEAD, -90.0, 90.0, step=22.5), segments=12)
    turns = 2.0 * np.pi * np.arange(BEADS) / BEADS
    return join(*(bead.moved((radius * np.sin(turn), height, radius * np.cos(turn))) for turn in turns))


def _even(points: list[tuple[float, float]], step: float) -> Array:
    """Points (n, 2) on a chain of cubic curves, evenly spaced."""
    fine = curve(np.array(points, float), 64)[0]
    length = _length(fine)
    at = np.linspace(0.0, length[-1], int(np.ceil(length[-1] / step)) + 1)
    return np.stack([np.interp(at, length, values) for values in fine.T], axis=-1)


def _length(profile: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])


def _normals(positions: Array) -> Array:
    """Unit normals of a grid that closes on itself around, and at both ends lies on the axis."""
    along = np.gradient(positions, axis=0)
    wrapped = np.concatenate([positions[:, -2:-1], positions, positions[:, 1:2]], axis=1)
    normals = np.cross((wrapped[:, 2:] - wrapped[:, :-2]) / 2.0, along)
    normals[0], normals[-1] = (0.0, -1.0, 0.0), (0.0, 1.0, 0.0)
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def _between(x: Array, low: float, high: float, border: float) -> Array:
    """1 from `low` to `high`, 0 beyond the borders, smooth between."""
    t = np.clip((np.minimum(x - low, high - x) + border) / border, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def _bump(x: Array) -> Array:
    """A ridge, round on top: 1 at 0, and 0 from 1 on."""
    t = np.clip(1.0 - x * x, 0.0, 1.0)
    return t * np.sqrt(t)
