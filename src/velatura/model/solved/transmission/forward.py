"""Samples that crowd about the momentum of the light, where that passes wide.

As complex numbers w, momenta of the unit disc are moved onto the same disc, towards a of it, by Moebius' transformation

    q = (w + a) / (1 + conj(a) w),    dw / dq = ((1 - |a|^2) / |1 - conj(a) q|^2)^2,

so that none is lost, and the density, which grows by dw / dq, vanishes nowhere. Here a is a share of the momentum of
the light, which travels along -(x, y) of the direction it comes from.
"""

from __future__ import annotations

from velatura import ops
from velatura.ops import Value
from velatura.optics.ggx import Direction


def moved(share: Value, i: Direction, w: Direction) -> Direction:
    """A direction w as moved for light from i."""
    if _is_none(share):
        return w
    return _moved(-1 * share * i[0], -1 * share * i[1], w)


def undone(share: Value, i: Direction, q: Direction) -> tuple[Direction, Value]:
    """The direction that is moved to q, and how much the density of momenta grows there."""
    if _is_none(share):
        return q, 1.0
    x, y = -1 * share * i[0], -1 * share * i[1]
    ratio = (1 - (x * x + y * y)) / _denominator(-1 * x, -1 * y, q)[2]
    return _moved(-1 * x, -1 * y, q), ratio * ratio


def _moved(x: Value, y: Value, w: Direction) -> Direction:
    real, imaginary, size2 = _denominator(x, y, w)
    u, v = w[0] + x, w[1] + y
    u, v = (u * real + v * imaginary) / size2, (v * real - u * imaginary) / size2
    return u, v, ops.sqrt(1 - u * u - v * v)


def _denominator(x: Value, y: Value, w: Direction) -> tuple[Value, Value, Value]:
    """1 + conj(a) w for a = x + iy, and its square."""
    real, imaginary = 1 + (x * w[0] + y * w[1]), x * w[1] - y * w[0]
    return real, imaginary, real * real + imaginary * imaginary


def _is_none(share: Value) -> bool:
    return isinstance(share, float) and share == 0.0
