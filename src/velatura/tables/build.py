"""Integrate the averages of Fresnel over GGX interfaces and compress them.

The directional albedo FGD of an interface (Belcour 2018, Eq. 2) is a weighted mean of Fresnel over the angle between wi
and the microfacets. Its dependence on the index is almost of low rank, and the rows of the low-rank product can be
Fresnel itself, at a few well-chosen angles:

    FGD(cos_theta, alpha; eta, kappa) = sum_r U_r(cos_theta, alpha) F(cos_r; eta, kappa).

So only U is stored, any index is exact at the angles cos_r, and gradients with respect to the index are Fresnel's own.
From inside a denser medium the bend at the critical angle moves with the index; there a three-dimensional table, whose
angular axis follows the critical angle, holds the mean of Fresnel over the reflected light, FGD / FGD(F=1).

    dielectric              U at 8 angles, for relative indices above 1
    conductor               U at 12 angles, for kappa >= eta, and for eta >= 1 with any kappa
    inside                  mean Fresnel of dielectrics of relative index below 1
    absorbing_inside        the same for kappa < eta < 1, as U at 8 angles that follow the critical angle
    tir_published           mean of 1 - F(cos_theta_o) for relative indices below 1 (Belcour 2018, 5.1, as released)
    tir_published_outside   its U at 8 angles, for relative indices above 1
    tir_clean               energy fraction reflected within the critical cone
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from time import perf_counter

import numpy as np
from scipy.linalg import lstsq, qr
from scipy.stats import qmc

from velatura.optics import fresnel
from velatura.tables import coordinates
from velatura.tables.quadrature import Reflections, reflections
from velatura.tables.store import Table, Tables

PLANE = (64, 64)  # nodes over cosine and roughness
INSIDE = (68, 40, 50)  # over angle, roughness and critical angle
TIR = (64, 48, 54)
ABSORBING = (40, 20, 16)
DIELECTRIC_RANK, CONDUCTOR_RANK = 8, 12
ABSORBING_ANGLES = (0.15, 0.3, 0.4, 0.45, 0.5, 0.55, 0.7, 1.0)  # as coordinates on the angular axis

COS_MIN, ALPHA_MIN = 1e-3, 1e-3  # stand in for 0, where quadrature would divide by it
FINE = 512  # nodes in the cosine for integrals against a fixed density
CHUNK = 64  # points integrated at a time: their nodes fit the cache

Progress = Callable[[float], None]  # is told the share that is done


@dataclass(frozen=True)
class Built:
    """The tables and the seconds that each took."""

    tables: Tables
    seconds: dict[str, float]


def build(progress: Progress = lambda done: None) -> Built:
    """All tables from nothing; deterministic."""
    reflected = cache(lambda: density_over_plane("cos_d", *plane()))
    makers: dict[str, Callable[[Progress], Table]] = {
        "dielectric": lambda p: _low_rank(reflected(), _dielectrics(), DIELECTRIC_RANK),
        "conductor": lambda p: _low_rank(reflected(), _conductors(), CONDUCTOR_RANK),
        "inside": lambda p: _follow_critical_angle(INSIDE, _mean_fresnel, "cos_d", p),
        "absorbing_inside": _absorbing_inside,
        "tir_published": lambda p: _follow_critical_angle(TIR, _mean_transmittance_out, "cos_o", p),
        "tir_published_outside": lambda p: _low_rank(
            _normalised(density_over_plane("cos_o", *plane(), p)), _dielectrics(), DIELECTRIC_RANK
        ),
        "tir_clean": lambda p: _follow_critical_angle(TIR, _share_in_cone, "cos_o", p),
    }
    tables, seconds = {}, {}
    for i, (name, make) in enumerate(makers.items()):
        start = perf_counter()
        tables[name] = make(lambda done, i=i: progress((i + done) / len(makers)))
        seconds[name] = perf_counter() - start
        progress((i + 1) / len(makers))
    return Built(Tables(**tables), seconds)


# --- low rank: relative indices above 1, and metals ---------------------------------------------------------------


def fine_cosines() -> np.ndarray:
    return np.linspace(0, 1, FINE) ** 2


def density(points: Iterator[Reflections], cosine: str) -> np.ndarray:
    """Weights (points, FINE) of a function given at `fine_cosines` and linear between them."""
    fine, rows = fine_cosines(), []
    for r in points:
        c = getattr(r, cosine)
        cell = np.minimum((np.sqrt(c) * (FINE - 1)).astype(int), FINE - 2)
        upper = (c - fine[cell]) / (fine[cell + 1] - fine[cell])
        index = (np.arange(len(c))[:, None] * FINE + cell).ravel()
        size = len(c) * FINE
        low = np.bincount(index, (r.weight * (1 - upper)).ravel(), minlength=size)
        high = np.bincount(index + 1, (r.weight * upper).ravel(), minlength=size)
        rows.append((low + high).reshape(len(c), FINE))
    return np.concatenate(rows)


def plane() -> tuple[np.ndarray, np.ndarray]:
    """Cosines and roughnesses at the nodes of the low-rank tables."""
    x, y = (np.linspace(0, 1, n) for n in PLANE)
    return coordinates.to_cosine(x), coordinates.to_roughness(y)


def density_over_plane(
    cosine: str, cos_theta: np.ndarray, alpha: np.ndarray, progress: Progress = lambda done: None
) -> np.ndarray:
    """`density` at all pairs of a cosine and a roughness, shape (len(cos_theta), len(alpha), FINE)."""
    c, a = (axis.ravel() for axis in np.meshgrid(cos_theta, alpha, indexing="ij"))
    points = integrate(np.maximum(c, COS_MIN), np.maximum(a, ALPHA_MIN), np.zeros(c.size), progress)
    return density(points, cosine).reshape(len(cos_theta), len(alpha), FINE)


def integrate(
    cos_theta: np.ndarray,
    alpha: np.ndarray,
    cos_critical: np.ndarray,
    progress: Progress = lambda done: None,
    bend: str = "cos_d",
) -> Iterator[Reflections]:
    """`reflections` in chunks."""
    for start in range(0, len(alpha), CHUNK):
        chunk = slice(start, start + CHUNK)
        yield reflections(cos_theta[chunk], alpha[chunk], cos_critical[chunk], bend)
        progress(min(1.0, (start + CHUNK) / len(alpha)))


def _normalised(weights: np.ndarray) -> np.ndarray:
    return weights / weights.sum(axis=-1, keepdims=True)


def _dielectrics() -> tuple[np.ndarray, np.ndarray]:
    eta = np.concatenate([np.linspace(1, 4, 800), 1 + np.geomspace(1e-4, 0.1, 5), np.linspace(1, 12, 100)])
    return eta, np.zeros_like(eta)


def _conductors() -> tuple[np.ndarray, np.ndarray]:
    u, v = qmc.Halton(2, scramble=False).random(2000).T
    eta = np.concatenate([0.05 + 3.95 * u, 0.05 + 0.25 * u[:150]])  # the second part: silver, and metals under coats
    kappa = np.concatenate([4 * v, 0.5 * v[:150]])
    smooth = (kappa >= eta) | (eta >= 1)
    high = 1 + 24 * u[:100]  # what the inverse asks for
    return np.concatenate([eta[smooth], high]), np.concatenate([kappa[smooth], high * (1 + 1.5 * v[:100])])


def _low_rank(weights: np.ndarray, indices: tuple[np.ndarray, np.ndarray], rank: int) -> Table:
    """Angles cos_r by pivoted QR of 1 - F, then U by least squares; the rows of U sum to the albedo of a mirror.

    Averages weigh small cosines little, and so does the choice of angles. The first angle is grazing, where F = 1.
    """
    curves = 1 - fresnel.conductor(fine_cosines()[:, None], *indices)
    importance = fine_cosines()[:, None] ** 0.25
    pivots = np.sort(qr((curves * importance).T, mode="r", pivoting=True)[1][: rank - 1])
    flat = weights.reshape(-1, FINE)
    u = lstsq(curves[pivots].T, (flat @ curves).T)[0].T
    u = np.column_stack([flat.sum(axis=1) - u.sum(axis=1), u])
    nodes = (0.0, *fine_cosines()[pivots].tolist())
    return Table(u.reshape(*weights.shape[:-1], rank).astype(np.float32), nodes)


# --- three dimensions: relative indices below 1 -------------------------------------------------------------------


def _follow_critical_angle(
    shape: tuple[int, int, int],
    average: Callable[[Reflections, np.ndarray], np.ndarray],
    bend: str,
    progress: Progress,
) -> Table:
    """A table over (angle, roughness, critical angle) of averages, of shape (points, channels), that have a bend."""
    cos_theta, alpha, theta_c = _points_inside(shape)
    eta = np.sin(theta_c)
    points = integrate(cos_theta, alpha, np.cos(theta_c), progress, bend)
    rows = [average(r, eta[i * CHUNK : (i + 1) * CHUNK, None]) for i, r in enumerate(points)]
    return Table(np.concatenate(rows).reshape(*shape, -1).astype(np.float32))


def _points_inside(shape: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x, y, z = (axis.ravel() for axis in np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij"))
    theta_c = coordinates.to_critical_angle(z)
    cos_theta = np.clip(coordinates.to_angle(x, theta_c), COS_MIN, 1)
    return cos_theta, np.maximum(coordinates.to_roughness(y), ALPHA_MIN), theta_c


def _absorbing_inside(progress: Progress) -> Table:
    """Per critical angle, U by least squares over extinctions from 0 to eta, at angles fixed on the angular axis."""
    cos_theta, alpha, theta_c = (axis.reshape(ABSORBING) for axis in _points_inside(ABSORBING))
    slices = []
    for i, theta in enumerate(theta_c[0, 0]):
        c, a = cos_theta[:, :, i].ravel(), alpha[:, :, i].ravel()
        reflected = density(integrate(c, a, np.full(c.size, np.cos(theta))), "cos_d")
        eta = np.sin(theta)
        kappa = eta * np.linspace(0, 1, 32) ** 2
        curves = 1 - fresnel.conductor(fine_cosines()[:, None], eta, kappa)
        rows = 1 - fresnel.conductor(coordinates.to_angle(np.array(ABSORBING_ANGLES), theta)[:, None], eta, kappa)
        slices.append(lstsq(rows.T, (_normalised(reflected) @ curves).T, cond=1e-3)[0].T)
        progress((i + 1) / ABSORBING[2])
    data = np.stack(slices, axis=1).reshape(*ABSORBING, -1)
    return Table(data.astype(np.float32), ABSORBING_ANGLES)


def _mean(r: Reflections, values: np.ndarray) -> np.ndarray:
    return (r.weight * values).sum(axis=1) / r.weight.sum(axis=1)


def _mean_fresnel(r: Reflections, eta: np.ndarray) -> np.ndarray:
    return _mean(r, fresnel.dielectric(r.cos_d, eta))[:, None]


def _mean_transmittance_out(r: Reflections, eta: np.ndarray) -> np.ndarray:
    return _mean(r, 1 - fresnel.dielectric(r.cos_o, eta))[:, None]


def _share_in_cone(r: Reflections, eta: np.ndarray) -> np.ndarray:
    return _mean(r, r.cos_o > np.sqrt(1 - eta * eta))[:, None]
