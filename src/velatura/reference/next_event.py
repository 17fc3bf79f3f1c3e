"""Next-event estimation through the interfaces.

From the direction that is asked for, one way in is drawn that passes the surfaces by refraction alone. Wherever a path
scatters upwards, it is connected to the part of this way that lies in its own slab. A path that leaves through m
surfaces is found by m + 1 strategies, which differ in how many of these refractions the path drew and how many the way
did; the balance heuristic weighs them (Veach and Guibas 1995). The path that draws them all is the plain evaluation of
the last surface.

A path that is followed from either end by chance has the strategies of both, weighed together: what one end must find
in the tail of its first facets, the other evaluates there.

No path can hit a direction behind smooth surfaces. What happens between those that come first from the outside is
therefore no matter of chance: all reflections among them are summed up, and the way through them is their sum.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from velatura import ops
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.reference import events, facets
from velatura.reference.events import ScatteringEvent, SurfaceMeeting
from velatura.reference.layers import WalkedLayers, WalkedSlab, pick

if TYPE_CHECKING:
    from velatura.reference.walk import Path

_GRAZING = 1e-6


@dataclass(frozen=True)
class WayOut:
    """How to leave from every slab: upwards along `w`, or down along its mirror image, to be reflected.

    `up` and `down` are the light that arrives outside of what starts at the top of the slab, or at its bottom.
    `density` is that of the drawn w. `others`, times the density with which a path would take w, over `density`, is
    the sum of the densities of all strategies that draw more by the path, relative to this one's. `reverse` is the
    density with which a path from outside would draw w, over `density`.
    """

    w: tuple[Direction, ...]
    up: tuple[Value, ...]
    down: tuple[Value, ...]
    density: tuple[Value, ...]
    others: tuple[Value, ...]
    reverse: tuple[Value, ...]


@dataclass(frozen=True)
class _Crossing:
    """One surface on the way: its transmittance, its reflectance from above and below, and the slabs there.

    `smooth` is 1 where this surface and all before it are smooth, else 0.
    """

    smooth: Value
    passed: Value
    reflected: Value
    reflected_below: Value
    above: Value
    below: Value


def way_out(types: Any, layers: WalkedLayers, wo: Direction, rng: Any) -> tuple[WayOut, Any]:
    """Draw a way in from `wo`, which lies above the surface; also the random numbers, advanced."""
    w, density, others, reverse = [wo], [1.0], [0.0], [1.0]
    spread, smooth = [1.0], 1.0
    crossings: list[_Crossing] = []
    for k, surface in enumerate(layers.surfaces):
        indices = layers.index[k], layers.index[k + 1]
        meeting = SurfaceMeeting(layers, k, *indices, w[k], True)
        # Reflect between smooth surfaces
        smooth = ops.select(surface.smooth, smooth, 0.0)
        mirrored = smooth * meeting.shares(w[k][2])[0]
        above = transmittance(layers.slabs[k], w[k][2])
        if k == layers.count - 1 and not layers.transmits:
            crossings.append(_Crossing(smooth, 0.0, mirrored, 0.0, above, 0.0))
            break
        # Refract into the next slab
        if layers.microsurface:
            inward, rng = facets.sample_refraction(types, meeting, rng)
        else:
            inward = events.sample_refraction(meeting, rng.next_float32(), rng.next_float32())
        w.append((-inward.wo[0], -inward.wo[1], ops.maximum(-inward.wo[2], _GRAZING)))
        spread.append(spread[k] * w[k][2] / (meeting.eta * meeting.eta * w[k + 1][2]))
        below = transmittance(layers.slabs[k + 1], w[k + 1][2])
        mirrored_below = mirrored
        if any(layers.films):
            mirrored_below = smooth * layers.shares(k, w[k + 1][2], *indices[::-1], False)[0]
        crossings.append(_Crossing(smooth, inward.weight, mirrored, mirrored_below, above, below))
        # Sum up the strategies that the path may take instead
        density.append(inward.density)
        rough = ops.select(surface.smooth, 0.0, 1.0)
        more = ops.divide(inward.density_back, density[k]) * others[k] if k else 0.0
        others.append(ops.minimum(rough + more, events.HUGE))
        reverse.append(reverse[k] * ops.divide(inward.reverse, inward.density))
    up, down = ([x * s for x, s in zip(weights, spread)] for weights in _sum_reflections(crossings))
    return WayOut(*map(tuple, (w, up, down, density, others, reverse))), rng


def _sum_reflections(crossings: list[_Crossing]) -> tuple[list[Value], list[Value]]:
    """The weights `up` and `down` of all slabs, solved like adding (up = a + b down in every slab)."""
    # Go down
    a: list[Value] = [1.0]
    b: list[Value] = [0.0]
    for k, x in enumerate(crossings):
        inside = x.passed * x.above / _left(x, b[k])
        a.append(inside * a[k])
        b.append(x.reflected_below * x.below + inside * b[k] * x.smooth * x.passed * x.below)
    # Come back up
    down: list[Value] = [0.0]
    for k, x in reversed(list(enumerate(crossings))):
        returned = x.reflected * x.above * a[k] + x.smooth * x.passed * x.below * down[0]
        down.insert(0, returned / _left(x, b[k]))
    return [a[k] + b[k] * d for k, d in enumerate(down)], down


def _left(x: _Crossing, b: Value) -> Value:
    """Share of light that a round trip above a surface does not return."""
    return ops.maximum(1 - x.reflected * x.above * b, _GRAZING)


def way_up(out: WayOut, j: Value, down: Value) -> Direction:
    """The way out from surface j, local to a path that comes from above if `down`, else from below."""
    x, y, z = _direction(out, j)
    return x, y, ops.select(down, z, -z)


def connect_surface(meeting: SurfaceMeeting, event: ScatteringEvent, out: WayOut, path: Path, down: Value) -> Value:
    """Contribution of a path that meets a surface, per unit of its weight, `event` being into `way_up`."""
    layers, j = meeting.layers, meeting.j
    w = _direction(out, j)
    fewer = ops.select(down, 0.0, ops.divide(event.density_back, path.density) * path.chain)
    more = ops.divide(event.density, pick(out.density, j)) * pick(out.others, j)
    passed = pick(out.up, j) * transmittance(layers.slab(j), w[2])
    return event.weight * passed * _share(path, out, j, event.reverse, down, fewer + more)


def connect_medium(layers: WalkedLayers, out: WayOut, path: Path) -> Value:
    """Contribution of a path that scatters in a medium along the way, per unit of its weight."""
    k, slab = path.slab, layers.slab(path.slab)
    assert slab.phase
    w = _direction(out, k)
    density = slab.phase.density(ggx.dot(path.w, w))
    more = ops.divide(density, pick(out.density, k)) * pick(out.others, k)
    upwards = density * pick(out.up, k) * transmittance(slab, w[2], path.height)
    upwards *= _share(path, out, k, density, True, more)
    density = slab.phase.density(ggx.dot(path.w, (w[0], w[1], -w[2])))
    return upwards + density * pick(out.down, k) * transmittance(slab, w[2], 1 - path.height)


def _share(path: Path, out: WayOut, k: Value, reverse: Value, turned: Value, others: Value) -> Value:
    """Weight of a strategy, where the densities of others from the same end add up to `others` times its own.

    A path that walks from either end by chance has the strategies of both, unless all its events are refractions, not
    `turned` upwards.
    """
    if path.backward is None or path.straight is None:
        return 1 / (1 + others)
    from_other_end = (path.backward * reverse + path.straight) * pick(out.reverse, k)
    refracted = (path.straight > 0) & (turned ^ True)
    return ops.select(refracted, 1 / (1 + others), 2 / (1 + others + ops.minimum(from_other_end, events.HUGE)))


def transmittance(slab: WalkedSlab, cosine: Value, depth: Value = 1.0) -> Value:
    """The share of light that passes straight through a part of a slab's depth."""
    return slab.straight(ops.divide(depth, cosine))


def _direction(out: WayOut, k: Value) -> Direction:
    x, y, z = (pick([w[axis] for w in out.w], k) for axis in range(3))
    return x, y, z
