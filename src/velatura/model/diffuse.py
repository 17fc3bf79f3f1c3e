"""A diffuse base under a stack: light that enters, scatters there, and leaves, between bounces below the interfaces."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from velatura import ops
from velatura.model import adding
from velatura.model.operators import COS_MIN
from velatura.model.prepare import Prepared, PreparedInterface, PreparedMedium
from velatura.ops import Value
from velatura.optics.ggx import Direction

NODES = 5  # of the mean over directions; the reflectance is smooth in the cosine above


@dataclass(frozen=True)
class Base:
    """The diffuse part of a BSDF for one direction wi: f = scale T(wo), T being what the stack transmits.

    `energy` is its albedo, a colour.
    """

    prepared: Prepared
    scale: Value
    energy: Value

    def value(self, wo: Direction) -> Value:
        """f(wi, wo), a colour, without the cosine."""
        return self.scale * _transmitted(self.prepared, wo)


def with_mean_reflectance(prepared: Prepared, settle: Callable[[Value], Value] = lambda x: x) -> Prepared:
    """`prepared` with the mean reflectance of the stack for diffuse light from the base.

    The mean is over projected solid angle in the medium at the base. Directions that Snell's law lets out are those
    of light coming in at cosine c above, 2c dc / n^2 of all; the others are totally reflected, weakened by what
    lies between the base and the last interface. `settle` is applied to every cosine and reflectance: a renderer
    evaluates them, so that one kernel serves all nodes.
    """
    if prepared.base is None:
        return prepared
    n2 = prepared.base.n * prepared.base.n
    lowest = ops.sqrt(1 - n2)  # cosine above of grazing light at the base, where the base's index is the lower
    mean: Value = 0.0
    for node, weight in zip(*np.polynomial.legendre.leggauss(NODES)):
        cosine = settle(ops.mean(lowest + (1 - lowest) * float(node + 1) / 2))
        below = settle(_below(prepared, (ops.sqrt(1 - cosine * cosine), 0.0, cosine)).r_i0)
        mean = mean + below * (cosine * (1 - lowest) * float(weight)) / n2
    inside = ops.maximum(1 - 1 / n2, 0.0)
    weakened = ops.exp(-2 * _depth_at_base(prepared) / ops.maximum(0.5 * ops.sqrt(inside), COS_MIN))
    base = dataclasses.replace(prepared.base, mean_reflectance=mean + inside * weakened)
    return dataclasses.replace(prepared, base=base)


def under(prepared: Prepared, transmitted: adding.Lobe) -> Base | None:
    """The diffuse part for the direction whose transmitted lobe is given; None without a diffuse base."""
    base = prepared.base
    if base is None:
        return None
    reflected = transmitted.energy * base.albedo / ops.maximum(1 - base.albedo * base.mean_reflectance, ops.TINY)
    scale = reflected / (base.n * base.n * pi)
    return Base(prepared, scale, reflected * (1 - base.mean_reflectance))


def _below(prepared: Prepared, wi: Direction) -> adding.State:
    state = adding.top(prepared, wi[2])
    for layer in prepared.layers:
        state, _ = adding.add(prepared, state, layer, wi)
    return state


def _transmitted(prepared: Prepared, w: Direction) -> Value:
    return _below(prepared, w).t_0i


def _depth_at_base(prepared: Prepared) -> Value:
    """Optical depth of the medium, if any, between the base and the last interface."""
    last = prepared.layers[-1] if prepared.layers else None
    return last.tau if isinstance(last, PreparedMedium) and _has_interface(prepared) else 0.0


def _has_interface(prepared: Prepared) -> bool:
    return any(isinstance(layer, PreparedInterface) for layer in prepared.layers)
