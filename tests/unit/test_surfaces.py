"""The bodies on the stage against geometry: volumes, closedness, orientation, the way of their texture axes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from velatura.scenes.objects import OBJECTS
from velatura.scenes.surfaces import Array, Mesh, arc, cap, extrude, join, lathe, rounded


def corners(surface: Mesh, values: Array) -> tuple[Array, Array, Array]:
    a, b, c = np.moveaxis(values[surface.triangles], 1, 0)
    return a, b, c


def area_vectors(surface: Mesh) -> Array:
    a, b, c = corners(surface, surface.positions)
    return np.cross(b - a, c - a) / 2.0


def volume(surface: Mesh) -> float:
    """By the divergence theorem, from the corners of the triangles alone."""
    a, _, _ = corners(surface, surface.positions)
    return float(np.sum(a * area_vectors(surface)) / 3.0)


def mean_normals(surface: Mesh) -> Array:
    a, b, c = corners(surface, surface.normals)
    return (a + b + c) / 3.0


def tangents(surface: Mesh) -> tuple[Array, Array, Array]:
    """dp/du, dp/dv and the mean normal of every triangle, those aside that a pole has shrunk to nothing."""
    a, b, c = corners(surface, surface.positions)
    s, t, r = corners(surface, surface.uv)
    (e1, e2), (d1, d2) = (b - a, c - a), (t - s, r - s)
    determinant = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    fine = np.linalg.norm(area_vectors(surface), axis=1) > 1e-9
    dp_du = (d2[fine, 1:] * e1[fine] - d1[fine, 1:] * e2[fine]) / determinant[fine, None]
    dp_dv = (d1[fine, :1] * e2[fine] - d2[fine, :1] * e1[fine]) / determinant[fine, None]
    return dp_du, dp_dv, mean_normals(surface)[fine]


def test_a_turned_half_circle_is_a_ball() -> None:
    surface = lathe(arc((0.0, 0.0), 1.0, -90.0, 90.0, step=1.0), segments=360)
    assert volume(surface) == pytest.approx(4.0 / 3.0 * np.pi, rel=1e-3)
    np.testing.assert_allclose(surface.normals, surface.positions, atol=1e-3)


def test_a_turned_circle_is_a_ring() -> None:
    surface = lathe(arc((2.0, 0.0), 0.5, -90.0, 270.0, step=1.0), segments=360)
    assert volume(surface) == pytest.approx(2.0 * np.pi**2 * 2.0 * 0.25, rel=1e-3)


@given(
    st.lists(st.integers(0, 359), min_size=3, max_size=8, unique=True),
    st.floats(0.01, 2.0),
)
def test_a_rounded_polygon_has_the_area_that_steiner_gave_it(angles: list[int], radius: float) -> None:
    """Area, perimeter x radius, and a disc; the polygon's corners lie on a circle, so that it is convex."""
    polygon = np.stack([np.cos(np.radians(sorted(angles))), np.sin(np.radians(sorted(angles)))], axis=-1)
    x, y = polygon.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    perimeter = np.sum(np.linalg.norm(np.roll(polygon, -1, axis=0) - polygon, axis=1))
    bar = rounded(polygon, radius)
    body = join(extrude(bar, 2.0), cap(bar, -1.0), cap(bar, 1.0))
    assert volume(body) / 2.0 == pytest.approx(area + perimeter * radius + np.pi * radius**2, rel=0.015)


@pytest.mark.parametrize("name", OBJECTS)
def test_a_body_is_closed_and_stands_on_the_floor(name: str) -> None:
    surface = OBJECTS[name].surface()
    assert np.sum(area_vectors(surface), axis=0) == pytest.approx(np.zeros(3), abs=1e-9)
    assert volume(surface) > 0.0
    assert surface.positions[:, 1].min() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("name", OBJECTS)
def test_every_part_of_a_body_is_turned_outwards(name: str) -> None:
    """Parts hang together by points in the same place; each is closed, so that each has a volume of its own."""
    surface = OBJECTS[name].surface()
    _, place = np.unique(np.round(surface.positions, 9), axis=0, return_inverse=True)
    a, b, c = place.reshape(-1)[surface.triangles].T
    edges = coo_array((np.ones(2 * len(a)), (np.concatenate([a, b]), np.concatenate([b, c]))), (place.max() + 1,) * 2)
    part = connected_components(edges, directed=False)[1][a]
    for number in range(part.max() + 1):
        piece = replace(surface, triangles=surface.triangles[part == number])
        assert np.sum(area_vectors(piece), axis=0) == pytest.approx(np.zeros(3), abs=1e-9)
        assert volume(piece) > 0.0


@pytest.mark.parametrize("name", OBJECTS)
def test_normals_are_units_and_point_outwards(name: str) -> None:
    surface = OBJECTS[name].surface()
    flat = area_vectors(surface)
    size = np.linalg.norm(flat, axis=1)
    fine = size > 1e-9
    np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1.0, atol=1e-9)
    assert np.min(np.sum(flat * mean_normals(surface), axis=1)[fine] / size[fine]) > 0.85


@pytest.mark.parametrize("name", OBJECTS)
def test_textures_are_not_mirrored(name: str) -> None:
    """An image's u runs to the right and its v down, so their cross product points into the body."""
    dp_du, dp_dv, normal = tangents(OBJECTS[name].surface())
    assert np.all(np.sum(np.cross(dp_du, dp_dv) * normal, axis=1) < 0.0)


@pytest.mark.parametrize("name", OBJECTS)
def test_texture_coordinates_lie_within_one_image(name: str) -> None:
    uv = OBJECTS[name].surface().uv
    assert uv.min() > -1e-12
    assert uv.max() < 1 + 1e-12


@pytest.mark.parametrize("name", OBJECTS)
def test_tangents_are_orthogonal_to_normals(name: str) -> None:
    """Expected: so within the angle that a triangle of a curved surface turns by; 2 degrees on the average."""
    dp_du, _, normal = tangents(OBJECTS[name].surface())
    lengths = np.linalg.norm(dp_du, axis=1) * np.linalg.norm(normal, axis=1)
    tilt = np.degrees(np.arcsin(np.abs(np.sum(dp_du * normal, axis=1)) / lengths))
    assert tilt.mean() < 2.0 and tilt.max() < 32.0


def test_brush_marks_run_around_the_lathe() -> None:
    """Anticlockwise seen from above; within half a segment's turn, and a little more where triangles narrow."""
    dp_du, _, normal = tangents(OBJECTS["sphere"].surface())
    around = np.cross((0.0, 1.0, 0.0), normal)
    cosine = np.sum(dp_du * around, axis=1) / np.linalg.norm(dp_du, axis=1) / np.linalg.norm(around, axis=1)
    assert cosine[np.abs(normal[:, 1]) < 0.95].min() > np.cos(np.radians(3.0))
