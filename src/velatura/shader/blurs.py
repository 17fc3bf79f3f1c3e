"""A distribution of directions as a few blurs, which engines have of their environments.

A blur is GGX of reflectance 1, seen along a normal that is the blur's direction (Karis 2013): a density of
z / (1 + alpha^2 - (1 - alpha^2) z)^2 over the cosine z from that direction, which at alpha = 1 is Lambert's law.
Blurs are fitted by Hellinger's distance, the square of the difference of roots of densities, over samples of the
distribution. It counts the tail of a lobe, which a small bright light shows, more than squares would, and less than
likelihood does, for which a tail is all. `fitted` runs for all nodes at once, by the steps of Levenberg and Marquardt.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from velatura.model.guards import ALPHA_MIN

Array = NDArray[np.floating]

STEPS = 12  # of the fit
DAMPING = 0.1  # at its begin
STEP = 1e-4  # of differences
LEAST = np.sqrt(ALPHA_MIN)  # root of alpha
TIED = 0.02  # weight of what a blur begins with, where samples decide little


def density(versine: Array, alpha: Array) -> Array:
    """Density of a blur over solid angle, at 1 - z."""
    a = alpha * alpha
    slope = 1 - a
    below = 2 * a
    shallow = slope < 1e-3  # near Lambert's law, where the integral is a ratio of small numbers
    s = np.where(shallow, 1e-3, slope)
    whole = ((1 + below / s) * (1 / below - 1 / (below + s)) - np.log1p(s / below) / s) / s
    whole = np.where(shallow, 0.125 * (1 + 5 / 3 * slope), whole)
    return np.maximum(1 - versine, 0) / (below + slope * versine) ** 2 / (2 * np.pi * whole)


def alone(blurs: Array, sine: Array, w: Array) -> Array:
    """Density of a blur at each node, of (nodes, 4), in directions (3, nodes, samples)."""
    x, y, root, _ = blurs.T
    across = np.stack([x - sine, y])
    z = np.sqrt(np.maximum(1 - (across**2).sum(axis=0), 0))
    first, *others = (each - towards[:, None] for each, towards in zip(w, [*across, z]))
    versine = first * first
    for apart in others:
        versine += apart * apart
    versine *= 0.5
    return density(versine, root[:, None] ** 2)


def mixed(blurs: Array, sine: Array, w: Array) -> Array:
    """Density of blurs (nodes, K, 4) in directions (3, nodes, samples)."""
    return _sum([alone(blurs[:, k], sine, w) for k in range(blurs.shape[1])], blurs)


def _sum(densities: Sequence[Array], blurs: Array) -> Array:
    """The densities of blurs, each by its share."""
    return np.asarray(sum(share[:, None] * each for share, each in zip(blurs[..., 3].T, densities)))


def distance(found: Array, sine: Array, w: Array, ratio: Array, sampled: Array) -> Array:
    """Hellinger's distance of blurs to samples at each node, 0 to 2; arguments as of `fitted`."""
    drawn = sampled > 0
    near = np.sqrt(mixed(found, sine, w) / np.where(drawn, sampled, 1)) - np.sqrt(ratio)
    return np.asarray(np.where(drawn, near**2, 0).mean(axis=-1))


def _variance(alpha: float) -> float:
    """Variance of a blur along a tangent."""
    # In powers of the sine of half the angle, so that narrow blurs have nodes
    s = np.geomspace(1e-9, 0.5, 4000)
    z = 1 - 2 * s
    weight = z / (2 * alpha**2 + (1 - alpha**2) * 2 * s) ** 2
    return float(0.5 * np.trapezoid(weight * (1 - z * z), s) / np.trapezoid(weight, s))


ALPHAS = np.geomspace(ALPHA_MIN, 1.0, 100)
VARIANCES = np.array([_variance(alpha) for alpha in ALPHAS])


