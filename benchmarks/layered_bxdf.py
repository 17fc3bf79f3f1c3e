"""The estimator of two layers that pbrt-v4 calls LayeredBxDF, by the interfaces of the package's walk.

Its idea (Pharr, Jakob & Humphreys 2023, 14.3; Guo et al. 2018), in code of our own: a direction is refracted inwards
from either end; a walk from one of them is reflected to and fro, always back at the upper interface; what the lower one
sends out is the direction from the other end, evaluated there, or one drawn there, evaluated at the upper one, weighed
by the power heuristic. Light that facets send to each other is lost, and media absorb only. Samples and their density
are those of the plain walk.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from velatura import kernel, ops
from velatura.binding import Asked, plugin_class
from velatura.optics.ggx import Direction
from velatura.reference import events
from velatura.reference.events import SurfaceMeeting
from velatura.reference.metal import mean
from velatura.reference.next_event import transmittance, way_out
from velatura.reference.plugin import Settings, WalkedPoint, WalkedStack
from velatura.stack import Medium, Stack

_EVENTS = 1000
_CERTAIN, _FAINT = 3, 0.25  # events before Russian roulette, which paths meet that carry less


def fits(stack: Stack, often: bool) -> bool:
    """Whether the estimator is one of this stack: two interfaces, or one over a base; the media between are clear."""
    clear = not any(isinstance(layer, Medium) and np.any(layer.sigma_s) for layer in stack.layers)
    return not often and not stack.transmits and len(stack.surfaces) == 2 and 0 in stack.surfaces and clear


@dataclass
class _Flight:
    """A path below the upper interface, on its way down along w; `carried` and `value` are colours."""

    rng: Any
    w: Direction
    carried: Any
    value: Any
    count: Any
    alive: Any


@kernel.plugin("layered_bxdf")
def make(mi: Any) -> type:
    """The plugin's class for the current variant."""

    class LayeredBxDF(plugin_class(mi)):  # type: ignore[misc]
        def __init__(self, properties: Any) -> None:
            super().__init__(properties, partial(_Stack, mi, Settings(0, _EVENTS, microsurface=False)))

    return LayeredBxDF


class _Stack(WalkedStack):
    def at(self, si: Any, asked: Asked, active: Any) -> WalkedPoint:
        point = super().at(si, asked, active)
        return _Point(point.stack, point.si, point.asked, point.radiance)


class _Point(WalkedPoint):
    def eval(self, wo: Any, active: Any) -> Any:
        import drjit as dr

        stack, mi, si, wi = self.stack, self.stack.mi, self.si, self.si.wi
        active = active & (wi.z > 0) & (wo.z > 0)
        rng = stack.stream(wi.x, wi.y, wo.x, wo.y, si.p.x, si.p.y, si.p.z, si.uv.x, si.uv.y, wo.z)
        layers = stack.layers(si, active, mi.Bool(False))
        index, slab = layers.index, layers.slabs[1]
        # Refract both ends inwards
        out, rng = way_out(mi, layers, (wo.x, wo.y, wo.z), rng)
        upper = SurfaceMeeting(layers, 0, index[0], index[1], (wi.x, wi.y, wi.z), True)
        inward = events.sample_refraction(upper, rng.next_float32(), rng.next_float32())
        one = layers.start(mi.UnpolarizedSpectrum(1))
        value = one * events.evaluate(upper, (wo.x, wo.y, wo.z), True).weight
        flight = _Flight(rng, inward.wo, one * inward.weight, value, mi.UInt32(0), mi.Bool(active))

        def step(f: _Flight) -> tuple[_Flight]:
            # Connect the lower interface to the other end
            lower = SurfaceMeeting(layers, 1, index[1], index[2], (-f.w[0], -f.w[1], -f.w[2]), True)
            f.carried *= transmittance(slab, ops.maximum(-f.w[2], 1e-6))
            met = events.evaluate(lower, out.w[1], True)
            passed = out.up[1] * transmittance(slab, out.w[1][2])
            f.value += f.carried * met.weight * passed * _power(out.density[1], met.certain)
            # Reflect there, and evaluate the upper interface
            turned = events.sample_reflection(lower, f.rng.next_float32(), f.rng.next_float32())
            x, y, z = turned.wo
            f.carried *= turned.weight * transmittance(slab, ops.maximum(z, 1e-6))
            above = SurfaceMeeting(layers, 0, index[1], index[0], (-x, -y, ops.maximum(z, 1e-6)), False)
            leaving = events.evaluate(above, (wo.x, wo.y, -wo.z), False)
            f.value += f.carried * leaving.weight * _power(turned.density, leaving.density_back)
            # Reflect there, too
            again = events.sample_reflection(above, f.rng.next_float32(), f.rng.next_float32())
            f.w = (again.wo[0], again.wo[1], -again.wo[2])
            f.carried *= again.weight
            f.count += 2
            survival = ops.select((f.count > _CERTAIN) & (mean(f.carried) < _FAINT), mean(f.carried), 1.0)
            f.alive &= f.rng.next_float32() < survival
            f.carried = ops.divide(f.carried, survival)
            return (f,)

        (flight,) = dr.while_loop((flight,), lambda f: f.alive & (f.count < _EVENTS), step)
        value = layers.seen(flight.value, mi.UnpolarizedSpectrum)
        return mi.depolarizer(dr.select(active, value, 0))


def _power(own: Any, other: Any) -> Any:
    """Weight of a strategy by the power heuristic."""
    ratio = ops.divide(other, own)
    return 1 / (1 + ops.minimum(ratio * ratio, events.HUGE))
