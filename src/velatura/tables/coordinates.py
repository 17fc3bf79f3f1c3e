"""Positions of the nodes of the tables: maps between [0, 1] and cosines, roughnesses and relative indices.

Nodes crowd where the averages bend: at grazing angles, at low roughness, at critical angles near grazing and, for light
inside a denser medium, at the critical angle, which the angular axis of the three-dimensional tables follows.
"""

from __future__ import annotations

from math import asin, pi

import numpy as np

from velatura import ops
from velatura.ops import Value

INDEX_MAX, RATIO_MAX = 3.0, 2.5  # of the tables for diffuse light, where the lowest are 1 and 1 / 2.5
ETA_MIN = 0.05  # lowest relative index of the tables for light inside a denser medium
_CRITICAL_MIN = asin(ETA_MIN)


def from_cosine(cos_theta: Value) -> Value:
    return ops.sqrt(cos_theta)


def to_cosine(x: np.ndarray) -> np.ndarray:
    return x * x


def from_roughness(alpha: Value) -> Value:
    return ops.sqrt(alpha)


def to_roughness(x: np.ndarray) -> np.ndarray:
    return x * x


def from_critical_angle(theta_c: Value) -> Value:
    x = (theta_c - _CRITICAL_MIN) / (pi / 2 - _CRITICAL_MIN)
    return x / (1.5 - 0.5 * x)


def to_critical_angle(x: np.ndarray) -> np.ndarray:
    return _CRITICAL_MIN + 1.5 * x / (1 + 0.5 * x) * (pi / 2 - _CRITICAL_MIN)


def from_index(n: Value) -> Value:
    return (1 - 1 / n) / (1 - 1 / INDEX_MAX)


def to_index(x: np.ndarray) -> np.ndarray:
    return 1 / (1 - x * (1 - 1 / INDEX_MAX))


def from_ratio(ratio: Value) -> Value:
    """Coordinate of a ratio of indices: 1/2 where they are equal."""
    return 0.5 + (ratio / (1 + ratio) - 0.5) * ((RATIO_MAX + 1) / (RATIO_MAX - 1))


def to_ratio(x: np.ndarray) -> np.ndarray:
    share = 0.5 + (x - 0.5) * ((RATIO_MAX - 1) / (RATIO_MAX + 1))
    return share / (1 - share)


def from_angle(cos_theta: Value, theta_c: Value) -> Value:
    """Coordinate of an angle of incidence: 1 at the normal, 1/2 at the critical angle theta_c, 0 at grazing.

    Nodes crowd on both sides of the critical angle, and at grazing.
    """
    beyond = ops.arctan2(ops.sqrt(1 - cos_theta * cos_theta), cos_theta) - theta_c
    within = ops.sqrt(-beyond / ops.maximum(theta_c, 1e-6))
    share = ops.minimum(beyond / ops.maximum(pi / 2 - theta_c, 1e-6), 1.0)
    outwards = ops.sqrt(1 - ops.sqrt(1 - share))
    ops.names(beyond=beyond, within=within, share=share, outwards=outwards)
    return 0.5 + 0.5 * ops.select(beyond < 0, within, -outwards)


def from_incidence(cos_theta: Value, theta_c: Value | None) -> Value:
    """Coordinate of a cosine of incidence, on the angular axis where there is a critical angle."""
    return from_cosine(cos_theta) if theta_c is None else from_angle(cos_theta, theta_c)


def to_incidence(x: Value, theta_c: Value | None) -> Value:
    """Cosine of incidence at coordinate x."""
    return to_cosine(x) if theta_c is None else to_angle(x, theta_c)


def to_angle(x: Value, theta_c: Value) -> Value:
    """Cosine of the angle of incidence at coordinate x."""
    within, outwards = 2 * x - 1, ops.maximum(1 - 2 * x, 0.0)
    share = outwards * outwards * (2 - outwards * outwards)
    return ops.cos(ops.select(x > 0.5, theta_c * (1 - within * within), theta_c + (pi / 2 - theta_c) * share))