def alpha_of(variance: Array) -> Array:
    """The alpha by which a blur has a variance along a tangent."""
    return np.interp(variance, VARIANCES, ALPHAS)


def fitted(start: Array, sine: Array, w: Array, ratio: Array, sampled: Array, kept: Collection[int] = ()) -> Array:
    """Blurs (nodes, K, 4): across the normal, in the plane of incidence and beside it, beyond the mirror's direction;
    the root of alpha; the share.

    Args:
        start: blurs to begin with.
        sine: of the direction of light, at each node.
        w: directions (3, nodes, samples), in the plane of incidence, upwards.
        ratio: the distribution's density there over that of samples.
        sampled: the density of samples.
        kept: which of the four numbers stay as they begin.
    """
    nodes, count, _ = start.shape
    drawn = sampled > 0
    root = np.where(drawn, np.sqrt(ratio / ratio.shape[1]), 0)
    per = np.where(drawn, 1 / np.sqrt(np.where(drawn, sampled, 1) * ratio.shape[1]), 0)
    if count == 1:
        kept = {*kept, 3}  # all of it
    free = [k for k in range(4 * count) if k % 4 not in kept]

    def bounded(x: Array) -> Array:
        blurs = start.copy()
        blurs.reshape(nodes, -1)[:, free] = x
        blurs[..., 2] = np.clip(blurs[..., 2], LEAST, 1)
        blurs[..., 3] = np.exp(np.clip(blurs[..., 3], -6, 6))
        blurs[..., 3] /= blurs[..., 3].sum(axis=1, keepdims=True)
        across = blurs[..., :2] - np.stack([sine, 0 * sine], axis=-1)[:, None]
        length = np.maximum(np.hypot(across[..., 0], across[..., 1]) / 0.9999, 1)
        blurs[..., :2] += across * (1 / length - 1)[..., None]
        return blurs

    start = start.copy()
    start[..., 3] = np.log(np.maximum(start[..., 3], 1e-3))
    scale = np.ones_like(start)
    scale[..., :2] = start[..., 2:3] ** 2  # places in units of the width, so that steps are of one size
    first, scale = (each.reshape(nodes, -1)[:, free] for each in (start, scale))

    def densities(found: Array) -> list[Array]:
        return [alone(found[:, k], sine, w) for k in range(count)]

    def residual(x: Array, found: Array, seen: Sequence[Array]) -> Array:
        return np.concatenate([np.sqrt(_sum(seen, found)) * per - root, TIED * (x - first) / scale], axis=1)

    def moved(number: int) -> Array:
        """The residual where one number is another, which changes the density of its own blur alone, or a share."""
        step = np.where(np.arange(len(free)) == number, x + STEP * scale, x)
        found, (k, kind) = bounded(step), divmod(free[number], 4)
        changed = [*seen]
        if kind < 3:
            changed[k] = alone(found[:, k], sine, w)
        return residual(step, found, changed)

    x = first
    seen = densities(bounded(x))
    now = residual(x, bounded(x), seen)
    error = (now**2).sum(axis=1)
    damping = np.full(nodes, DAMPING)
    for _ in range(STEPS):
        slope = np.stack([(moved(number) - now) / STEP for number in range(len(free))], axis=1)
        normal = slope @ slope.transpose(0, 2, 1)
        normal += (damping[:, None] * (np.einsum("nii->ni", normal) + 1e-6))[..., None] * np.eye(len(free))
        step = np.linalg.solve(normal, -(slope @ now[..., None]))[..., 0]
        tried = x + np.clip(step, -1, 1) * scale
        seen_then = densities(bounded(tried))
        then = residual(tried, bounded(tried), seen_then)
        better = (then**2).sum(axis=1) < error
        x, now = np.where(better[:, None], tried, x), np.where(better[:, None], then, now)
        seen = [np.where(better[:, None], *each) for each in zip(seen_then, seen)]
        error = (now**2).sum(axis=1)
        damping = np.where(better, damping / 3, damping * 4)
    return bounded(x)
