"""A diffuse base under a stack: light that enters, scatters there, and leaves, between bounces below the interfaces."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from velatura import ops
from velatura.model import adding, momentum, recursion
from velatura.model.prepare import Prepared, PreparedInterface, PreparedMedium
from velatura.ops import Value
from velatura.optics.ggx import Direction

Settle = Callable[[Value], Value]

# Cosines and weights of the mean over directions; what the stack does is smooth in the cosine
_NODES = [(0.5 + 0.5 * float(x), 0.5 * float(w)) for x, w in zip(*np.polynomial.legendre.leggauss(5))]


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
        return self.scale * _below(self.prepared, wo).t_0i


def as_it_is(value: Value) -> Value:
    return value


def with_means(prepared: Prepared, settle: Settle = as_it_is) -> Prepared:
    """`prepared` with what the stack reflects and transmits of diffuse light from the base.

    The means are over projected solid angle in the medium at the base. Directions that Snell's law lets out are those
    of light coming in at cosine c above, 2c dc / n^2 of all; what goes down there comes up as well. `settle` is
    applied to every cosine and energy: a renderer evaluates them, so that one kernel serves all nodes.
    """
    if prepared.base is None:
        return prepared
    n2 = prepared.base.n * prepared.base.n
    lowest = ops.sqrt(1 - n2)  # cosine above of grazing light at the base, where the base's index is the lower
    reflected: Value = 0.0
    transmitted: Value = 0.0
    for node, weight in _NODES:
        cosine = settle(ops.mean(lowest + (1 - lowest) * node))
        state = _below(prepared, _tilted(cosine))
        share = cosine * (1 - lowest) * (2 * weight) / n2
        reflected = reflected + settle(state.r_i0) * share
        transmitted = transmitted + settle(state.t_0i) * share
    reflected = reflected + _kept(prepared, n2, settle)
    base = dataclasses.replace(prepared.base, mean_reflectance=reflected, mean_transmittance=transmitted)
    return dataclasses.replace(prepared, base=base)


def _kept(prepared: Prepared, n2: Value, settle: Settle) -> Value:
    """Share of the light that comes back to the base because Snell's law does not let it out: all but what media take.

    Rough interfaces are taken as smooth, which lose nothing to facets.
    """
    if not any(isinstance(layer, PreparedMedium) for layer in prepared.layers):
        return ops.maximum(1 - 1 / n2, 0.0)
    inside = _smooth_from_below(prepared)
    total: Value = 0.0
    begin: Value = 0.0
    index: Value = 1.0
    lowest: Value = 1.0
    for layer in inside.layers:
        if not isinstance(layer, PreparedInterface):
            continue
        # Between the angles where this interface and those below it begin to keep light in
        index = index * layer.n12
        lowest = ops.minimum(lowest, index)
        end = ops.sqrt(1 - lowest * lowest)
        for node, weight in _NODES:
            cosine = settle(begin + (end - begin) * node)
            lobes, _ = adding.lobes(inside, _tilted(cosine))
            energy = sum((lobe.energy for lobe in lobes[1:]), lobes[0].energy)
            total = total + settle(energy) * (cosine * (end - begin) * (2 * weight))
        begin = end
    return total


def _smooth_from_below(prepared: Prepared) -> Prepared:
    """The stack as smooth interfaces, turned over."""
    model = dataclasses.replace(prepared.model, reflectance="fresnel", tir="off", calibrations=None)
    layers = [
        dataclasses.replace(layer, eta=1 / layer.eta, n12=1 / layer.n12, reflectance=None, leaving=None)
        if isinstance(layer, PreparedInterface) and layer.eta is not None
        else layer
        for layer in reversed(prepared.layers)
    ]
    return dataclasses.replace(prepared, model=model, layers=tuple(layers), base=None)


def under(prepared: Prepared, wi: Direction) -> Base | None:
    """The diffuse part for a direction; None without a diffuse base."""
    base = prepared.base
    if base is None:
        return None
    through = _below(prepared, wi).t_0i
    reflected = through * base.albedo / ops.maximum(1 - base.albedo * base.mean_reflectance, ops.TINY)
    scale = reflected / (base.n * base.n * pi)
    return Base(prepared, scale, reflected * base.mean_transmittance)


def _below(prepared: Prepared, wi: Direction) -> adding.State | momentum.State:
    """The state at the base. Its light is followed angle by angle, so that total reflection needs no correction."""
    layers = (
        dataclasses.replace(layer, leaving=None) if isinstance(layer, PreparedInterface) else layer
        for layer in prepared.layers
    )
    return recursion.below(dataclasses.replace(prepared, layers=tuple(layers)), wi)


def _tilted(cosine: Value) -> Direction:
    return ops.sqrt(1 - cosine * cosine), 0.0, cosine
