"""One interface and one medium: published values, the laws of optics, quadrature, and Mitsuba's own functions."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import acos, atan, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import chi2

from velatura import kernel
from velatura.optics import fresnel, ggx, phase

Sampler = Callable[[ggx.Direction, float, float, np.ndarray, np.ndarray], ggx.Direction]

COSINES = np.linspace(0.001, 1, 400)
cosines = st.floats(1e-3, 1)


@pytest.fixture(scope="module")
def mi() -> Any:
    return kernel.mitsuba("llvm_ad_rgb")


def direction(theta: float, phi: float) -> ggx.Direction:
    return np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)


# Fresnel


@pytest.mark.parametrize(
    ("degrees", "eta", "reflectance"),
    [
        (0, 1.5, 0.04),
        (0, 1 / 1.5, 0.04),
        (0, 4.0, 0.36),
        (45, 1.5, 0.0502399),
        (60, 1.5, 0.0891867),
        (np.degrees(atan(1.5)), 1.5, 0.5 * (1.25 / 3.25) ** 2),  # Brewster: nothing of the p wave
        (90, 1.5, 1.0),
        (30, 1.0, 0.0),
    ],
)
def test_dielectric_known_values(degrees: float, eta: float, reflectance: float) -> None:
    assert fresnel.dielectric(float(np.cos(np.radians(degrees))), eta) == pytest.approx(reflectance, abs=1e-7)


def test_conductor_is_the_square_of_the_complex_amplitudes() -> None:
    eta, kappa = np.random.default_rng(0).uniform([0.05, 0], [5, 6], (400, 2)).T
    n = eta + 1j * kappa
    cos_t = np.sqrt(1 - (1 - COSINES**2) / n**2)
    r_s = (COSINES - n * cos_t) / (COSINES + n * cos_t)
    r_p = (n * COSINES - cos_t) / (n * COSINES + cos_t)
    expected = (np.abs(r_s) ** 2 + np.abs(r_p) ** 2) / 2
    np.testing.assert_allclose(fresnel.conductor(COSINES, eta, kappa), expected, atol=1e-12)


@pytest.mark.parametrize("eta", [0.05, 0.5, 0.99, 1.0, 1.01, 1.5, 8.0])
def test_conductor_without_extinction_is_a_dielectric(eta: float) -> None:
    np.testing.assert_allclose(fresnel.conductor(COSINES, eta, 0.0), fresnel.dielectric(COSINES, eta), atol=1e-7)


@given(cosines, st.floats(0.1, 10))
def test_fresnel_is_reciprocal(cos_theta: float, eta: float) -> None:
    """F(cos; n) = F(cos'; 1/n) with cos' on the other side of the interface."""
    assume(cos_theta**2 > 1 - eta**2 + 1e-6)
    other_side = fresnel.cos_transmitted(cos_theta, eta)
    assert fresnel.dielectric(cos_theta, eta) == pytest.approx(fresnel.dielectric(other_side, 1 / eta), abs=1e-6)


@given(cosines, st.floats(0.05, 0.95))
def test_total_reflection_beyond_the_critical_angle(cos_theta: float, eta: float) -> None:
    beyond = 1 - eta**2 - cos_theta**2
    assume(abs(beyond) > 1e-9)
    total = beyond > 0
    assert (fresnel.dielectric(cos_theta, eta) == 1) is total
    assert (fresnel.cos_transmitted(cos_theta, eta) == 0) is total


@given(cosines, st.floats(0.01, 30), st.floats(0, 50))
def test_fresnel_is_a_share(cos_theta: float, eta: float, kappa: float) -> None:
    assert 0 <= fresnel.conductor(cos_theta, eta, kappa) <= 1
    assert 0 <= fresnel.dielectric(cos_theta, eta) <= 1


def test_an_index_of_any_size_keeps_reflectance_finite_in_single_precision() -> None:
    """From 1e-3 to 1e4: at the normal 1 - 4 / eta reflects."""
    found = fresnel.dielectric(np.float32([1.0, 0.5, 1e-4]), 1e7)
    assert found[0] == pytest.approx(1 - 4e-7, abs=5e-6) and ((found > 0.9) & (found <= 1)).all()
    (above,) = fresnel.dielectric_between(np.float32([1.0]), np.float32([1.0]), 1e7)
    assert above == pytest.approx(1, abs=5e-6)


def test_opposite_directions_have_a_finite_density_of_normals() -> None:
    """Their half-vector is 0, in floats, where a division by 0 raises."""
    assert np.isfinite(ggx.ndf((0.0, 0.0, 0.0), 0.2, 0.2))


def test_schlick() -> None:
    assert fresnel.schlick(1.0, 0.04) == 0.04
    assert fresnel.schlick(0.0, 0.04) == 1
    assert fresnel.schlick(0.5, 0.04) == pytest.approx(0.04 + 0.96 / 32)
    error = fresnel.schlick(COSINES, 0.04) - fresnel.dielectric(COSINES, 1.5)
    assert np.abs(error).max() < 0.04  # what it is known to be off by at an index of 1.5


@given(st.floats(0.05, 10), st.floats(0, 10))
def test_normal_incidence(eta: float, kappa: float) -> None:
    assert fresnel.normal_incidence(eta, kappa) == pytest.approx(fresnel.conductor(1.0, eta, kappa), abs=1e-7)


def test_fresnel_agrees_with_mitsuba(mi: Any) -> None:
    cos_theta, eta, kappa = np.random.default_rng(1).uniform([0, 0.1, 0], [1, 4, 5], (1000, 3)).T.astype(np.float32)
    c, n, k = mi.Float(cos_theta), mi.Float(eta), mi.Float(kappa)
    np.testing.assert_allclose(fresnel.dielectric(c, n).numpy(), mi.fresnel(c, n)[0].numpy(), atol=2e-5)
    theirs = mi.fresnel_conductor(c, mi.Complex2f(n, k)).numpy()
    np.testing.assert_allclose(fresnel.conductor(c, n, k).numpy(), theirs, atol=2e-5)


def test_fresnel_has_finite_gradients_everywhere(mi: Any) -> None:
    """Grazing light, equal indices, no extinction, the critical angle: each an edge of some square root or quotient."""
    import drjit as dr

    points = np.meshgrid([0, 1e-4, 0.8, 1], [0.05, 0.6, 1, 1.5], [0, 0.6, 3])
    arguments = [mi.Float(p.ravel().astype(np.float32)) for p in points]
    for function, count in ((fresnel.dielectric, 2), (fresnel.conductor, 3)):
        for argument in arguments[:count]:
            dr.enable_grad(argument)
        value = function(*arguments[:count])
        dr.backward(value)
        assert np.isfinite(value.numpy()).all()
        for argument in arguments[:count]:
            assert np.isfinite(argument.grad.numpy()).all()
            dr.disable_grad(argument)


# GGX

ROUGHNESSES = [(0.05, 0.05), (0.3, 0.3), (1.0, 1.0), (0.1, 0.5), (0.8, 0.2)]


gauss_legendre = cache(np.polynomial.legendre.leggauss)


def normals(alpha_u: float, alpha_v: float, count: int = 400) -> tuple[ggx.Direction, np.ndarray]:
    """Nodes over the hemisphere of normals and their solid angles, for smooth integrands."""
    x, w = gauss_legendre(count)
    s, w = (x + 1) * pi / 4, w * pi / 4
    scale = sqrt(alpha_u * alpha_v)
    theta = np.arctan(scale * np.tan(s))  # follows the width of the distribution
    d_theta = w * scale / np.cos(s) ** 2 / (1 + (scale * np.tan(s)) ** 2)
    phi = (np.arange(count) + 0.5) * 2 * pi / count
    h = tuple(np.broadcast_arrays(*direction(theta[:, None], phi)))
    return h, (d_theta * np.sin(theta) * 2 * pi / count)[:, None]  # type: ignore[return-value]


@pytest.mark.parametrize("alpha", ROUGHNESSES)
def test_projected_normals_cover_the_surface_once(alpha: tuple[float, float]) -> None:
    h, solid_angle = normals(*alpha)
    assert np.sum(ggx.ndf(h, *alpha) * h[2] * solid_angle) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("alpha", ROUGHNESSES)
@pytest.mark.parametrize(("theta", "phi"), [(0.0, 0.0), (0.6, 0.3), (1.3, 2.0), (1.5, -1.0)])
def test_visible_normals_cover_what_is_seen(alpha: tuple[float, float], theta: float, phi: float) -> None:
    """Smith's masking is defined by this: the visible facets together look as large as the surface."""
    w = direction(theta, phi)
    h, solid_angle = normals(*alpha)
    seen = ggx.masking(w, *alpha) * np.sum(ggx.ndf(h, *alpha) * np.maximum(ggx.dot(w, h), 0) * solid_angle)
    assert seen == pytest.approx(w[2], rel=1e-3)


@given(st.floats(0, 1.57), st.floats(-pi, pi), st.floats(1e-3, 1), st.floats(1e-3, 1))
def test_masking_closed_form(theta: float, phi: float, alpha_u: float, alpha_v: float) -> None:
    across = (alpha_u * np.cos(phi)) ** 2 + (alpha_v * np.sin(phi)) ** 2
    expected = 2 / (1 + sqrt(1 + across * np.tan(theta) ** 2))  # Heitz 2014, Eqs. 43 and 72
    assert ggx.masking(direction(theta, phi), alpha_u, alpha_v) == pytest.approx(expected, rel=1e-9)


def test_nothing_is_seen_from_below() -> None:
    assert ggx.masking((0.6, 0.0, -0.8), 0.3, 0.3) == 0
    assert ggx.masking((1.0, 0.0, 0.0), 0.3, 0.3) == 0


@pytest.mark.parametrize("alpha", ROUGHNESSES)
def test_ggx_agrees_with_mitsuba(alpha: tuple[float, float], mi: Any) -> None:
    theirs = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, *alpha, sample_visible=True)
    u = np.random.default_rng(2).uniform(size=(4, 1000)).astype(np.float32)
    h = mi.Vector3f(*direction(np.arctan(0.3 * np.tan(u[0] * 1.5)), 2 * pi * u[1]))
    w = mi.Vector3f(*direction(u[2] * 1.5, 2 * pi * u[3]))
    np.testing.assert_allclose(ggx.ndf(tuple(h), *alpha).numpy(), theirs.eval(h).numpy(), rtol=2e-4)
    seen = mi.Vector3f(0, 0, 1)  # a facet that faces every direction
    np.testing.assert_allclose(ggx.masking(tuple(w), *alpha).numpy(), theirs.smith_g1(w, seen).numpy(), rtol=2e-4)


