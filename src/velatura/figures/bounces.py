"""Light that bounces between rough mirrors: bundles of directions with energies, in evenly spread samples."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura.optics import ggx
from velatura.reference import roughness

Array = NDArray[np.floating]
NORMAL = 0.0, 0.0, 1.0
Light = tuple[Array, Array]  # directions (3, n) and their energies (n,)


def uniform(count: int) -> Array:
    """Points (4, n) in four dimensions, spread evenly (Roberts 2018)."""
    root = 1.1673039782614187  # of x^5 = x + 1
    return (0.5 + np.arange(count) * root ** -np.arange(1.0, 5.0)[:, None]) % 1


def along(wi: tuple[float, float, float], count: int) -> Light:
    """Light of energy 1 from one direction."""
    return np.tile(np.array(wi)[:, None], count), np.ones(count)


def bounce(light: Light, alpha_u: float, alpha_v: float, u1: Array, u2: Array) -> Light:
    """Light after a mirror of such roughness, which faces it; what goes below the surface is lost."""
    (x, y, z), energy = light
    wi = x, y, np.maximum(z, 1e-6)
    wo = ggx.reflect(wi, ggx.sample_visible(wi, alpha_u, alpha_v, u1, u2))
    return np.stack(wo), np.where(z > 0, energy * ggx.masking(wo, alpha_u, alpha_v), 0)


def variances(light: Light) -> Array:
    """Variances of light about the normal along both axes (2,) of the projected disc."""
    directions, energy = light
    return np.average(directions[:2] ** 2, weights=energy, axis=1)


def variance(light: Light) -> float:
    """The same, its mean over both axes."""
    return float(variances(light).mean())


def median(light: Light) -> float:
    """Median slope of half-vectors of light about the normal: what makes one lobe look like another."""
    directions, energy = light
    x, y = roughness.slopes(np.array(NORMAL), directions)
    return roughness.median(np.hypot(x, y), energy)[0]


WIDTHS: dict[str, Callable[[Light], float]] = {"variance": variance, "median": median}


def equivalent(width: Any, single: Any, alphas: Any) -> Array:
    """The roughness of the one bounce that is so wide, `single` being the widths for `alphas`; NaN where none is."""
    log_widths = np.log(np.maximum.accumulate(single))
    return np.asarray(np.exp(np.interp(np.log(width), log_widths, np.log(alphas), right=np.nan)))


def equivalent_along(once: Array, x: Array, at: Array) -> Array:
    """The roughness along x of the one bounce with variances `at` (..., 2); NaN where none has them.

    `once` (..., 2) are the variances along both axes of bounces whose roughness along x is `x`.
    """
    from scipy.interpolate import LinearNDInterpolator

    return np.asarray(LinearNDInterpolator(once.reshape(-1, 2), x.ravel())(at))
