"""A phase function by its values at some cosines."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from math import cos, pi

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.ops import Value
from velatura.optics.phase import PhaseFunction
from velatura.renderer.packets import SampledGrid

Array = NDArray[np.floating]

COSINE, DENSITY, SHARE = range(3)  # channels


class Tabulated(SampledGrid, PhaseFunction):
    """Straight lines over the cosine, between nodes.

    `data` are the cosine, the density and the share of light at lower cosines at each node, (2^m + 1, 3), so that m
    halvings find a place among them. The last nodes may be one.
    """

    def __init__(self, data: Array) -> None:
        self.data, self._packets = data, {}

    @classmethod
    def of(cls, cosines: Sequence[float], values: Sequence[float]) -> Tabulated:
        """The phase function of values in any unit at ascending cosines from -1 to 1."""
        x, p = np.array(cosines, float), np.array(values, float)
        shares = 2 * pi * np.cumsum(np.concatenate([[0.0], 0.5 * np.diff(x) * (p[1:] + p[:-1])]))
        data = np.stack([x, p / shares[-1], shares / shares[-1]], axis=-1)
        more = (1 << (len(x) - 2).bit_length()) + 1 - len(x)
        return cls(np.pad(data, ((0, more), (0, 0)), mode="edge"))

    def density(self, cos_theta: Value) -> Value:
        (x_0, p_0, _), (x_1, p_1, _) = self._about(COSINE, cos_theta)
        return p_0 + (p_1 - p_0) * _place(cos_theta, x_0, x_1)

    def sample(self, u: Value) -> Value:
        (x_0, p_0, share_0), (x_1, p_1, share_1) = self._about(SHARE, u)
        part = _place(u, share_0, share_1)
        # The root of the share of light of the interval below a place in it, which is a polynomial of degree 2
        most = p_0 + ops.sqrt(p_0 * p_0 + part * (p_1 * p_1 - p_0 * p_0))
        return ops.clip(x_0 + (x_1 - x_0) * ops.minimum(ops.divide(part * (p_0 + p_1), most), 1.0), -1.0, 1.0)

    def within(self, angle: float) -> float:
        cosine = cos(angle)
        (x_0, p_0, share_0), _ = self._about(COSINE, cosine)
        return float(1 - share_0 - pi * (cosine - x_0) * (p_0 + self.density(cosine)))

    @property
    def key(self) -> Hashable:
        return type(self), self.data.tobytes()

    def _about(self, channel: int, value: Value) -> tuple[list[Value], list[Value]]:
        """The nodes about a value of a channel."""
        place, step = 0.0 * value, 1.0
        for _ in range((len(self.data) - 1).bit_length() - 1):
            step *= 0.5
            further = place + step
            place = ops.select(ops.interpolate(self, further)[channel] <= value, further, place)
        return ops.interpolate(self, place), ops.interpolate(self, place + step)


def _place(value: Value, low: Value, high: Value) -> Value:
    return ops.clip(ops.divide(value - low, high - low), 0.0, 1.0)
