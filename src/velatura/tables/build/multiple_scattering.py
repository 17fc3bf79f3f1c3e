"""Energy reflected by GGX interfaces after any number of bounces between the facets, compressed.

The albedo (FGD-infinity in Belcour 2018, 4.1) is what the first meeting with a facet reflects, by quadrature with
height-correlated masking, and what later ones do, by smooth fits to random walks. A mirror loses nothing: its albedo is
1. Light that meets facets of a metal n times brings a product of n Fresnels, and such products are spanned by powers of
Fresnel at a few angles:

    E(cos_theta, alpha; eta, kappa) = sum_r U_r(cos_theta, alpha) F(cos_r; eta, kappa)^p_r,   sum_r U_r = 1.

So the tables are those of single reflections with a few channels more.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from scipy.interpolate import BSpline
from scipy.linalg import lstsq

from velatura.optics import fresnel
from velatura.tables import coordinates, microsurface_walks
from velatura.tables.build import single_scattering
from velatura.tables.build.quadrature import ALPHA_MIN, COS_MIN, Progress, Reflections, average
from velatura.tables.build.single_scattering import ABSORBING, ABSORBING_ANGLES, FINE, INSIDE
from velatura.tables.store import Table

DIELECTRIC_POWERS = {1: 8, 2: 3, 3: 2}  # how many angles Fresnel is raised to each power at, besides grazing
CONDUCTOR_POWERS = {1: 11, 2: 3, 3: 3}
ABSORBING_POWERS = ((2, 0.56), (2, 1.0), (3, 1.0))  # likewise, with coordinates on the angular axis

PLANE = (16, 12)  # nodes of walks over the two axes below
DEGREES = (12, 8)  # of polynomials in them
INDICES, INDEX_DEGREE = 14, 11  # nodes and degree in the critical angle, from outside
FROM_INSIDE = (30, 13, 24)  # nodes of walks on the axes of the tables
SPLINES = (24, 9, 19)  # cubic splines fitted to them
ROOT_ALPHA_MIN, ROOT_ALPHA_MIN_INSIDE = 0.1, 0.05  # below, walks are those of this root of the roughness
PATHS_OUTSIDE, PATHS_INSIDE, PATHS_METAL = 1024, 2048, 4096
BLOCK = 16  # points walked at a time: their numbers fit the cache
BINS = 512  # of the cosine, for walks on metals


def makers() -> dict[str, Callable[[Progress], Table]]:
    """The functions that make the tables, by name."""
    conductors = single_scattering.conductors()
    some = slice(None, None, 4)
    smooth = conductors[0][some], conductors[1][some]
    later = cache(lambda: _metals(np.concatenate([smooth[0], _corner()[0]]), np.concatenate([smooth[1], _corner()[1]])))
    count = len(smooth[0])
    return {
        "dielectric_multi": _dielectric,
        "conductor_multi": lambda p: _conductor(*smooth, later()[:, :count]),
        "inside_multi": _inside,
        "absorbing_inside_multi": lambda p: _absorbing_inside(later()[:, count:], p),
    }


# --- what the first meeting reflects, as in the tables of single reflections, and where the walks are -------------


def _first(weights: np.ndarray, eta: np.ndarray, kappa: np.ndarray) -> np.ndarray:
    return weights @ fresnel.conductor(single_scattering.fine_cosines()[:, None], eta, kappa)


def _plane_nodes() -> tuple[np.ndarray, np.ndarray]:
    """Cosines and roughnesses of walks, shape (points,)."""
    s, y = (g.ravel() for g in np.meshgrid(_gauss(PLANE[0]), _gauss(PLANE[1]), indexing="ij"))
    alpha = (ROOT_ALPHA_MIN + (1 - ROOT_ALPHA_MIN) * y) ** 2
    return alpha * s * s / (1 + alpha - s * s), alpha


def _basis(cos_theta: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Polynomials in two coordinates: one that shows grazing light alike at all roughnesses, and the root of alpha."""
    s = np.sqrt(cos_theta * (1 + alpha) / (cos_theta + alpha))
    y = np.clip((np.sqrt(alpha) - ROOT_ALPHA_MIN) / (1 - ROOT_ALPHA_MIN), 0, 1)
    products = chebvander(2 * s - 1, DEGREES[0])[:, :, None] * chebvander(2 * y - 1, DEGREES[1])[:, None, :]
    return products.reshape(len(s), -1)


def _gauss(count: int) -> np.ndarray:
    return (1 - np.cos(np.pi * (np.arange(count) + 0.5) / count)) / 2