def test_reflection_is_symmetric_about_the_normal() -> None:
    w, h = direction(0.7, 0.4), direction(0.3, 2.0)
    o = ggx.reflect(w, h)
    assert ggx.dot(o, o) == pytest.approx(1)
    assert ggx.dot(o, h) == pytest.approx(ggx.dot(w, h))
    np.testing.assert_allclose(ggx.normalize(tuple(a + b for a, b in zip(w, o))), h, atol=1e-12)


def test_a_frame_turns_anticlockwise() -> None:
    """The tangent of a frame turned by 30 degrees points 30 degrees anticlockwise from the old one."""
    angle = pi / 6
    np.testing.assert_allclose(ggx.rotate((np.cos(angle), np.sin(angle), 0.0), angle), (1, 0, 0), atol=1e-12)


# What is sampled

CASES = [  # alpha_u, alpha_v, rotation, theta, phi
    (0.3, 0.3, 0.0, 0.0, 0.0),
    (0.05, 0.05, 0.0, 1.2, 0.5),
    (1.0, 1.0, 0.0, 0.8, 0.0),
    (0.1, 0.5, 0.0, 1.0, 0.7),
    (0.8, 0.2, 0.6, 1.3, -2.0),
    (0.02, 0.9, 2.0, 1.5, 1.0),
]
SAMPLES, CELLS = 200_000, (24, 32)
FALSE_ALARM = 1e-3 / len(CASES)  # so that a right sampler fails the lot for one seed in a thousand


