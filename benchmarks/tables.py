"""Compare the shipped tables with an independent quadrature, and build them from nothing.

    python benchmarks/tables.py [--points 100000] [--walked 200] [--paths 300000]

The truth is brute force: a fine grid over the random numbers that draw visible normals, which shares with the builder
of the tables neither variables of integration nor knowledge of where the integrand bends. It is good to 4e-5 on
average, and to 1e-4 where light leaves a sharp cone (`clean`). Where light bounces between the facets, it is the
reference's random walk at a few points.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
from rows import parsed

from velatura import kernel, ops, tables
from velatura.optics import fresnel, ggx
from velatura.reference import statistics
from velatura.stack import Interface, Stack
from velatura.tables.build import build

MANY_BOUNCES = 5e-3  # error allowed where light bounces between the facets, besides the noise of the truth
SIGMAS = 4.5  # of that noise: one false alarm in 150 000

LANES = 1 << 22  # integrand values worked out at a time


@dataclass(frozen=True)
class Region:
    """Part of the domain, and the errors that are allowed there."""

    name: str
    holds: Callable[[np.ndarray, np.ndarray], np.ndarray]  # of eta and kappa
    max_error: float
    rms_error: float


@dataclass(frozen=True)
class Average:
    """One kind of look-up: `fetch(cos_theta, alpha, eta, kappa)` stands for the mean of `integrand`.

    The integrand is a function of wi.h, the cosine of the way out, eta, kappa. `nodes` is the truth's resolution, and
    `relative` divides by the albedo of a mirror.
    """

    name: str
    fetch: Callable[..., np.ndarray]
    integrand: Callable[..., Any]
    regions: tuple[Region, ...]
    nodes: int = 256
    relative: bool = False


def _in_cone(cos_d: Any, cos_o: Any, eta: Any, kappa: Any) -> Any:
    return ops.select(cos_o * cos_o > 1 - eta * eta, 1.0, 0.0)


_SHIPPED = tables.load()
_OUTSIDE = Region("eta > 1", lambda eta, kappa: eta >= 1, 2e-3, 1e-4)
_INSIDE = Region("eta < 1", lambda eta, kappa: eta < 1, 5e-3, 2e-4)
_METAL = Region("kappa >= eta", lambda eta, kappa: kappa >= eta, 5e-3, 1e-4)
_OTHER = Region("kappa < eta", lambda eta, kappa: kappa < eta, 2e-2, inf)

AVERAGES = (
    Average(
        "FGD, dielectric",
        lambda c, a, eta, kappa: tables.fgd(_SHIPPED, tables.dielectric_row(_SHIPPED, eta), c, a),
        lambda cos_d, cos_o, eta, kappa: fresnel.dielectric(cos_d, eta),
        (_OUTSIDE, _INSIDE),
    ),
    Average(
        "FGD, conductor",
        lambda c, a, eta, kappa: tables.fgd(_SHIPPED, tables.conductor_row(_SHIPPED, eta, kappa), c, a),
        lambda cos_d, cos_o, eta, kappa: fresnel.conductor(cos_d, eta, kappa),
        (_METAL, _OTHER),
    ),
    Average(
        "TIR, published",
        lambda c, a, eta, kappa: tables.tir(_SHIPPED, "published", eta, c, a),
        lambda cos_d, cos_o, eta, kappa: 1 - fresnel.dielectric(cos_o, eta),
        (_OUTSIDE, _INSIDE),
        relative=True,
    ),
    Average(
        "TIR, clean",
        lambda c, a, eta, kappa: tables.tir(_SHIPPED, "clean", eta, c, a),
        _in_cone,
        (_INSIDE,),
        nodes=512,
        relative=True,
    ),
)


def draw(count: int, seed: int) -> tuple[np.ndarray, ...]:
    """Points (cos_theta, alpha, eta, kappa) of the domain, each of shape (count,)."""
    low, high = np.array([0.02, 0.02, 0.05, 0.0]), np.array([1.0, 1.0, 4.0, 4.0])
    return tuple(np.random.default_rng(seed).uniform(low, high, (count, 4)).T)


def truths(average: Average, points: tuple[np.ndarray, ...]) -> Iterator[np.ndarray]:
    """The averages at some points, a few at a time."""
    kernel.require_llvm()
    import drjit as dr
    from drjit.llvm import Float, UInt32

    # Lay nodes over half of the azimuths: the rest is their mirror image
    nodes = average.nodes
    x, w = np.polynomial.legendre.leggauss(nodes)
    x_half, w_half = np.polynomial.legendre.leggauss(nodes // 2)
    grids = (*np.meshgrid((x_half + 1) / 4, (x + 1) / 2, indexing="ij"), w_half[:, None] * w / 4)
    u1, u2, share = (Float(grid.ravel().astype(np.float32)) for grid in grids)
    per_point = dr.width(share)

    few = max(1, LANES // per_point)
    for start in range(0, len(points[0]), few):
        # Spread every point over its nodes
        slices = [Float(p[start : start + few].astype(np.float32)) for p in points]
        lane = dr.arange(UInt32, dr.width(slices[0]) * per_point)
        point = lane // per_point
        node = lane - point * per_point
        cos_theta, alpha, eta, kappa = (dr.gather(Float, p, point) for p in slices)

        # Reflect about visible normals
        wi = (ops.sqrt(1 - cos_theta * cos_theta), Float(0), cos_theta)
        h = ggx.sample_visible(wi, alpha, alpha, dr.gather(Float, u1, node), dr.gather(Float, u2, node))
        wo = ggx.reflect(wi, h)
        weight = dr.gather(Float, share, node) * ggx.masking(wo, alpha, alpha)
        values = average.integrand(ops.clip(ggx.dot(wi, h), 0.0, 1.0), ops.clip(wo[2], 0.0, 1.0), eta, kappa)
        total = dr.block_sum(weight * values, per_point)
        yield (total / dr.block_sum(weight, per_point) if average.relative else total).numpy()


def errors(average: Average, region: Region, count: int, seed: int, progress: Callable[[int], None]) -> np.ndarray:
    """Table minus truth at those of `count` points of the domain that lie in the region."""
    points = draw(count, seed)
    inside = region.holds(points[2], points[3])
    points = tuple(p[inside] for p in points)
    found: list[np.ndarray] = []
    for values in truths(average, points):
        found.append(values)
        progress(100 * sum(map(len, found)) // len(points[0]))
    return average.fetch(*points) - np.concatenate(found)


def draw_many(count: int, seed: int) -> tuple[np.ndarray, ...]:
    """Points for walks: half dielectrics, from both sides, half metals, a quarter of them with kappa < eta."""
    rng = np.random.default_rng(seed)
    cos_theta, alpha = rng.uniform(0.02, 1, (2, count))
    u, v = rng.random((2, count))
    metal = np.arange(count) >= count // 2
    eta = np.where(metal, 0.05 + 3.95 * u, 0.4 * (2.5 / 0.4) ** u)
    kappa = np.where(np.arange(count) % 4 == 0, eta * v, 5 * v) * metal
    return cos_theta, alpha, eta, kappa


def fetch_many(cos_theta: Any, alpha: Any, eta: Any, kappa: Any) -> Any:
    """Albedos with bounces between the facets; kappa 0 means a dielectric."""
    dielectric = tables.dielectric_row(_SHIPPED, eta, multiple=True)
    metal = tables.conductor_row(_SHIPPED, eta, kappa, multiple=True)
    return np.where(
        kappa > 0, tables.fgd(_SHIPPED, metal, cos_theta, alpha), tables.fgd(_SHIPPED, dielectric, cos_theta, alpha)
    )


def walk(point: tuple[float, ...], paths: int, seed: int) -> tuple[float, float]:
    """Albedo of one interface by the reference's walk between its facets, and its standard error."""
    cos_theta, alpha, eta, kappa = point
    outside = 4.0  # an absolute index that leaves room for relative ones below 1
    interface = Interface(eta=eta * outside, k=kappa * outside if kappa else None, alpha=alpha)
    found = statistics(Stack([interface], exterior=outside), cos_theta, paths=paths, seed=seed, microsurface=True)
    assert found.standard_error is not None
    return float(found.energy[0][0, 0]), float(found.standard_error.energy[0][0, 0])


