"""Refraction, deflection and flights between facets, each against its definition."""

from __future__ import annotations

import numpy as np
import pytest

from velatura.optics import fresnel, ggx, microsurface, phase, refraction

RNG = np.random.default_rng(3)
N = 200_000


def directions(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x, y, z = ggx.normalize(tuple(RNG.normal(size=(3, count))))
    return x, y, z


@pytest.mark.parametrize("eta", [1.5, 1 / 1.5])
def test_refraction_obeys_snell_and_the_half_vector_undoes_it(eta: float) -> None:
    w, h = directions(1000), directions(1000)
    upright = np.sign(h[2])
    h = (h[0] * upright, h[1] * upright, h[2] * upright)
    faces = (ggx.dot(w, h) > 0.1) & (1 - ggx.dot(w, h) ** 2 < 0.95 * eta**2)
    w, h = (tuple(x[faces] for x in v) for v in (w, h))
    o = refraction.refract(w, h, eta)
    np.testing.assert_allclose(ggx.dot(o, o), 1, rtol=1e-12)
    np.testing.assert_allclose(-ggx.dot(o, h), fresnel.cos_transmitted(ggx.dot(w, h), eta), rtol=1e-9)
    np.testing.assert_allclose(refraction.half_vector(w, o, eta), h, atol=1e-9)


@pytest.mark.parametrize("eta", [1.0, 1.5])
def test_jacobian_by_differences(eta: float) -> None:
    """Solid angle of normals over that of the outgoing directions that they cause."""
    w = (0.3, -0.2, np.sqrt(1 - 0.13))
    h = ggx.normalize((0.1, 0.2, 1.0))

    def out(x: float, y: float) -> np.ndarray:
        m = ggx.normalize((h[0] + x, h[1] + y, h[2]))
        return np.array(ggx.reflect(w, m) if eta == 1 else refraction.refract(w, m, eta))

    def area(of_tilt, step: float = 1e-4) -> float:
        dx, dy = (of_tilt(step, 0.0) - of_tilt(-step, 0.0), of_tilt(0.0, step) - of_tilt(0.0, -step))
        return float(np.linalg.norm(np.cross(dx, dy)))

    normals = area(lambda x, y: np.array(ggx.normalize((h[0] + x, h[1] + y, h[2]))))
    cos_o = ggx.dot(tuple(out(0, 0)), h)
    assert refraction.jacobian(ggx.dot(w, h), cos_o, eta) == pytest.approx(normals / area(out), rel=1e-5)


def test_deflection_has_the_angle_asked_for() -> None:
    any_way, along = directions(1000), ggx.normalize((1e-6 * RNG.normal(size=1000), 0.0, RNG.choice([-1.0, 1.0], 1000)))
    w = tuple(np.concatenate([x, np.broadcast_to(y, 1000)]) for x, y in zip(any_way, along))
    cosine, phi = RNG.uniform(-1, 1, 2000), RNG.uniform(0, 2 * np.pi, 2000)
    turned = phase.deflect(w, cosine, phi)
    np.testing.assert_allclose(ggx.dot(turned, turned), 1, rtol=1e-9)
    np.testing.assert_allclose(ggx.dot(turned, w), cosine, atol=1e-9)


def test_reflectance_between_two_directions_is_one_from_both_sides() -> None:
    cos_i, eta = RNG.uniform(0.1, 1, 100), 1.4
    cos_t = fresnel.cos_transmitted(cos_i, eta)
    np.testing.assert_allclose(
        fresnel.dielectric_between(cos_i, cos_t, eta), fresnel.dielectric(cos_i, eta), rtol=1e-12
    )
    there, back = (
        fresnel.dielectric_between(a, b, n) for a, b, n in ((cos_i, 0.9 * cos_t, eta), (0.9 * cos_t, cos_i, 1 / eta))
    )
    np.testing.assert_allclose(there, back, rtol=1e-12)


@pytest.mark.parametrize("z", [0.9, 0.2, -0.4])
def test_flights_escape_as_often_as_they_should(z: float) -> None:
    """Binomial at 4.5 standard errors; down, none escape."""
    w = (np.sqrt(1 - z * z), 0.0, z)
    rank = microsurface.fly(w, 0.6, 0.5, 0.3, RNG.uniform(size=N))
    chance = float(microsurface.escape(w, 0.6, 0.5, 0.3))
    assert abs(np.mean(rank > 1) - chance) <= 4.5 * np.sqrt(chance * (1 - chance) / N)
    assert np.all((rank > 0.6) == (z > 0))


def test_from_the_top_masking_is_smiths() -> None:
    """Averaged over heights, the chance to escape is G1."""
    w = (0.6, 0.0, 0.8)
    ranks = (np.arange(1000) + 0.5) / 1000
    mean = microsurface.escape(w, ranks, 0.5, 0.3).mean()
    assert mean == pytest.approx(ggx.masking(w, 0.5, 0.3), rel=1e-3)


@pytest.mark.parametrize("z", [0.7, -0.5])
def test_visible_normals_are_drawn_as_their_density_says(z: float) -> None:
    """Mean normals, by drawing and by quadrature, at 4.5 standard errors; directions from below included."""
    w = (np.sqrt(1 - z * z), 0.0, z)
    drawn = np.array(ggx.sample_visible(w, 0.5, 0.3, RNG.uniform(size=N), RNG.uniform(size=N)))
    cosine, phi = np.meshgrid((np.arange(400) + 0.5) / 400, 2 * np.pi * (np.arange(400) + 0.5) / 400)
    sine = np.sqrt(1 - cosine**2)
    h = (sine * np.cos(phi), sine * np.sin(phi), cosine)
    density = microsurface.visible(w, h, 0.5, 0.3) * 2 * np.pi / cosine.size
    assert density.sum() == pytest.approx(1, rel=1e-3)
    mean = [(density * x).sum() for x in h]
    assert np.all(np.abs(drawn.mean(axis=1) - mean) < 4.5 * drawn.std(axis=1) / np.sqrt(N) + 1e-3)


def test_flights_along_the_surface_and_straight_up_are_finite() -> None:
    for z in (-1e-310, 0.0, 1e-310):
        assert np.isfinite(microsurface.smith_lambda((1.0, 0.0, z), 0.5, 0.3))
    assert microsurface.fly((0.0, 0.0, 1.0), 0.6, 0.5, 0.3, 0.0) == 0.6
    assert microsurface.fly((0.0, 0.0, 1.0), 0.6, 0.5, 0.3, 1e-3) > 1


def test_no_facet_faces_down() -> None:
    w, h = (0.6, 0.0, -0.8), ggx.normalize((0.6, 0.1, -0.1))
    assert ggx.dot(w, h) > 0
    assert microsurface.visible(w, h, 0.5, 0.3) == 0