def chi_square(case: tuple[float, ...], sampler: Sampler, plot: Path) -> float:
    """The p-value of normals drawn by a sampler, against the density G1 D max(w.h, 0) / cos_theta."""
    observed, expected = _observed(case, sampler), SAMPLES * _expected(case)

    # Pool the cells that expect few
    order = np.argsort(expected, axis=None)
    few = int(np.searchsorted(np.cumsum(expected.flat[order]), 10)) + 1
    o, e = (np.append(cells.flat[order][few:], cells.flat[order][:few].sum()) for cells in (observed, expected))
    p = float(chi2.sf(np.sum((o - e) ** 2 / e), len(o) - 1))
    if p < FALSE_ALARM:
        _plot(observed, expected, plot)
    return p


def _observed(case: tuple[float, ...], sampler: Sampler) -> np.ndarray:
    """Drawn normals counted over cells that all normals, seen or not, would fill evenly."""
    alpha_u, alpha_v, rotation, theta, phi = case
    u = np.random.default_rng(3).uniform(size=(2, SAMPLES))
    h = ggx.rotate(sampler(ggx.rotate(direction(theta, phi), rotation), alpha_u, alpha_v, *u), -rotation)
    slope = _turn(rotation) @ np.array([h[0] / h[2], h[1] / h[2]]) / [[alpha_u], [alpha_v]]
    r2 = np.sum(slope**2, axis=0)
    edges = np.linspace(0, 1, CELLS[0] + 1), np.linspace(-pi, pi, CELLS[1] + 1)
    return np.histogram2d(r2 / (1 + r2), np.arctan2(slope[1], slope[0]), edges)[0]


