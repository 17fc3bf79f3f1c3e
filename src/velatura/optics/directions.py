"""Directions of incidence, as a user gives them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura.errors import InvalidInput

Array = NDArray[np.floating]


def directions(cos_theta: ArrayLike, phi: ArrayLike = 0.0) -> Array:
    """Unit vectors (N, 3) of cosines and azimuths in radians.

    Each is a number or a list; a number, or a list of one, goes with every entry of the other.

    Raises:
        InvalidInput: a cosine outside (0, 1], an azimuth that is not finite, lists of different lengths or of lists.
    """
    cosine, azimuth = _row("cos_theta", cos_theta), _row("phi", phi)
    if len(cosine) != len(azimuth) and 1 not in (len(cosine), len(azimuth)):
        raise InvalidInput(f"phi: must be one number, or {len(cosine)} as cos_theta is, got {len(azimuth)}")
    outside = ~((cosine > 0) & (cosine <= 1))
    if outside.any():
        raise InvalidInput(f"cos_theta: must lie in 0 (excluded) to 1, got {float(cosine[outside][0])}")
    if not np.isfinite(azimuth).all():
        raise InvalidInput(f"phi: must be finite, got {azimuth[~np.isfinite(azimuth)][0]:g}")
    cosine, azimuth = np.broadcast_arrays(cosine, azimuth)
    sine = np.sqrt(1 - cosine**2)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=-1)


def _row(name: str, values: ArrayLike) -> Array:
    try:
        numbers = np.asarray(values, float)
    except (TypeError, ValueError):
        raise InvalidInput(f"{name}: must be a number or a list of numbers") from None
    if numbers.ndim > 1:
        raise InvalidInput(f"{name}: must be a number or a list of numbers, got an array of shape {numbers.shape}")
    return np.atleast_1d(numbers)