def _walk(cos_theta: np.ndarray, alpha: np.ndarray, eta: np.ndarray, paths: int, progress: Progress) -> np.ndarray:
    """Energy that dielectrics reflect after the first meeting; two blocks of points at a time."""
    starts = range(0, len(alpha), BLOCK)

    def block(start: int) -> np.ndarray:
        points = slice(start, start + BLOCK)
        rng = np.random.default_rng([len(alpha), start])
        return microsurface_walks.reflected_later(cos_theta[points], alpha[points], eta[points], paths, rng)

    results = []
    with ThreadPoolExecutor(2) as pool:
        for energy in pool.map(block, starts):
            results.append(energy)
            progress(len(results) / len(starts))
    return np.concatenate(results)


# --- relative indices above 1 -------------------------------------------------------------------------------------


def _dielectric(progress: Progress) -> Table:
    # Walk at nodes over direction, roughness, and the critical angle from the other side
    cos_theta, alpha = _plane_nodes()
    z = _gauss(INDICES)
    eta = np.tile(1 / np.sin(coordinates.to_critical_angle(z)), len(alpha))
    later = _walk(np.repeat(cos_theta, INDICES), np.repeat(alpha, INDICES), eta, PATHS_OUTSIDE, progress)
    fit = lstsq(_basis(cos_theta, alpha), later.reshape(-1, INDICES))[0]

    # Read the fit at the nodes of the table, for many indices
    eta, kappa = single_scattering.dielectrics()
    at = chebvander(2 * coordinates.from_critical_angle(np.arcsin(1 / eta)) - 1, INDEX_DEGREE)
    fit = fit @ (at @ np.linalg.pinv(chebvander(2 * z - 1, INDEX_DEGREE))).T
    albedo = _over_plane(eta, kappa, fit)
    return _low_rank(albedo, eta, kappa, DIELECTRIC_POWERS)


def _over_plane(eta: np.ndarray, kappa: np.ndarray, fit: np.ndarray) -> np.ndarray:
    """Albedos at the nodes of a low-rank table, shape (nodes, indices)."""
    c, a = (axis.ravel() for axis in np.meshgrid(*single_scattering.plane(), indexing="ij"))
    weights = single_scattering.density_over_plane("cos_d", *single_scattering.plane(), correlated=True).reshape(
        -1, FINE
    )
    return _first(weights, eta, kappa) + _basis(np.maximum(c, COS_MIN), np.maximum(a, ALPHA_MIN)) @ fit


def _low_rank(albedo: np.ndarray, eta: np.ndarray, kappa: np.ndarray, counts: dict[int, int]) -> Table:
    """Angles for each power by pivoted QR, then U by least squares."""
    curves = fresnel.conductor(single_scattering.fine_cosines()[:, None], eta, kappa)
    chosen = [(n, i) for n, count in counts.items() for i in single_scattering.choose_angles(1 - curves**n, count)]
    u = lstsq(np.stack([1 - curves[i] ** n for n, i in chosen], axis=1), (1 - albedo).T, cond=1e-4)[0].T
    data = np.column_stack([1 - u.sum(axis=1), u]).reshape(*single_scattering.PLANE, -1)
    nodes = (0.0, *(float(single_scattering.fine_cosines()[i]) for _, i in chosen))
    return Table(single_scattering.closest_interpolant(data).astype(np.float32), nodes, (1, *(n for n, _ in chosen)))


# --- metals -------------------------------------------------------------------------------------------------------


def bin_cosines() -> np.ndarray:
    """Middles of the bins of cosines, for walks on metals."""
    return ((np.arange(BINS) + 0.5) / BINS)[:, None] ** 2


def _metals(eta: np.ndarray, kappa: np.ndarray) -> np.ndarray:
    """Fits to what metals reflect later, one column for each.

    The walks are calibrated with a mirror, whose albedo is known.
    """
    curves = fresnel.conductor(bin_cosines(), eta, kappa)
    cos_theta, alpha = _plane_nodes()
    truth = 1 - average(lambda r: r.weight.sum(axis=1), "cos_d", cos_theta, alpha, correlated=True)

    def point(i: int) -> np.ndarray:
        rng = np.random.default_rng([len(eta), i])
        energy, of_mirror = microsurface_walks.reflected_by_metals(cos_theta[i], alpha[i], curves, PATHS_METAL, rng)
        return energy * (truth[i] + 0.01) / (of_mirror + 0.01)

    with ThreadPoolExecutor(2) as pool:
        return lstsq(_basis(cos_theta, alpha), np.stack(list(pool.map(point, range(len(alpha))))))[0]


def _conductor(eta: np.ndarray, kappa: np.ndarray, fit: np.ndarray) -> Table:
    return _low_rank(_over_plane(eta, kappa, fit), eta, kappa, CONDUCTOR_POWERS)


