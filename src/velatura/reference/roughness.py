"""Equivalent roughness: the alpha of the one GGX reflection that is as wide as a lobe.

Width is a median of slopes of half-vectors, weighted by energy, since slopes of GGX normals have no variance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from velatura.optics import ggx
from velatura.renderer.low_discrepancy import square

Array = NDArray[np.floating]

_NORMALS = 2**14
_LIMITS = 1e-5, 16.0  # slopes below are rounding


def slopes(wi: Array, wo: Array) -> Array:
    """Slopes (2, n) of the half-vectors of wi (3,) and wo (3, n)."""
    h = wi[:, None].astype(wo.dtype) + wo
    return h[:2] / np.maximum(h[2], 1e-9)


def median(x: Array, weight: Array) -> tuple[float, float]:
    """Weighted median and its standard error, read off the order statistics; NaN where there is no weight."""
    total = weight.sum(dtype=float)
    if not total > 0:
        return np.nan, np.nan
    order = np.argsort(x)
    share = np.cumsum(weight[order], dtype=float) / total
    error = 0.5 * np.sqrt(np.sum(weight**2, dtype=float)) / total
    ranks = np.searchsorted(share, [0.5 - error, 0.5, 0.5 + error])
    low, middle, high = (float(x[order[rank]]) for rank in np.minimum(ranks, len(x) - 1))
    return middle, (high - low) / 2


def medians(x: Array, weight: Array, radial: bool) -> tuple[Array, Array]:
    """Medians of slopes (2, n), with standard errors: of the lengths, for both axes, or of the sizes along each."""
    both = [median(np.hypot(*x), weight)] * 2 if radial else [median(np.abs(axis), weight) for axis in x]
    middle, error = np.array(both).T
    return middle, error


def of_reflection(wi: Array, alpha: Array, radial: bool) -> Array:
    """`medians` of a single GGX reflection (F = 1) of light from `wi`, in the frame of the roughness alpha (2,)."""
    u1, u2 = square(_NORMALS)
    (x, y, z), (alpha_u, alpha_v) = wi, alpha
    h = ggx.sample_visible((x, y, z), alpha_u, alpha_v, u1, u2)
    weight = ggx.masking(ggx.reflect((x, y, z), h), alpha_u, alpha_v)
    return medians(np.stack([h[0], h[1]]) / h[2], weight, radial)[0]


def matching(wi: Array, target: Array, radial: bool) -> Array:
    """The roughness (2,) of the GGX reflection whose medians are `target`; 0 where that is 0.

    Medians grow almost in proportion to the roughness, so it is scaled until they fit.
    """
    if np.isnan(target).any():
        return np.full(2, np.nan)
    alpha = np.clip(target, *_LIMITS)
    for _ in range(20):
        factor = target / of_reflection(wi, alpha, radial)
        alpha = np.clip(alpha * factor, *_LIMITS)
        if np.all(np.abs(factor - 1) < 1e-4):
            break
    return np.where(target > _LIMITS[0], alpha, 0.0)