def compare_many(count: int, paths: int, seed: int, progress: Callable[[int], None]) -> tuple[np.ndarray, np.ndarray]:
    """Table minus walk, and the standard errors of the walks."""
    points = np.stack(draw_many(count, seed), axis=1)
    walked = []
    for i, point in enumerate(points.tolist()):
        walked.append(walk(tuple(point), paths, i))
        progress(100 * (i + 1) // count)
    truth, noise = np.array(walked).T
    return fetch_many(*points.T) - truth, noise


def main() -> None:
    walked, paths = (200, "points that are walked"), (300_000, "for each of them")
    options = parsed(__doc__, points=100_000, walked=walked, paths=paths, seed=0)

    broken = False
    for average in AVERAGES:
        for region in average.regions:
            error = errors(average, region, options.points, options.seed, _percent)
            largest, rms = np.max(np.abs(error)), np.sqrt(np.mean(error**2))
            broken |= bool(largest > region.max_error or rms > region.rms_error)
            allowed = f"(allowed {region.max_error:.0e}, {region.rms_error:.0e})"
            print(
                f"{average.name:16} {region.name:13} {len(error):6} points  max {largest:.1e}  rms {rms:.1e}  {allowed}"
            )

    error, noise = compare_many(options.walked, options.paths, options.seed, _percent)
    broken |= bool((np.abs(error) > MANY_BOUNCES + SIGMAS * noise).any())
    largest, rms, noise_rms = np.max(np.abs(error)), np.sqrt(np.mean(error**2)), np.sqrt(np.mean(noise**2))
    print(f"FGD, many bounces {len(error):18} points  max {largest:.1e}  rms {rms:.1e}  (allowed {MANY_BOUNCES:.0e})")
    print(f"    noise of the walks: max {np.max(noise):.1e}  rms {noise_rms:.1e}")

    built = build(lambda done: _percent(round(100 * done)))
    for name, table in built.tables.items():
        shape = " x ".join(map(str, table.data.shape))
        print(f"{name:22} {shape:18} {table.data.nbytes / 2**10:6.0f} KiB  {built.seconds[name]:5.1f} s")
    print(f"all                    {sum(built.seconds.values()):38.1f} s")
    sys.exit(broken)


def _percent(done: int) -> None:
    if sys.stderr.isatty():
        print(f"{done:3} %", end="\r", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