def _expected(case: tuple[float, ...], nodes: int = 16) -> np.ndarray:
    """The integral of the density over the same cells."""
    alpha_u, alpha_v, rotation, theta, phi = case
    w = (*(_turn(rotation) @ direction(theta, phi)[:2]), np.cos(theta))
    x, weight = np.polynomial.legendre.leggauss(nodes)
    share, azimuth = (((np.arange(n)[:, None] + (x + 1) / 2) / n).ravel() for n in CELLS)
    share, azimuth = share[:, None], (2 * azimuth - 1) * pi
    r = np.sqrt(share / (1 - share))
    h = ggx.normalize((alpha_u * r * np.cos(azimuth), alpha_v * r * np.sin(azimuth), np.ones_like(r * azimuth)))
    solid_angle = h[2] ** 3 * alpha_u * alpha_v / (2 * (1 - share) ** 2)
    visible = ggx.masking(w, alpha_u, alpha_v) * np.maximum(ggx.dot(w, h), 0) / w[2]
    density = ggx.ndf(h, alpha_u, alpha_v) * visible * solid_angle
    sums = np.einsum("iajb,a,b->ij", density.reshape(CELLS[0], nodes, CELLS[1], nodes), weight / 2, weight / 2)
    return sums * 2 * pi / (CELLS[0] * CELLS[1])


def _turn(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def _plot(observed: np.ndarray, expected: np.ndarray, path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 3))
    for axes, values, title in zip(
        figure.subplots(1, 3), (observed, expected, observed - expected), ("observed", "expected", "difference")
    ):
        figure.colorbar(axes.imshow(values), ax=axes)
        axes.set_title(title)
    figure.savefig(path)


@pytest.mark.parametrize("case", CASES)
def test_visible_normals_are_distributed_as_they_say(case: tuple[float, ...], tmp_path: Path) -> None:
    plot = tmp_path / "visible-normals.png"
    assert chi_square(case, ggx.sample_visible, plot) > FALSE_ALARM, f"see {plot}"


def test_normals_drawn_without_regard_to_visibility_fail(tmp_path: Path) -> None:
    def all_normals(w: ggx.Direction, alpha_u: float, alpha_v: float, u: np.ndarray, v: np.ndarray) -> ggx.Direction:
        r = np.sqrt(u / (1 - u))
        x, y = alpha_u * r * np.cos(2 * pi * v), alpha_v * r * np.sin(2 * pi * v)
        return ggx.normalize((x, y, np.ones_like(x)))

    plot = tmp_path / "all-normals.png"
    assert chi_square(CASES[3], all_normals, plot) < 1e-6
    assert plot.exists()


# Henyey-Greenstein

ASYMMETRIES = [-0.9, -0.3, 0.0, 0.5, 0.75, 0.96]


@pytest.mark.parametrize("g", ASYMMETRIES)
def test_phase_function_is_normalised_and_has_mean_cosine_g(g: float) -> None:
    def moment(power: int) -> float:
        return quad(lambda c: 2 * pi * phase.henyey_greenstein(c, g) * c**power, -1, 1, epsabs=1e-10, limit=200)[0]

    assert moment(0) == pytest.approx(1, abs=1e-8)
    assert moment(1) == pytest.approx(g, abs=1e-8)


@pytest.mark.parametrize("g", ASYMMETRIES)
def test_the_share_scattered_forwards_is_the_integral_over_the_half_in_front(g: float) -> None:
    in_front = quad(lambda c: 2 * pi * phase.henyey_greenstein(c, g), 0, 1, epsabs=1e-10, limit=200)[0]
    assert phase.forwards(g) == pytest.approx(in_front, abs=1e-8 if g else 1e-3)  # an even phase function has g of 1e-3


@pytest.mark.parametrize("g", ASYMMETRIES)
@pytest.mark.parametrize("u", [0.0, 0.1, 0.5, 0.99])
def test_phase_sampling_inverts_the_distribution(g: float, u: float) -> None:
    cos_theta = phase.sample_henyey_greenstein(g, u)
    below = quad(lambda c: 2 * pi * phase.henyey_greenstein(c, g), -1, cos_theta, epsabs=1e-10, limit=200)[0]
    assert below == pytest.approx(u, abs=1e-8)


def test_isotropic_scattering() -> None:
    assert phase.henyey_greenstein(0.3, 0.0) == pytest.approx(1 / (4 * pi))
    assert acos(phase.sample_henyey_greenstein(0.0, 0.25)) == pytest.approx(2 * pi / 3)


def test_strong_forward_scattering_keeps_its_digits_in_single_precision(mi: Any) -> None:
    g = 0.999
    ours = phase.henyey_greenstein(mi.Float(1.0), mi.Float(g))[0]
    assert ours == pytest.approx((1 + g) / (4 * pi * (1 - g) ** 2), rel=1e-3)