def _corner() -> tuple[np.ndarray, np.ndarray]:
    """Indices kappa < eta < 1, extinctions by critical angle."""
    eta = np.sin(coordinates.to_critical_angle(np.linspace(0, 1, ABSORBING[2])))
    kappa = eta[:, None] * np.linspace(0, 1, 16) ** 2
    return np.repeat(eta, kappa.shape[1]), kappa.ravel()


def _absorbing_inside(fit: np.ndarray, progress: Progress) -> Table:
    cos_theta, alpha, theta_c = (axis.reshape(ABSORBING) for axis in single_scattering.points_inside(ABSORBING))
    etas, kappas, fits = (x.reshape(-1, ABSORBING[2], 16) for x in (*_corner(), fit))
    channels = [(1, x) for x in ABSORBING_ANGLES] + list(ABSORBING_POWERS)
    slices = []
    for i, theta in enumerate(theta_c[0, 0]):
        c, a = cos_theta[:, :, i].ravel(), alpha[:, :, i].ravel()
        eta, kappa = etas[0, i], kappas[0, i]

        def density(r: Reflections, eta: np.ndarray) -> np.ndarray:
            return single_scattering.density(r, "cos_d")

        first = _first(average(density, "cos_d", c, a, np.full(c.size, eta[0]), correlated=True), eta, kappa)
        albedo = first + _basis(c, a) @ fits[:, i]
        rows = [fresnel.conductor(coordinates.to_angle(x, theta), eta, kappa) ** n for n, x in channels]
        slices.append(lstsq(1 - np.stack(rows, axis=1), (1 - albedo).T, cond=1e-3)[0].T)
        progress((i + 1) / len(theta_c[0, 0]))
    data = np.stack(slices, axis=1).reshape(*ABSORBING, -1)
    powers, nodes = zip(*channels)
    return Table(single_scattering.closest_interpolant(data).astype(np.float32), nodes, powers)


# --- relative indices below 1 -------------------------------------------------------------------------------------


def _inside(progress: Progress) -> Table:
    # What the first meeting reflects, at the nodes of the table
    cos_theta, alpha, theta_c = single_scattering.points_inside(INSIDE)

    def reflected(r: Reflections, eta: np.ndarray) -> np.ndarray:
        return (r.weight * fresnel.dielectric(r.cos_d, eta)).sum(axis=1)

    first = average(
        reflected, "cos_d", cos_theta, alpha, np.sin(theta_c), correlated=True, progress=lambda p: progress(0.1 * p)
    )

    # What later ones reflect, at other nodes of the same axes
    axes = [np.linspace(0, 1, n) for n in FROM_INSIDE]
    axes[1] = ROOT_ALPHA_MIN_INSIDE + (1 - ROOT_ALPHA_MIN_INSIDE) * axes[1]
    axes[2] = _towards_one(axes[2])
    x, y, z = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    theta_c = coordinates.to_critical_angle(z)
    cosine = np.maximum(coordinates.to_angle(x, theta_c), COS_MIN / 10)
    later = _walk(
        cosine, coordinates.to_roughness(y), np.sin(theta_c), PATHS_INSIDE, lambda p: progress(0.1 + 0.9 * p)
    ).reshape(FROM_INSIDE)

    # Carry them over to the table by smooth fits, axis by axis
    for axis, (nodes, count, n) in enumerate(zip(axes, SPLINES, INSIDE)):
        table = np.clip(np.linspace(0, 1, n), nodes[0], 1)
        u, v = ((t - nodes[0]) / (1 - nodes[0]) for t in (nodes, table))
        if axis == 2:
            u, v = _from_one(u), _from_one(v)
        carry = _splines(v, count) @ np.linalg.pinv(_splines(u, count))
        later = np.moveaxis(np.tensordot(carry, later, (1, axis)), 0, axis)
    values = (first.reshape(INSIDE) + later)[..., None]
    return Table(np.clip(single_scattering.closest_interpolant(values), 0, 1).astype(np.float32))


def _towards_one(t: np.ndarray) -> np.ndarray:
    return t * (1.5 - 0.5 * t)


def _from_one(z: np.ndarray) -> np.ndarray:
    return 1.5 - np.sqrt(2.25 - 2 * z)


def _splines(x: np.ndarray, count: int) -> np.ndarray:
    """Values of cubic splines on equal pieces of [0, 1], shape (len(x), count)."""
    knots = np.concatenate([[0.0] * 3, np.linspace(0, 1, count - 2), [1.0] * 3])
    return BSpline.design_matrix(np.clip(x, 0, 1), knots, 3).toarray()
