"""Scattering by rough interfaces, from random walks: the tables of `velatura.tables.diffuse_nodes`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import product
from typing import Any

import numpy as np

from velatura.optics import fresnel
from velatura.tables import coordinates
from velatura.tables.build.quadrature import COS_MIN, Progress, ignore
from velatura.tables.build.single_scattering import closest_interpolant
from velatura.tables.diffuse_nodes import COUNT, OPEN, OPEN_WEIGHTS, TRAPPED, TRAPPED_WEIGHTS, edge_cosine
from velatura.tables.microsurface_walks import MOST_MEETINGS, Walks
from velatura.tables.store import Table

ENTERING = (32, 11, 17)  # nodes of the tables
RETURNING = (11, 17)
BETWEEN = (9, 9, 21)  # odd, for a node at equal indices
PATHS, PATHS_ENTERING = 1024, 4096
SOURCES, SOURCES_SMOOTH = 8, 400  # cosines on either side that stand for the light from a node


def makers() -> dict[str, Callable[[Progress], Table]]:
    """The functions that make the tables, by name."""
    between = cache(_between)
    return {
        "entering": _entering,
        "returning": _returning,
        "passing": lambda progress: between()[1],
        "staying": lambda progress: between()[0],
    }


def parts(cos_theta: np.ndarray, n: float) -> np.ndarray:
    """Lagrange polynomials of all nodes at cosines, shape (nodes, cosines)."""
    p2, edge = n * n * (1 - cos_theta * cos_theta), max(float(edge_cosine(n)), COS_MIN)
    leaves = p2 <= 1
    inner = np.where(leaves, _lagrange(np.clip(p2, 0, 1), OPEN), 0)
    outer = np.where(leaves, 0, _lagrange(np.clip(cos_theta / edge, 0, 1), TRAPPED))
    return np.concatenate([inner, outer])


def scattered(
    cos_theta: np.ndarray, alpha: float, n: tuple[float, float], paths: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Parts of light reflected, and transmitted from the first index into the second, shape (cosines, nodes)."""
    eta = n[1] / n[0]
    if alpha == 0 or eta == 1:
        r, refracted = fresnel.dielectric(cos_theta, eta), fresnel.cos_transmitted(cos_theta, eta)
        return (r * parts(cos_theta, n[0])).T, ((1 - r) * parts(refracted, n[1])).T
    count = len(cos_theta)
    found = [np.zeros((COUNT, count)) for _ in n]
    walks, etas = Walks(cos_theta, np.full(count, alpha), paths, rng), np.full(count, eta)
    while len(walks) and walks.meetings < MOST_MEETINGS:
        walks.scatter(*walks.meet(), etas)
        weight = walks.leave()
        for parted, index, here in zip(found, n, (walks.outside, ~walks.outside)):
            leaving = here & (weight > 0)
            shares = weight[leaving] * parts(walks.w[2][leaving].astype(float), index)
            parted += [np.bincount(walks.point[leaving], share, minlength=count) for share in shares]
        walks.end_faint()
    return found[0].T / paths, found[1].T / paths


def exchanged(alpha: float, n: tuple[float, float], paths: int, seed: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """The same for light from each node, shape (nodes, nodes)."""
    # Spread the light from a node as its polynomial
    x, w = np.polynomial.legendre.leggauss(SOURCES_SMOOTH if alpha == 0 else SOURCES)
    x, w = 0.5 + 0.5 * x, 0.5 * w
    inner = _lagrange(x, OPEN) * w / np.array(OPEN_WEIGHTS)[:, None]
    outer = _lagrange(x, TRAPPED) * (2 * w * x) / np.array(TRAPPED_WEIGHTS)[:, None]
    cosines = np.concatenate([np.sqrt(1 - x / n[0] ** 2), float(edge_cosine(n[0])) * x])
    # Meet the interface
    found = scattered(np.maximum(cosines, COS_MIN), alpha, n, paths, np.random.default_rng(seed))
    reflected, transmitted = (np.concatenate([inner @ f[: len(x)], outer @ f[len(x) :]]) for f in found)
    return reflected, transmitted


def _lagrange(x: np.ndarray, nodes: Sequence[float]) -> np.ndarray:
    factors = [[(x - b) / (a - b) for b in nodes if b != a] for a in nodes]
    return np.array([np.prod(f, axis=0) for f in factors])


def _entering(progress: Progress) -> Table:
    cosines = np.maximum(np.linspace(0, 1, ENTERING[0]), COS_MIN)

    def point(alpha: float, n: float) -> np.ndarray:
        rng = np.random.default_rng(_seed(1, alpha, n))
        through = scattered(cosines, alpha, (1.0, n), PATHS_ENTERING, rng)[1]
        return through / through.sum(axis=1, keepdims=True)

    return _table(closest_interpolant(np.moveaxis(_over(point, _axes(*ENTERING[1:]), progress), 2, 0)))


def _returning(progress: Progress) -> Table:
    return _table(_over(returned, _axes(*RETURNING), progress))


def returned(alpha: float, n: float) -> np.ndarray:
    """A node of the table `returning`."""
    return exchanged(alpha, (n, 1.0), PATHS, _seed(2, alpha, n))[0].ravel()


def _between() -> tuple[Table, Table]:
    def point(alpha: float, n: float, ratio: float) -> np.ndarray:
        below = max(n * ratio, 1.0)
        return np.stack(exchanged(alpha, (n, below), PATHS, _seed(3, alpha, n, below))).reshape(2, -1)

    ratios = coordinates.to_ratio(np.linspace(0, 1, BETWEEN[2]))
    staying, passing = np.moveaxis(_over(point, [*_axes(*BETWEEN[:2]), ratios], ignore), -2, 0)
    return _table(_bent_in_the_middle(staying)), _table(_bent_in_the_middle(passing))


def _bent_in_the_middle(values: np.ndarray) -> np.ndarray:
    """The closest interpolants on either side of equal indices."""
    middle = BETWEEN[2] // 2
    lower, upper = values[:, :, : middle + 1], values[:, :, middle:]
    return np.concatenate([closest_interpolant(lower), closest_interpolant(upper)[:, :, 1:]], axis=2)


def _seed(table: int, *place: float) -> list[int]:
    return [table, *(round(1e6 * x) for x in place)]


def _axes(alphas: int, indices: int) -> list[np.ndarray]:
    return [coordinates.to_roughness(np.linspace(0, 1, alphas)), coordinates.to_index(np.linspace(0, 1, indices))]


def _over(point: Callable[..., np.ndarray], axes: Sequence[np.ndarray], progress: Progress) -> Any:
    """A function at all nodes of a grid, two at a time; its own axes last."""
    nodes, found = list(product(*(axis.tolist() for axis in axes))), []
    with ThreadPoolExecutor(2) as pool:
        for value in pool.map(lambda node: point(*node), nodes):
            found.append(value)
            progress(len(found) / len(nodes))
    return np.stack(found).reshape(*map(len, axes), *found[0].shape)


def _table(data: np.ndarray) -> Table:
    return Table(data.astype(np.float32))
