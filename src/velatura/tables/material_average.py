"""An average of one material, sampled once over direction and roughness, so that a look-up is one fetch."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from velatura import ops
from velatura.ops import Value
from velatura.renderer.packets import Packets, packets
from velatura.tables import coordinates

Average = Callable[[Value, Value], Value]  # of cos_theta and alpha


@dataclass(frozen=True, eq=False)
class Sheet:
    """Values at the nodes of a plane, as packets of Dr.Jit; differentiable with respect to what made them.

    `theta_c` is the critical angle that the angular axis follows, None for an axis in the cosine. `colour` is the type
    of the values, None where all channels are the same.
    """

    shape: tuple[int, ...]
    theta_c: Value | None
    colour: type | None
    held: Packets
    first: ClassVar[int] = 0

    def packets(self, dialect: Any) -> Packets:
        return self.held

    def __call__(self, cos_theta: Value, alpha: Value) -> Value:
        x = coordinates.from_incidence(cos_theta, self.theta_c)
        channels = ops.interpolate(self, x, coordinates.from_roughness(alpha))
        return channels[0] if self.colour is None else self.colour(*channels)


def sample(average: Average, number: type, shape: tuple[int, ...], theta_c: Value | None = None) -> Sheet:
    """The average at all nodes, in one kernel, for Dr.Jit numbers of that type."""
    import drjit as dr

    x, y = (number(axis.ravel()) for axis in np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij"))
    values = average(coordinates.to_incidence(x, theta_c), coordinates.to_roughness(y)) + dr.zeros(number, dr.width(x))
    colour = type(values) if dr.size_v(values) > 1 and any(c.index != values[0].index for c in values) else None
    flat = dr.ravel(values) if colour else (values if dr.depth_v(values) <= 1 else values[0])
    dr.eval(flat)
    dialect = sys.modules[number.__module__]
    channels = len(values) if colour else 1
    return Sheet(shape, theta_c, colour, packets(flat, channels, dialect))
