"""Averages over a GGX interface by quadrature that is split where the integrand bends.

The average of a function of one microfacet reflection, weighted as in the directional albedo (Belcour 2018, Eq. 2):

    FGD = 1/pi int_0^1 du int_0^pi dphi  F(wi.h) G1(wi) G1(wo) (wi.h) / (cos_theta cos_theta_h),
    tan(theta_h) = alpha sqrt(u / (1-u)).

As one meeting among many, a reflection leaves by height-correlated masking G2 in place of G1(wi) G1(wo).

The integrand bends where wo reaches the horizon and where wi.h passes the critical angle. Both curves are known, so
both integrals are split there, and Gauss-Legendre nodes are drawn towards the ends of every piece, which flattens the
square root that Fresnel has at the critical angle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import pi

import numpy as np

from velatura.optics import ggx

NODES = 10  # on every piece of an integral: an error of 5e-5 at worst
COS_MIN, ALPHA_MIN = 1e-3, 1e-4  # stand in for 0, where quadrature would divide by it
CHUNK = 64  # points integrated at a time: their nodes fit the cache

Progress = Callable[[float], None]  # called with the share that is done


def ignore(done: float) -> None:
    """Does nothing: for callers without a progress bar."""


@dataclass(frozen=True)
class Reflections:
    """Quadrature of all single reflections, each array of shape (points, nodes).

    The weights of a point sum to the albedo of a mirror; `cos_d` is wi.h, `cos_o` the cosine of the way out.
    """

    weight: np.ndarray
    cos_d: np.ndarray
    cos_o: np.ndarray


def average(
    of: Callable[..., np.ndarray],
    bend: str,
    cos_theta: np.ndarray,
    alpha: np.ndarray,
    *indices: np.ndarray,
    nodes: int = NODES,
    correlated: bool = False,
    progress: Progress = ignore,
) -> np.ndarray:
    """`of(reflections, *indices)` at every point, all of shape (points,), the results joined.

    The first of the indices, if there are any, is a relative index, and the integrand may bend where the cosine
    named by `bend` passes its critical angle. Masking is height-`correlated`, or separable.
    """
    cos_critical = np.sqrt(np.maximum(1 - indices[0] ** 2, 0)) if indices else np.zeros(len(alpha))
    results = []
    for start in range(0, len(alpha), CHUNK):
        chunk = slice(start, start + CHUNK)
        r = reflections(cos_theta[chunk], alpha[chunk], cos_critical[chunk], bend, nodes, correlated)
        results.append(of(r, *(index[chunk, None] for index in indices)))
        progress(min(1.0, (start + CHUNK) / len(alpha)))
    return np.concatenate(results)


@cache
def _nodes(count: int) -> tuple[np.ndarray, np.ndarray]:
    x, w = np.polynomial.legendre.leggauss(count)
    t, w = (x + 1) / 2, w / 2
    return t * t * (3 - 2 * t), w * 6 * t * (1 - t)


def _split(edges: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights on every piece between the sorted `edges` of shape (..., pieces+1), pieces joined."""
    t, w = _nodes(count)
    low, length = edges[..., :-1, None], np.diff(edges)[..., None]
    shape = (*edges.shape[:-1], -1)
    return (low + length * t).reshape(shape), (length * w).reshape(shape)


def reflections(
    cos_theta: np.ndarray, alpha: np.ndarray, cos_critical: np.ndarray, bend: str, nodes: int, correlated: bool = False
) -> Reflections:
    """Quadrature at points (cos_theta, alpha > 0) of shape (points,).

    The integrand may bend where the cosine named by `bend` passes cos_critical, shape (points,).
    """
    theta, theta_c = np.arccos(cos_theta)[:, None], np.arccos(cos_critical)[:, None]
    alpha = alpha[:, None]

    # Split the normals' angle where a bend enters or leaves the circle of azimuths
    half = 0.5 if bend == "cos_o" else 1.0
    bends = [half * abs(theta - theta_c), half * (theta + theta_c), pi / 4 - theta / 2, pi / 4 + theta / 2]
    tan2 = np.tan(np.clip(np.hstack(bends), 0, pi / 2 - 1e-9)) ** 2 / alpha**2
    inner = 1 - 1 / np.sqrt(1 + tan2)  # v, where u = 1 - (1-v)^2 tames the long tail of slopes
    zero = np.zeros_like(theta)
    v, weight_v = _split(np.sort(np.hstack([zero, inner, zero + 1])), nodes)
    one_minus_v = np.maximum(1 - v, 1e-9)
    weight_u = 2 * one_minus_v * weight_v
    cos_h = 1 / np.sqrt(1 + alpha**2 * (1 / one_minus_v**2 - 1))
    sin_h = np.sqrt(1 - cos_h**2)

    # Split the azimuth at the critical angle and end it at the horizon
    cos_i, sin_i = cos_theta[:, None], np.sqrt(1 - cos_theta[:, None] ** 2)
    across = np.maximum(sin_i * sin_h, 1e-30)

    def azimuth(cos_d: np.ndarray) -> np.ndarray:
        return np.arccos(np.clip((cos_d - cos_i * cos_h) / across, -1, 1))

    def leaving_at(cos_o: np.ndarray | float) -> np.ndarray:
        return azimuth((cos_i + cos_o) / (2 * cos_h))

    horizon = leaving_at(0.0)
    at_critical = leaving_at if bend == "cos_o" else azimuth
    critical = np.minimum(at_critical(cos_critical[:, None]), horizon)
    phi, weight_phi = _split(np.stack([np.zeros_like(horizon), critical, horizon], axis=-1), nodes)

    # Weigh every reflection
    cos_d = (cos_i * cos_h)[..., None] + (sin_i * sin_h)[..., None] * np.cos(phi)
    cos_d = np.clip(cos_d, 0, 1)
    cos_o = np.clip(2 * cos_d * cos_h[..., None] - cos_i[..., None], 0, 1)
    g_i, g_o = _masking(cos_i, alpha)[..., None], _masking(cos_o, alpha[..., None])
    g = g_i * g_o
    if correlated:
        g = g / np.maximum(g_i + g_o - g, 1e-30)
    weight = weight_u[..., None] * weight_phi / pi * g * cos_d / (cos_i * cos_h)[..., None]
    flat = (len(cos_theta), -1)
    return Reflections(weight.reshape(flat), cos_d.reshape(flat), cos_o.reshape(flat))


def _masking(cos_theta: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    return ggx.masking((np.sqrt(1 - cos_theta**2), 0.0, cos_theta), alpha, alpha)
