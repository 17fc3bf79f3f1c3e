"""Build the tables from nothing and measure them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any

import numpy as np

from velatura.optics import fresnel
from velatura.tables import diffuse_nodes, microsurface_walks
from velatura.tables.build import belcour_grid, build, diffuse_matrices
from velatura.tables.build.multiple_scattering import bin_cosines
from velatura.tables.build.quadrature import Progress, Reflections, average, ignore
from velatura.tables.build.single_scattering import mean_transmittance_out, share_in_cone
from velatura.tables.fetch import Row, conductor_row, dielectric_row, fgd, tir
from velatura.tables.store import Table, Tables

POINTS = 2000  # per table
WALKED, PATHS = 60, 16384  # points, and paths for each, where light bounces between the facets: a noise of 5e-4
NODES = 16  # of the truth, on every piece of an integral: good to 1e-5

BUILDING = 0.8  # of the whole time


def report(progress: Progress = ignore, with_yardstick: bool = False) -> list[dict[str, Any]]:
    """One row per table: `table`, `shape`, `bytes`, `rank`, `build_s`, `max_error`, `rms_error`.

    Rank is None where nothing is factored. Errors are those of the look-ups that a table serves, at seeded points with
    cosine and roughness in [.02, 1], relative index in [.05, 4] and extinction in [0, 4]; at a few of them, against
    walks, where light bounces between the facets.
    """
    built = build(lambda done: progress(BUILDING * done))
    rows = []
    for i, (name, errors) in enumerate(_measures(built.tables).items()):
        rows.append(_row(name, getattr(built.tables, name), built.seconds[name], errors()))
        progress(BUILDING + (1 - BUILDING) * (i + 1) / len(built.seconds))
    return [*rows, _yardstick_row()] if with_yardstick else rows


def _measures(tables: Tables) -> dict[str, Callable[[], np.ndarray]]:
    """Functions that give the errors of the look-ups of each table."""
    cos_theta, alpha, eta, kappa = _points()
    below, above = 0.05 + 0.95 * eta, 1 + 3 * eta
    index = 0.05 + 3.95 * eta
    metal = np.where(index < 1, np.maximum(4 * kappa, index), 4 * kappa)

    def dielectric(eta: np.ndarray) -> np.ndarray:
        return fgd(tables, dielectric_row(tables, eta), cos_theta, alpha) - _albedo(eta, 0 * eta)

    def conductor(eta: np.ndarray, kappa: np.ndarray) -> np.ndarray:
        return fgd(tables, conductor_row(tables, eta, kappa), cos_theta, alpha) - _albedo(eta, kappa)

    def many(row: Row, eta: np.ndarray, kappa: np.ndarray) -> np.ndarray:
        return fgd(tables, row, cos_theta, alpha)[:WALKED] - _albedo_many(eta, kappa)

    def many_dielectric(eta: np.ndarray) -> np.ndarray:
        return many(dielectric_row(tables, eta, multiple=True), eta, 0 * eta)

    def many_conductor(eta: np.ndarray, kappa: np.ndarray) -> np.ndarray:
        return many(conductor_row(tables, eta, kappa, multiple=True), eta, kappa)

    def leaving(form: str, of: Callable[..., np.ndarray], eta: np.ndarray) -> np.ndarray:
        return tir(tables, form, eta, cos_theta, alpha) - average(of, "cos_o", cos_theta, alpha, eta, nodes=NODES)

    return {
        "dielectric": lambda: dielectric(above),
        "conductor": lambda: conductor(index, metal),
        "inside": lambda: dielectric(below),
        "absorbing_inside": lambda: conductor(below, below * kappa),
        "dielectric_multi": lambda: many_dielectric(above),
        "conductor_multi": lambda: many_conductor(index, metal),
        "inside_multi": lambda: many_dielectric(below),
        "absorbing_inside_multi": lambda: many_conductor(below, below * kappa),
        "tir_published": lambda: leaving("published", mean_transmittance_out, below),
        "tir_published_outside": lambda: leaving("published", mean_transmittance_out, above),
        "tir_clean": lambda: leaving("clean", share_in_cone, below),
        **_measures_of_parts(tables),
    }


def _measures_of_parts(tables: Tables) -> dict[str, Callable[[], np.ndarray]]:
    """Measures of the tables of diffuse light: errors of what an optical depth of .5 leaves of light from one
    direction, or evenly from all. Indices are those from 1.3 to 2.2."""
    cos_theta, alpha, *random = (x[:WALKED] for x in _points())
    n, other = (1.3 + 0.9 * x for x in random)

    def left(found: np.ndarray, n: np.ndarray) -> np.ndarray:
        """Light that is left of parts, shape (nodes, points)."""
        return np.asarray((found * np.exp(-0.5 / np.array(diffuse_nodes.node_cosines(n)))).sum(axis=0))

    def entering() -> np.ndarray:
        true = [
            diffuse_matrices.scattered(cos_theta[i : i + 1], alpha[i], (1.0, n[i]), PATHS, np.random.default_rng(2))[1][
                0
            ]
            for i in range(WALKED)
        ]
        return left(np.array([x / x.sum() for x in true]).T - diffuse_nodes.entering(tables, cos_theta, alpha, n), n)

    def evenly(which: int, rows: Sequence[Sequence[np.ndarray]], beyond: np.ndarray) -> np.ndarray:
        even = np.array(diffuse_nodes.even(n))
        true = [diffuse_matrices.exchanged(alpha[i], (n[i], beyond[i]), PATHS // 16, [4])[which] for i in range(WALKED)]
        error = np.moveaxis(np.array(true), 0, -1) - np.array(rows)
        return left(np.einsum("ji,jki->ki", even, error), beyond if which else n)

    return {
        "entering": entering,
        "returning": lambda: evenly(0, diffuse_nodes.returning(tables, alpha, n), np.ones_like(n)),
        "passing": lambda: evenly(1, diffuse_nodes.between(tables.passing, alpha, n, other / n), other),
        "staying": lambda: evenly(0, diffuse_nodes.between(tables.staying, alpha, n, other / n), other),
    }


def _yardstick_row() -> dict[str, Any]:
    start = perf_counter()
    grid = belcour_grid.build()
    seconds = perf_counter() - start
    cos_theta, alpha, eta, kappa = _points()
    eta, kappa = 0.05 + 3.95 * eta, 4 * kappa
    return _row("yardstick", grid, seconds, belcour_grid.fgd(grid, cos_theta, alpha, eta, kappa) - _albedo(eta, kappa))


def _points() -> tuple[np.ndarray, ...]:
    """Cosines and roughnesses, and two numbers in [0, 1] for indices."""
    low = np.array([0.02, 0.02, 0.0, 0.0])
    return tuple(np.random.default_rng(0).uniform(low, 1.0, (POINTS, 4)).T)


def _albedo(eta: np.ndarray, kappa: np.ndarray, correlated: bool = False) -> np.ndarray:
    def reflected(r: Reflections, eta: np.ndarray, kappa: np.ndarray) -> np.ndarray:
        return (r.weight * fresnel.conductor(r.cos_d, eta, kappa)).sum(axis=1)

    cos_theta, alpha, *_ = _points()
    return average(reflected, "cos_d", cos_theta, alpha, eta, kappa, nodes=NODES, correlated=correlated)


def _albedo_many(eta: np.ndarray, kappa: np.ndarray) -> np.ndarray:
    cos_theta, alpha, *_ = _points()
    rng = np.random.default_rng(1)
    later = []
    for i in range(WALKED):
        point = slice(i, i + 1)
        if kappa[i] > 0:
            curve = fresnel.conductor(bin_cosines(), eta[point], kappa[point])
            later.append(microsurface_walks.reflected_by_metals(cos_theta[i], alpha[i], curve, PATHS, rng)[0])
        else:
            later.append(microsurface_walks.reflected_later(cos_theta[point], alpha[point], eta[point], PATHS, rng))
    return _albedo(eta, kappa, correlated=True)[:WALKED] + np.concatenate(later)


def _row(name: str, table: Table, seconds: float, errors: np.ndarray) -> dict[str, Any]:
    return {
        "table": name,
        "shape": list(table.data.shape),
        "bytes": table.data.nbytes,
        "rank": len(table.nodes) or None,
        "build_s": seconds,
        "max_error": float(np.max(np.abs(errors))),
        "rms_error": float(np.sqrt(np.mean(errors**2))),
    }
