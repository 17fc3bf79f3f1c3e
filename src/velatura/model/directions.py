"""Directions on either side of a stack."""

from __future__ import annotations

from velatura import ops
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.optics.ggx import Direction


def upright(w: Direction, wi: Direction) -> Direction:
    """The direction flipped with wi, so that wi lies in the upper hemisphere."""
    return w[0], w[1], ops.select(wi[2] < 0, -w[2], w[2])


def refracted(w: Direction, eta: Value) -> Direction:
    """The refracted direction turned up; its height is 0 under total internal reflection."""
    return w[0] / eta, w[1] / eta, fresnel.cos_transmitted(w[2], eta)


def select_direction(where: Value, a: Direction, b: Direction) -> Direction:
    """The direction a where a condition holds, else b."""
    x, y, z = (ops.select(where, p, q) for p, q in zip(a, b))
    return x, y, z
