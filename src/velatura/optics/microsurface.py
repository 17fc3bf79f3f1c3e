"""Light between the facets of a rough surface: flights through the Smith microsurface (Heitz et al. 2016).

The surface is a random height field of GGX normals. A height is named by its rank: the share of the surface that lies
below it, 0 at the bottom and 1 at the top; the distribution of heights itself does not matter. Directions are those of
travel, up or down. Everything holds for light below the surface too, seen upside down: turn directions around, and take
1 - rank.
"""

from __future__ import annotations

from velatura import ops
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction

_STEEP = 1e-6


def projected_area(w: Direction, alpha_u: Value, alpha_v: Value) -> Value:
    """Area of the facets that face w, seen along w, over that of the surface; w up or down."""
    x, y = alpha_u * w[0], alpha_v * w[1]
    return 0.5 * (w[2] + ops.sqrt(w[2] * w[2] + x * x + y * y))


def smith_lambda(w: Direction, alpha_u: Value, alpha_v: Value) -> Value:
    """Smith's Lambda: positive upwards, at most -1 downwards."""
    z = ops.select(w[2] < 0, ops.minimum(w[2], -_STEEP), ops.maximum(w[2], _STEEP))
    return projected_area((w[0], w[1], z), alpha_u, alpha_v) / z - 1


def escape(w: Direction, rank: Value, alpha_u: Value, alpha_v: Value) -> Value:
    """Chance to leave upwards along w without meeting a facet (Heitz et al. 2016, Eq. 8)."""
    power = ops.maximum(smith_lambda(w, alpha_u, alpha_v), 0.0)
    return ops.select(w[2] > 0, ops.exp(power * ops.log(ops.maximum(rank, ops.TINY))), 0.0)


def fly(w: Direction, rank: Value, alpha_u: Value, alpha_v: Value, u: Value) -> Value:
    """Rank of the next facet that is met; above 1 where light leaves (Heitz et al. 2016, Algorithm 1)."""
    power = smith_lambda(w, alpha_u, alpha_v)
    power = ops.select(w[2] > 0, ops.maximum(power, _STEEP), power)
    return rank * ops.exp(ops.minimum(-ops.log(1 - u) / power, 80.0))


def visible(w: Direction, h: Direction, alpha_u: Value, alpha_v: Value) -> Value:
    """Density of facets that face w, which points away from them, up or down."""
    facing = ops.maximum(ggx.dot(w, h), 0.0) * ggx.ndf(h, alpha_u, alpha_v)
    return ops.select(h[2] > 0, ops.divide(facing, projected_area(w, alpha_u, alpha_v)), 0.0)
