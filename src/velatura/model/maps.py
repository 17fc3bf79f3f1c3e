"""Roughness maps: from GGX roughness to a variance that adds along a path, and back.

Each map is exactly 0 at 0 and increasing. Roughness is clamped to 0.9999, since the variance of 1 is infinite.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from velatura import ops
from velatura.ops import Value

ALPHA_MAX = 0.9999
VARIANCE_MAX = 1e12  # keeps s/(1+s) from inf/inf


@dataclass(frozen=True)
class RoughnessMap:
    """f and its inverse."""

    forward: Callable[[Value], Value]
    backward: Callable[[Value], Value]

    def variance(self, alpha: Value) -> Value:
        """Variance f(alpha) of a roughness alpha >= 0."""
        return ops.select(alpha > 0, self.forward(ops.clip(alpha, ops.TINY, ALPHA_MAX)), 0.0)

    def roughness(self, variance: Value) -> Value:
        """Roughness f^-1(s) of a variance s >= 0."""
        return ops.select(variance > 0, self.backward(ops.clip(variance, ops.TINY, VARIANCE_MAX)), 0.0)


def _odds_of_power(p: float) -> RoughnessMap:
    def forward(alpha: Value) -> Value:
        x = ops.power(alpha, p)
        return x / (1 - x)

    return RoughnessMap(forward, lambda s: ops.power(s / (1 + s), 1 / p))


def _weier() -> RoughnessMap:
    p, b = 1.28809776, 1.31699416

    def forward(alpha: Value) -> Value:
        x = ops.power(alpha, p)
        return ops.log(1 + b * x / (1 - x))

    def backward(s: Value) -> Value:
        x = ops.exp(ops.minimum(s, 60.0)) - 1
        return ops.power(x / (x + b), 1 / p)

    return RoughnessMap(forward, backward)


MAPS: dict[str, RoughnessMap] = {
    "belcour": _odds_of_power(1.1),  # Belcour 2018, Eq. 6
    "belcour-release": RoughnessMap(lambda a: a / (1 - a), lambda s: s / (1 + s)),  # as in its released plugin
    "weier": _weier(),  # Weier & Belcour 2020, Listing 2
}
