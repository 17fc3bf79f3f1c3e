"""Surfaces made of numbers: bodies turned on a lathe or pressed through a die, with smooth normals and orderly UVs.

Y is up. On every surface u follows the lathe's turning (or the length of a pressed bar), where a tool would leave its
brush marks, and v runs down the profile, so that an image as a texture stands upright and is not mirrored. A profile
is a smooth curve in a plane, points (n, 2) of (radius or z, height), with the outside to the right of its way; what
looks like an edge is a curve of small radius.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_X, _Y, _Z = np.eye(3)


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh: positions and unit normals (n, 3), texture coordinates (n, 2), corners of triangles (m, 3)."""

    positions: Array
    normals: Array
    uv: Array
    triangles: NDArray[np.uint32]

    def moved(self, shift: ArrayLike = (0.0, 0.0, 0.0), rotation: Array | None = None) -> Mesh:
        """The surface turned by a rotation matrix (3, 3) and then shifted."""
        turn = np.eye(3) if rotation is None else rotation
        return Mesh(self.positions @ turn.T + np.asarray(shift), self.normals @ turn.T, self.uv, self.triangles)


def join(*surfaces: Mesh) -> Mesh:
    """Several surfaces as one."""
    starts = np.cumsum([0, *(len(s.positions) for s in surfaces[:-1])])
    return Mesh(
        np.concatenate([s.positions for s in surfaces]),
        np.concatenate([s.normals for s in surfaces]),
        np.concatenate([s.uv for s in surfaces]),
        np.concatenate([s.triangles + np.uint32(start) for s, start in zip(surfaces, starts)]),
    )


def lathe(profile: Array, segments: int = 96) -> Mesh:
    """Turn a profile around the y axis; u is the azimuth, 1/2 at +z, and v the length left on the profile."""
    azimuth = np.linspace(-np.pi, np.pi, segments + 1)[:, None]
    outwards = np.sin(azimuth) * _X + np.cos(azimuth) * _Z
    return _sweep(profile, outwards, np.zeros_like(outwards))


def flattened(surface: Mesh) -> Mesh:
    """The surface with texture coordinates as seen from above, u along x and v along z, over its width and depth."""
    low, high = surface.positions.min(axis=0), surface.positions.max(axis=0)
    plan = (surface.positions - low) / (high - low)
    return replace(surface, uv=plan[:, [0, 2]])


def extrude(profile: Array, width: float) -> Mesh:
    """Press a profile of (z, height) along x; u runs along x, and v is the length left on the profile."""
    ends = np.array([[-0.5 * width], [0.5 * width]]) * _X
    return _sweep(profile, np.stack([_Z, _Z]), ends)


def cap(profile: Array, x: float) -> Mesh:
    """The flat end, at x and facing away from 0, of a bar pressed through a closed convex profile."""
    rim, side = profile[:-1], np.sign(x)
    flat = np.concatenate([rim.mean(axis=0, keepdims=True), rim])
    following = np.arange(len(rim)) + 1
    fan = np.stack([np.zeros_like(following), np.roll(following, -1), following], axis=-1)[:, :: int(side)]
    uv = 0.5 - ((flat - flat.min(axis=0)) / np.ptp(flat, axis=0) - 0.5) * [side, 1.0]
    positions = x * _X + flat[:, :1] * _Z + flat[:, 1:] * _Y
    return Mesh(positions, np.broadcast_to(side * _X, positions.shape), uv, fan.astype(np.uint32))


def arc(centre: ArrayLike, radius: float, start: float, stop: float, step: float = 4.0) -> Array:
    """Points (n, 2) of a circle between two angles; angles and the largest step between points in degrees."""
    angle = np.radians(np.linspace(start, stop, int(np.ceil(abs(stop - start) / step)) + 1))
    return np.asarray(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def rounded(corners: ArrayLike, radius: float) -> Array:
    """The closed profile at a distance from a convex polygon, corners anticlockwise; starts halfway along an edge."""
    points = np.asarray(corners, dtype=float)
    edges = np.roll(points, -1, axis=0) - points
    heading = np.degrees(np.arctan2(edges[:, 1], edges[:, 0]))
    turn = (heading - np.roll(heading, 1)) % 360.0
    arcs = [arc(p, radius, h - t - 90.0, h - 90.0, 15.0) for p, h, t in zip(points, heading, turn)]
    start = (arcs[-1][-1:] + arcs[0][:1]) / 2.0
    return np.concatenate([start, *arcs, start])


def _sweep(profile: Array, outwards: Array, offsets: Array) -> Mesh:
    """A grid of points profile[:, 0] * outwards + profile[:, 1] * y + offsets: u across, v back along the profile."""
    # Measure the profile's length, and its normals from its tangents
    steps = np.linalg.norm(np.diff(profile, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    tangent = np.gradient(profile, length, axis=0, edge_order=2)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=-1)

    # Carry both around
    positions = profile[:, None, :1] * outwards + profile[:, None, 1:] * _Y + offsets
    normals = normal[:, None, :1] * outwards + normal[:, None, 1:] * _Y
    return grid(positions, normals, 1.0 - length / length[-1])


def grid(positions: Array, normals: Array, v: Array | None = None) -> Mesh:
    """Rows of points (rows, columns, 3): seen from outside, columns run anticlockwise around the way that rows go.

    u runs from 0 to 1 with the columns, and v back along the rows, evenly where it is not given.
    """
    rows, columns, _ = positions.shape
    u, v = np.meshgrid(np.linspace(0.0, 1.0, columns), np.linspace(1.0, 0.0, rows) if v is None else v)

    # Split the cells into triangles
    index = np.arange(u.size, dtype=np.uint32).reshape(u.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return Mesh(positions.reshape(-1, 3), normals.reshape(-1, 3), np.stack([u, v], -1).reshape(-1, 2), triangles)
