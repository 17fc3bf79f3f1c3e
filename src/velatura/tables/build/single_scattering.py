"""Averages of Fresnel over single reflections at GGX interfaces, compressed.

The directional albedo FGD of an interface (Belcour 2018, Eq. 2) is a weighted mean of Fresnel over the angle between wi
and the microfacets. Its dependence on the index is almost of low rank, and the rows of the low-rank product can be
Fresnel itself, at a few well-chosen angles:

    FGD(cos_theta, alpha; eta, kappa) = sum_r U_r(cos_theta, alpha) F(cos_r; eta, kappa).

So only U is stored, any index is exact at the angles cos_r, and gradients with respect to the index are Fresnel's own.
From inside a denser medium the bend at the critical angle moves with the index; there a three-dimensional table, whose
angular axis follows the critical angle, holds the mean of Fresnel over the reflected light, FGD / FGD(F=1).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.linalg import lstsq, qr
from scipy.stats import qmc

from velatura.optics import fresnel
from velatura.tables import coordinates
from velatura.tables.build.quadrature import ALPHA_MIN, COS_MIN, Progress, Reflections, average, ignore
from velatura.tables.store import Table

PLANE = (48, 48)  # nodes over cosine and roughness
INSIDE = (65, 40, 56)  # over angle, roughness and critical angle; odd, for a node at the critical angle itself
ABSORBING = (36, 16, 20)  # likewise
DIELECTRIC_RANK, CONDUCTOR_RANK = 8, 12
ABSORBING_ANGLES = (0.15, 0.3, 0.4, 0.45, 0.5, 0.56, 0.68, 0.84, 1.0)  # as coordinates on the angular axis

FINE = 512  # nodes in the cosine for integrals against a fixed density


def makers() -> dict[str, Callable[[Progress], Table]]:
    """The functions that make the tables of single reflections, by name."""
    reflected = cache(lambda: density_over_plane("cos_d", *plane()))
    return {
        "dielectric": lambda p: _low_rank(reflected(), dielectrics(), DIELECTRIC_RANK),
        "conductor": lambda p: _low_rank(reflected(), conductors(), CONDUCTOR_RANK),
        "inside": lambda p: _follow_critical_angle(mean_fresnel, "cos_d", p),
        "absorbing_inside": _absorbing_inside,
        "tir_published": lambda p: _follow_critical_angle(mean_transmittance_out, "cos_o", p),
        "tir_published_outside": lambda p: _low_rank(
            _normalised(density_over_plane("cos_o", *plane(), progress=p)), dielectrics(), DIELECTRIC_RANK
        ),
        "tir_clean": lambda p: _follow_critical_angle(share_in_cone, "cos_o", p),
    }


def closest_interpolant(values: np.ndarray) -> np.ndarray:
    """Node values, channels on the last axis, whose linear interpolation is closest to a function known at the nodes.

    Chords of a curve lie to one side of it. Moving the inner nodes by a twelfth of the second difference, per axis, is
    the least-squares answer for a parabola and takes the error to 1 / sqrt(6) of that of the chords.
    """
    moved = values.copy()
    for axis in range(values.ndim - 1):
        v, m = np.moveaxis(values, axis, 0), np.moveaxis(moved, axis, 0)
        m[1:-1] -= (v[2:] - 2 * v[1:-1] + v[:-2]) / 12
    return moved


# --- low rank: relative indices above 1, and metals ---------------------------------------------------------------


def fine_cosines() -> np.ndarray:
    return np.linspace(0, 1, FINE) ** 2


def density(r: Reflections, cosine: str) -> np.ndarray:
    """Weights (points, FINE) of a function given at `fine_cosines` and linear between them."""
    fine, c = fine_cosines(), getattr(r, cosine)
    cell = np.minimum((np.sqrt(c) * (FINE - 1)).astype(int), FINE - 2)
    upper = (c - fine[cell]) / (fine[cell + 1] - fine[cell])
    index = (np.arange(len(c))[:, None] * FINE + cell).ravel()
    size = len(c) * FINE
    low = np.bincount(index, (r.weight * (1 - upper)).ravel(), minlength=size)
    high = np.bincount(index + 1, (r.weight * upper).ravel(), minlength=size)
    return (low + high).reshape(len(c), FINE)


def plane() -> tuple[np.ndarray, np.ndarray]:
    """Cosines and roughnesses at the nodes of the low-rank tables."""
    x, y = (np.linspace(0, 1, n) for n in PLANE)
    return coordinates.to_cosine(x), coordinates.to_roughness(y)


def density_over_plane(
    cosine: str, cos_theta: np.ndarray, alpha: np.ndarray, correlated: bool = False, progress: Progress = ignore
) -> np.ndarray:
    """`density` at all pairs of a cosine and a roughness, shape (len(cos_theta), len(alpha), FINE)."""
    c, a = (axis.ravel() for axis in np.meshgrid(cos_theta, alpha, indexing="ij"))
    c, a = np.maximum(c, COS_MIN), np.maximum(a, ALPHA_MIN)
    weights = average(lambda r: density(r, cosine), cosine, c, a, correlated=correlated, progress=progress)
    return weights.reshape(len(cos_theta), len(alpha), FINE)


def _normalised(weights: np.ndarray) -> np.ndarray:
    return weights / weights.sum(axis=-1, keepdims=True)


def dielectrics() -> tuple[np.ndarray, np.ndarray]:
    eta = np.concatenate([np.linspace(1, 4, 800), 1 + np.geomspace(1e-4, 0.1, 5), np.linspace(1, 12, 100)])
    return eta, np.zeros_like(eta)


def conductors() -> tuple[np.ndarray, np.ndarray]:
    u, v = qmc.Halton(2, scramble=False).random(2000).T
    eta = np.concatenate([0.05 + 3.95 * u, 0.05 + 0.25 * u[:150]])  # the second part: silver, and metals under coats
    kappa = np.concatenate([4 * v, 0.5 * v[:150]])
    smooth = (kappa >= eta) | (eta >= 1)
    high = 1 + 24 * u[:100]  # as the inverse requests
    return np.concatenate([eta[smooth], high]), np.concatenate([kappa[smooth], high * (1 + 1.5 * v[:100])])


def _low_rank(weights: np.ndarray, indices: tuple[np.ndarray, np.ndarray], rank: int) -> Table:
    """Angles cos_r by pivoted QR of 1 - F, then U by least squares; the rows of U sum to the albedo of a mirror.

    The first angle is grazing, where F = 1.
    """
    curves = 1 - fresnel.conductor(fine_cosines()[:, None], *indices)
    pivots = choose_angles(curves, rank - 1)
    flat = weights.reshape(-1, FINE)
    u = lstsq(curves[pivots].T, (flat @ curves).T)[0].T
    u = np.column_stack([flat.sum(axis=1) - u.sum(axis=1), u])
    nodes = (0.0, *fine_cosines()[pivots].tolist())
    return Table(closest_interpolant(u.reshape(*weights.shape[:-1], rank)).astype(np.float32), nodes)


def choose_angles(curves: np.ndarray, count: int) -> np.ndarray:
    """The `fine_cosines` whose rows of the curves, shape (FINE, indices), span the others best.

    Averages weigh small cosines little, and so does the choice.
    """
    importance = fine_cosines()[:, None] ** 0.25
    return np.sort(qr((curves * importance).T, mode="r", pivoting=True)[1][:count])


# --- three dimensions: relative indices below 1 -------------------------------------------------------------------


def _follow_critical_angle(of: Callable[..., np.ndarray], bend: str, progress: Progress) -> Table:
    """A table over (angle, roughness, critical angle)."""
    cos_theta, alpha, theta_c = points_inside(INSIDE)
    values = average(of, bend, cos_theta, alpha, np.sin(theta_c), progress=progress).reshape(*INSIDE, 1)
    return Table(np.clip(closest_interpolant(values), 0, 1).astype(np.float32))


def points_inside(shape: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x, y, z = (axis.ravel() for axis in np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij"))
    theta_c = coordinates.to_critical_angle(z)
    cos_theta = np.clip(coordinates.to_angle(x, theta_c), COS_MIN, 1)
    return cos_theta, np.maximum(coordinates.to_roughness(y), ALPHA_MIN), theta_c


def _absorbing_inside(progress: Progress) -> Table:
    """U by critical angle, by least squares over extinctions from 0 to eta, at angles fixed on the angular axis."""
    cos_theta, alpha, theta_c = (axis.reshape(ABSORBING) for axis in points_inside(ABSORBING))
    slices = []
    for i, theta in enumerate(theta_c[0, 0]):
        c, a = cos_theta[:, :, i].ravel(), alpha[:, :, i].ravel()
        eta = np.sin(theta)
        reflected = average(lambda r, _: density(r, "cos_d"), "cos_d", c, a, np.full(c.size, eta))
        kappa = eta * np.linspace(0, 1, 32) ** 2
        curves = 1 - fresnel.conductor(fine_cosines()[:, None], eta, kappa)
        rows = 1 - fresnel.conductor(coordinates.to_angle(np.array(ABSORBING_ANGLES), theta)[:, None], eta, kappa)
        slices.append(lstsq(rows.T, (_normalised(reflected) @ curves).T, cond=1e-3)[0].T)
        progress((i + 1) / ABSORBING[2])
    data = np.stack(slices, axis=1).reshape(*ABSORBING, -1)
    return Table(closest_interpolant(data).astype(np.float32), ABSORBING_ANGLES)


# --- the averages -------------------------------------------------------------------------------------------------


def mean_fresnel(r: Reflections, eta: np.ndarray) -> np.ndarray:
    """Mean Fresnel of dielectrics over the light that a mirror would reflect."""
    return _mean(r, fresnel.dielectric(r.cos_d, eta))


def mean_transmittance_out(r: Reflections, eta: np.ndarray) -> np.ndarray:
    """Mean of 1 - F at the angle of the way out."""
    return _mean(r, 1 - fresnel.dielectric(r.cos_o, eta))


def share_in_cone(r: Reflections, eta: np.ndarray) -> np.ndarray:
    """Share of the light that leaves within the critical cone."""
    return _mean(r, r.cos_o > np.sqrt(np.maximum(1 - eta * eta, 0)))


def _mean(r: Reflections, values: np.ndarray) -> np.ndarray:
    return (r.weight * values).sum(axis=1) / r.weight.sum(axis=1)
