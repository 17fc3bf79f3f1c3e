"""The objects on the stage, each one surface that stands on the floor y = 0 near the origin, and how to look at it."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from velatura.scenes import teapot as newell
from velatura.scenes import urn as carved
from velatura.scenes.surfaces import Array, Mesh, arc, cap, extrude, flattened, join, lathe, rounded


class View(NamedTuple):
    """A camera: its position, its target, and the field of view in degrees over the picture's shorter side."""

    origin: tuple[float, float, float]
    target: tuple[float, float, float]
    fov: float


class Object(NamedTuple):
    """A surface, made on demand, and a view of it."""

    surface: Callable[[], Mesh]
    view: View


@functools.cache
def ball() -> Mesh:
    """A thick shell with an opening towards the camera, a groove around it and a ball inside, on a ring.

    Turned around the opening's axis. Shows a plain curved face, grazing angles, a rounded edge, a groove and a cavity.
    """
    ring = arc((0.52, 0.11), 0.11, -90.0, 270.0, step=10.0)
    core = arc((0.0, 0.0), 0.56, -90.0, 90.0)
    height = 0.11 + np.sqrt((1.0 + 0.11) ** 2 - 0.52**2)
    turned = join(lathe(_shell()), lathe(core)).moved((0.0, height, 0.0), _tilt(towards=(0.62, 0.58, 0.75)))
    return join(turned, lathe(ring))


@functools.cache
def sphere() -> Mesh:
    """A ball of radius 1 with longitude and latitude as texture coordinates."""
    return lathe(arc((0.0, 0.0), 1.0, -90.0, 90.0)).moved((0.0, 1.0, 0.0))


@functools.cache
def wedges() -> Mesh:
    """Five wedges in a row, their slopes at 15, 30, 45, 60 and 75 degrees: the same light under five angles."""
    return join(*(_wedge(slope).moved((0.58 * i - 1.16, 0.0, 0.0)) for i, slope in enumerate((15, 30, 45, 60, 75))))


@functools.cache
def lid() -> Mesh:
    """A low round dome that lies flat, with texture coordinates as seen from above: for brushing of all kinds."""
    slope, edge, curvature = 20.0, 0.06, 3.0
    dome = arc((0.0, 0.0), curvature, 90.0 - slope, 90.0, step=1.0)
    rim = (curvature - edge) * _direction(90.0 - slope)
    top = lathe(np.concatenate([arc(rim, edge, 0.0, 90.0 - slope, step=10.0), dome[1:]]))
    below = lathe(np.concatenate([[[0.0, rim[1] - edge]], arc(rim, edge, -90.0, 0.0, step=10.0)]))
    return join(flattened(top), below).moved((0.0, edge - rim[1], 0.0))


@functools.cache
def plane() -> Mesh:
    """A square slab that lies flat, an image on its top, upright when seen from the front."""
    half, height = 1.15, 0.06
    corners = np.array([[half, height], [-half, height], [-half, 0.0], [half, 0.0], [half, height]])
    faces = [extrude(np.linspace(start, stop, 3), 2.0 * half) for start, stop in itertools.pairwise(corners)]
    return join(*faces, cap(corners, -half), cap(corners, half))


@functools.cache
def teapot() -> Mesh:
    """Newell's teapot, its spout to the right and a little towards the camera."""
    turn = np.radians(20.0)
    about_y = np.array([[np.cos(turn), 0.0, -np.sin(turn)], [0.0, 1.0, 0.0], [np.sin(turn), 0.0, np.cos(turn)]])
    return newell.teapot().moved((-0.1, 0.0, 0.0), about_y)


@functools.cache
def urn() -> Mesh:
    """A carved urn: relief, ribs, beads, edges and a hollow."""
    return carved.urn()


@functools.cache
def plinth() -> Mesh:
    """The plinth under an object: a low round table, its top at y = 0."""
    return lathe(np.concatenate([arc((1.65, -0.06), 0.06, -90.0, 90.0, step=15.0), [[0.0, 0.0]]]))


@functools.cache
def ground() -> Mesh:
    """An unbounded floor below the plinth."""
    return extrude(np.array([[1e3, -0.12], [0.0, -0.12], [-1e3, -0.12]]), width=2e3)


#: What `scene` may name, besides the file of a Mitsuba scene.
OBJECTS = {
    "ball": Object(ball, View((0.0, 2.6, 7.2), (0.0, 1.0, 0.0), 19.5)),
    "sphere": Object(sphere, View((0.0, 2.2, 7.2), (0.0, 0.95, 0.0), 19.5)),
    "teapot": Object(teapot, View((0.0, 2.6, 7.2), (0.0, 0.6, 0.0), 19.5)),
    "urn": Object(urn, View((0.0, 2.9, 7.2), (0.0, 0.98, 0.0), 18.5)),
    "plane": Object(plane, View((0.0, 4.2, 5.8), (0.0, 0.0, 0.0), 24.0)),
    "wedges": Object(wedges, View((2.6, 2.6, 6.6), (0.0, 0.4, 0.0), 23.0)),
    "lid": Object(lid, View((0.0, 6.0, 4.0), (0.0, 0.1, 0.0), 21.0)),
}


def _shell(opening: float = 36.0, thickness: float = 0.13, groove: float = 14.0) -> Array:
    """Profile: up the outside, over the rounded edge, and down the inside; angles in degrees."""
    edge = 90.0 - opening
    latitude = np.union1d(np.linspace(-90.0, edge, 37), np.linspace(groove - 7.0, groove + 7.0, 15))
    depth = 0.06 * _smoothstep((5.0 - np.abs(latitude - groove)) / 2.5 + 0.5)
    angle = np.radians(latitude)
    outside = (1.0 - depth)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    over = arc((1.0 - thickness / 2.0) * outside[-1], thickness / 2.0, edge, edge + 180.0, step=15.0)
    inside = arc((0.0, 0.0), 1.0 - thickness, edge, -90.0)
    return np.concatenate([outside, over[1:], inside[1:]])


def _smoothstep(x: Array) -> Array:
    """0 below 0, 1 above 1, smooth between."""
    t = np.clip(x, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def _wedge(slope: float, width: float = 0.5, length: float = 1.0, bulge: float = 0.06, edge: float = 0.03) -> Mesh:
    foot, top = np.array([0.5, 0.0]), np.array([0.5, 0.0]) + length * _direction(180.0 - slope)
    along = np.linspace(0.0, 1.0, 9)[:, None]
    face = foot + along * (top - foot) + 4.0 * bulge * along * (1.0 - along) * _direction(90.0 - slope)
    back = np.array([[top[0], 0.0]])
    profile = rounded(np.concatenate([back, face]) + edge * _direction(90.0), edge)
    return join(extrude(profile, width), cap(profile, -width / 2.0), cap(profile, width / 2.0))


def _direction(angle: float) -> Array:
    return np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])


def _tilt(towards: tuple[float, float, float]) -> Array:
    """The rotation matrix that turns the y axis to a direction, the shortest way."""
    to = np.asarray(towards) / np.linalg.norm(towards)
    axis = np.cross((0.0, 1.0, 0.0), to)
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + cross + cross @ cross / (1.0 + to[1])
