"""Martin Newell's teapot of 1975, from the control points that he published, standing on y = 0.

The body and the lid are turned: his patches of them are quarters of a circle to half a percent. Handle and spout are
bicubic patches, of which he gave one half. Where his teapot is open, it is closed here: between pot and lid by a
groove, at the spout by a disc, and within the body by the ends of handle and spout.
"""

from __future__ import annotations

import numpy as np

from velatura.scenes.surfaces import Array, Mesh, grid, join, lathe

SCALE = 0.4

# Profiles, cubic: four points (radius, height) each, the last one the first of the next

_POT = [(0, 0), (1.425, 0), (1.5, 0.075), (1.5, 0.15), (1.5, 0.225), (2, 0.45), (2, 0.9), (2, 1.35), (1.75, 1.875)]
_POT += [(1.5, 2.4), (1.4375, 2.53125), (1.3375, 2.53125), (1.4, 2.4)]
_GROOVE = [(1.4, 2.4), (1.35, 2.4), (1.3, 2.4)]
_LID = [(1.3, 2.4), (1.3, 2.55), (0.4, 2.55), (0.2, 2.7), (0, 2.85), (0.8, 3.15), (0, 3.15)]

# Half rings along a tube, cubic along it too: (x, height) where one begins, where it ends, and half its width

_HANDLE = [
    ((-1.6, 2.025), (-1.5, 2.25), 0.3),
    ((-2.3, 2.025), (-2.5, 2.25), 0.3),
    ((-2.7, 2.025), (-3.0, 2.25), 0.3),
    ((-2.7, 1.8), (-3.0, 1.8), 0.3),
    ((-2.7, 1.575), (-3.0, 1.35), 0.3),
    ((-2.5, 1.125), (-2.65, 0.9375), 0.3),
    ((-2.0, 0.9), (-1.9, 0.6), 0.3),
]
_SPOUT = [
    ((1.7, 1.425), (1.7, 0.6), 0.66),
    ((2.6, 1.425), (3.1, 0.825), 0.66),
    ((2.3, 2.1), (2.4, 2.025), 0.25),
    ((2.7, 2.4), (3.3, 2.4), 0.25),
    ((2.8, 2.475), (3.525, 2.49375), 0.25),
    ((2.9, 2.475), (3.45, 2.5125), 0.15),
    ((2.8, 2.4), (3.2, 2.4), 0.15),
]


def teapot() -> Mesh:
    """The whole teapot, its spout along +x."""
    turned = (lathe(curve(SCALE * np.array(profile))[0]) for profile in (_POT, _LID))
    groove = lathe(SCALE * np.array(_GROOVE))
    return join(*turned, groove, _tube(_HANDLE), _tube(_SPOUT))


def _bernstein(t: Array) -> tuple[Array, Array]:
    """The four cubic polynomials of Bernstein at t, shape (n, 4), and their derivatives."""
    s = 1.0 - t
    values = np.stack([s**3, 3 * s**2 * t, 3 * s * t**2, t**3], axis=-1)
    slopes = 3 * np.stack([-(s**2), s**2 - 2 * s * t, 2 * s * t - t**2, t**2], axis=-1)
    return values, slopes


def curve(points: Array, steps: int = 24) -> tuple[Array, Array]:
    """Points on a chain of cubic curves, and their tangents, from control points of shape (3 n + 1, ...)."""
    parts = [points[start : start + 4] for start in range(0, len(points) - 1, 3)]
    values, slopes = _bernstein(np.linspace(0.0, 1.0, steps + 1))
    found = [[np.tensordot(weights, part, axes=1) for part in parts] for weights in (values, slopes)]
    on, along = (np.concatenate([each[0][:1], *(part[1:] for part in each)]) for each in found)
    return on, along


def _tube(rings: list[tuple[tuple[float, float], tuple[float, float], float]]) -> Mesh:
    """A tube through rings, the two halves of it mirrored at z = 0, and closed at both ends."""
    # Lay out the control points of the half with z > 0, (along, around, 3)
    control = [[(*begin, 0.0), (*begin, half), (*end, half), (*end, 0.0)] for begin, end, half in rings]
    along, d_along = curve(SCALE * np.array(control))
    positions, d_around = _around(along)
    normals = np.cross(d_around, _around(d_along)[0])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)

    # Go around, back on the other half
    mirror = np.array([1.0, 1.0, -1.0])
    ring, out = (np.concatenate([half, mirror * half[:, -2::-1]], axis=1) for half in (positions, normals))
    return join(grid(ring, out), _end(ring[0][::-1]), _end(ring[-1]))


def _around(control: Array) -> tuple[Array, Array]:
    """Points on half rings (n, 4, 3), and their derivatives."""
    values, slopes = _bernstein(np.linspace(0.0, 1.0, 13))
    return values @ control, slopes @ control


def _end(ring: Array) -> Mesh:
    """The disc in a flat ring that closes on itself, anticlockwise seen from outside."""
    centre = ring[:-1].mean(axis=0)
    spokes = ring - centre
    normal = np.sum(np.cross(spokes[:-1], spokes[1:]), axis=0)
    normal /= np.linalg.norm(normal)
    u = spokes[0] / np.linalg.norm(spokes[0])
    flat = spokes @ np.stack([u, np.cross(u, normal)], axis=-1)
    uv = np.concatenate([np.zeros((1, 2)), flat]) / (2.0 * np.abs(flat).max()) + 0.5
    k = np.arange(1, len(ring))
    fan = np.stack([np.zeros_like(k), k, k + 1], axis=-1).astype(np.uint32)
    points = np.concatenate([centre[None], ring])
    return Mesh(points, np.broadcast_to(normal, points.shape), uv, fan)
