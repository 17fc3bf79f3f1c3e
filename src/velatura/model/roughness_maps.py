"""Roughness maps: from GGX roughness to a variance that adds along a path, and back.

Each map is exactly 0 at 0. Roughness is clamped to 0.9999, since the variance of 1 is infinite. Of a pair of axes, all
maps but one treat each by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from velatura import ops
from velatura.model.guards import EXPONENT_MAX, MAPPED_ALPHA_MAX, VARIANCE_MAX
from velatura.ops import Value


@dataclass(frozen=True)
class RoughnessMap:
    """f and its inverse, along one axis.

    Both take the value along this axis and that across, which makes a difference to one map only.
    """

    forward: Callable[[Value, Value], Value]
    backward: Callable[[Value, Value], Value]

    def variance(self, alpha: Value, across: Value | None = None) -> Value:
        """Variance f(alpha) of a roughness alpha >= 0; `across` that along the other axis, None for the same."""
        along = ops.clip(alpha, ops.TINY, MAPPED_ALPHA_MAX)
        other = along if across is None else ops.clip(across, ops.TINY, MAPPED_ALPHA_MAX)
        return ops.select(alpha > 0, self.forward(along, other), 0.0)

    def roughness(self, variance: Value, across: Value | None = None) -> Value:
        """Roughness f^-1(s) of a variance s >= 0; `across` that along the other axis, None for the same."""
        along = ops.clip(variance, ops.TINY, VARIANCE_MAX)
        other = along if across is None else ops.clip(across, ops.TINY, VARIANCE_MAX)
        return ops.select(variance > 0, self.backward(along, other), 0.0)


def _each(forward: Callable[[Value], Value], backward: Callable[[Value], Value]) -> RoughnessMap:
    """The map that treats each axis separately."""
    return RoughnessMap(lambda along, across: forward(along), lambda along, across: backward(along))


def _odds_of_power(p: float) -> RoughnessMap:
    def forward(alpha: Value) -> Value:
        x = ops.power(alpha, p)
        return x / (1 - x)

    return _each(forward, lambda s: ops.power(s / (1 + s), 1 / p))


def _weier() -> RoughnessMap:
    p, b = 1.28809776, 1.31699416

    def forward(alpha: Value) -> Value:
        x = ops.power(alpha, p)
        return ops.log(1 + b * x / (1 - x))

    def backward(s: Value) -> Value:
        return ops.power(_log_sigmoid(s, b), 1 / p)

    return _each(forward, backward)


#: Of the map over both axes: a to d of the way there, a to e of the way back (Weier & Belcour 2020, Appendix B).
WEIER_2D = (
    (0.0134517769, 0.0123629536, 0.493769777, 0.225934414),
    (1.38609881, 0.609910674, 100.608653, 64.1513931, 1e-5),
)


def weier_2d(there: Sequence[float], back: Sequence[float]) -> RoughnessMap:
    """A fit in each direction; they are not exact inverses: .3 goes to .316 as published (Weier & Belcour 2020, B)."""

    def forward(along: Value, across: Value) -> Value:
        a, b, c, d = there
        x, apart = ops.power(along, a), along - across
        return along * ops.log(1 + b * x / (1 - x)) * ops.exp(apart * (c * apart + d))

    def backward(along: Value, across: Value) -> Value:
        a, b, c, d, e = back
        apart = ops.clip(along - across, -EXPONENT_MAX, EXPONENT_MAX)
        own, other = ops.power(_log_sigmoid(along, b), 1 / a), ops.power(_log_sigmoid(across, c), 1 / d)
        return ops.minimum(own * other * ops.exp(e * apart), 1.0)

    return RoughnessMap(forward, backward)


def _log_sigmoid(s: Value, b: Value) -> Value:
    x = ops.maximum(ops.exp(ops.minimum(s, EXPONENT_MAX)) - 1, s)  # s where rounding leaves less
    return x / (x + b)


#: For what is interpolated: roughness itself, as matrices, so that axes may turn.
AS_IT_IS = RoughnessMap(lambda along, across: along, lambda along, across: along)

MAPS: dict[str, RoughnessMap] = {
    "belcour": _odds_of_power(1.1),  # Belcour 2018, Eq. 6
    "belcour-release": _each(lambda a: a / (1 - a), lambda s: s / (1 + s)),  # as in its released plugin
    "weier": _weier(),  # Weier & Belcour 2020, Listing 2
    "weier-2d": weier_2d(*WEIER_2D),
}
