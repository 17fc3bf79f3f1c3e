"""Next-event estimation through the interfaces.

From the direction that is asked for, one way in is drawn that passes the surfaces by refraction alone. Wherever a path
scatters upwards, it is connected to the part of this way that lies in its own slab. A path that leaves through m
surfaces is found by m + 1 strategies, which differ in how many of these refractions the path drew and how many the way
did; the balance heuristic weighs them (Veach and Guibas 1995). The path that draws them all is the plain evaluation of
the last surface.

The way may go on by a reflection at the last surface, and come up again by refraction. Wherever a path scatters
downwards, it is connected to that part: a reflection from below whose direction lies far off its lobe is evaluated,
where it would seldom be drawn.

A path that is followed from either end by chance has the strategies of both, weighed together: what one end must find
in the tail of its first facets, the other evaluates there.

No path can hit a direction behind smooth surfaces. What happens between those that come first from the outside is
therefore no matter of chance: all reflections among them are summed up, and the way through them is their sum.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from velatura import ops
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.optics.polarisation import Light
from velatura.reference import events, facets
from velatura.reference.events import ScatteringEvent, SurfaceMeeting
from velatura.reference.layers import WalkedLayers, WalkedSlab, pick

if TYPE_CHECKING:
    from velatura.reference.walk import Path

_GRAZING = 1e-6


@dataclass(frozen=True)
class WayBack:
    """How to leave from a slab by a reflection at the last surface: down along -w.

    `carried` is the light that arrives outside of what starts at the bottom of the slab. The others are as of `WayOut`.
    """

    w: Direction
    carried: Value
    density: Value
    others: Value
    reverse: Value
    light: Light | None = None


@dataclass(frozen=True)
class WayOut:
    """How to leave from every slab: upwards along `w`, or down along its mirror image, to be reflected.

    `up` and `down` are the light that arrives outside of what starts at the top of the slab, or at its bottom.
    `density` is that of the drawn w. `others`, times the density with which a path would take w, over `density`, is
    the sum of the densities of all strategies that draw more by the path, relative to this one's. `reverse` is the
    density with which a path from outside would draw w, over `density`. `back` are the ways by a reflection, of slab 1
    and those below it, for paths where `turns`; none where a medium lies outside. `light` is the polarised light that
    the way, followed from outside, brings into each slab; none where polarisation is left out.
    """

    w: tuple[Direction, ...]
    up: tuple[Value, ...]
    down: tuple[Value, ...]
    density: tuple[Value, ...]
    others: tuple[Value, ...]
    reverse: tuple[Value, ...]
    back: tuple[WayBack, ...] = ()
    turns: Value = False
    light: tuple[Light | None, ...] = ()

    def along(self, slab: Value, back: bool) -> tuple[Direction, Light | None]:
        """Direction in which light leaves a slab, by the way back or straight, and what the way brings there."""
        if not back:
            return _direction(self, slab), pick(self.light, slab)
        way = _way_back_below(self, slab - 1)
        x, y, z = way.w
        return (-x, -y, -z), way.light


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


def way_out(
    types: Any, layers: WalkedLayers, wo: Direction, rng: Any, turns: Value = False, light: Light | None = None
) -> tuple[WayOut, Any]:
    """Draw a way in from `wo`, which lies above the surface; also the random numbers, advanced.

    Args:
        turns: whether the way goes on by a reflection at the last surface; only for paths that come from above.
        light: that along -wo, where facets polarise it. Reflections between smooth surfaces do not.
    """
    lights = [light]
    w, density, others, reverse = [wo], [1.0], [0.0], [1.0]
    spread, smooth = [1.0], 1.0
    crossings: list[_Crossing] = []
    for k, surface in enumerate(layers.surfaces):
        indices = layers.index[k], layers.index[k + 1]
        meeting = SurfaceMeeting(layers, k, *indices, w[k], True, lights[k])
        # Reflect between smooth surfaces
        smooth = ops.select(surface.smooth, smooth, 0.0)
        mirrored = smooth * meeting.shares(w[k][2])[0]
        above = transmittance(layers.slabs[k], w[k][2])
        if k == layers.count - 1 and not layers.transmits:
            crossings.append(_Crossing(smooth, 0.0, mirrored, 0.0, above, 0.0))
            break
        # Refract into the next slab
        inward, rng = _refracted(types, meeting, rng)
        w.append((-inward.wo[0], -inward.wo[1], ops.maximum(-inward.wo[2], _GRAZING)))
        lights.append(inward.light)
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
    each = map(tuple, (w, up, down, density, others, reverse))
    out = replace(WayOut(*each), light=tuple(lights))
    if turns is False or layers.count == 1 or layers.hazy:
        return out, rng
    back, rng = _way_back(types, layers, out, smooth, rng)
    return replace(out, back=back, turns=turns), rng


def _way_back(
    types: Any, layers: WalkedLayers, out: WayOut, smooth: Value, rng: Any
) -> tuple[tuple[WayBack, ...], Any]:
    """Reflect a way at the last surface, and draw how it comes up again; also the random numbers, advanced.

    What is reflected between surfaces that are all `smooth` is part of `out`, and left out here.
    """
    # Reflect at the last surface
    k = layers.count - 1
    meeting = SurfaceMeeting(layers, k, layers.index[k], layers.index[k + 1], out.w[k], True, out.light[k])
    if layers.microsurface:
        turned, rng = facets.sample_reflection(types, meeting, rng)
    else:
        turned = events.sample_reflection(meeting, rng.next_float32(), rng.next_float32())
    carried = out.up[k] * transmittance(layers.slabs[k], out.w[k][2]) * ops.select(smooth > 0, 0.0, 1.0)
    back = [_after(meeting, turned, WayBack(out.w[k], carried, out.density[k], out.others[k], out.reverse[k]))]
    # Refract into the slabs above
    for k in range(layers.count - 2, 0, -1):
        x, y, z = back[0].w
        light = back[0].light and back[0].light.mirrored(True)
        meeting = SurfaceMeeting(layers, k, layers.index[k + 1], layers.index[k], (-x, -y, z), False, light)
        outward, rng = _refracted(types, meeting, rng)
        x, y, z = outward.wo
        passed = transmittance(layers.slabs[k + 1], back[0].w[2])
        below = replace(back[0], carried=back[0].carried * passed)
        light = outward.light and outward.light.mirrored(True)
        back.insert(0, _after(meeting, replace(outward, wo=(x, y, -z), light=light), below))
    return tuple(back), rng


def _refracted(types: Any, meeting: SurfaceMeeting, rng: Any) -> tuple[events.ScatteringEvent, Any]:
    """A refraction without a choice, between facets where light meets them often; also the random numbers, advanced."""
    if meeting.layers.microsurface:
        return facets.sample_refraction(types, meeting, rng)
    return events.sample_refraction(meeting, rng.next_float32(), rng.next_float32()), rng


def _after(meeting: SurfaceMeeting, event: ScatteringEvent, way: WayBack) -> WayBack:
    """The way as it goes up after an event at a surface."""
    x, y, z = event.wo
    w = x, y, ops.maximum(z, _GRAZING)
    eta = 1.0 if event.reflected is True else meeting.eta
    rough = ops.select(meeting.layers.surface(meeting.j).smooth, 0.0, 1.0)
    return WayBack(
        w,
        way.carried * ops.select(z > 0, event.weight, 0.0) * ops.divide(way.w[2], eta * eta * w[2]),
        event.density,
        ops.minimum(rough + ops.divide(event.density_back, way.density) * way.others, events.HUGE),
        way.reverse * ops.divide(event.reverse, event.density),
        event.light,
    )


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


def way_down(out: WayOut, j: Value, down: Value) -> Direction:
    """The way back from surface j, which leads into the slab below it, local as that of `way_up`."""
    x, y, z = _way_back_below(out, j).w
    return -x, -y, ops.select(down, -z, z)


def _way_back_below(out: WayOut, j: Value) -> WayBack:
    way: WayBack = pick(out.back, j)
    return way


def on_the_way(layers: WalkedLayers, out: WayOut | None, j: Value, reflected: Value, down: Value) -> Value:
    """Whether an event at surface j of a path from above is one that ways draw."""
    refracted = reflected ^ True
    return refracted if out is None or not out.back else refracted | (out.turns & layers.is_base(j) & down)


def connect_surface(meeting: SurfaceMeeting, event: ScatteringEvent, out: WayOut, path: Path, down: Value) -> Value:
    """Contribution of a path that meets a surface, per unit of its weight, `event` being into `way_up`."""
    layers, j = meeting.layers, meeting.j
    w = _direction(out, j)
    drawn = on_the_way(layers, out, j, down, down)
    fewer = ops.select(drawn, ops.divide(event.density_back, path.density) * path.chain, 0.0)
    more = ops.divide(event.density, pick(out.density, j)) * pick(out.others, j)
    passed = pick(out.up, j) * transmittance(layers.slab(j), w[2])
    return event.weight * passed * _share(path, pick(out.reverse, j), event.reverse, drawn, fewer + more)


def connect_back(meeting: SurfaceMeeting, event: ScatteringEvent, out: WayOut, path: Path, down: Value) -> Value:
    """Contribution of a path that meets a surface, per unit of its weight, `event` being into `way_down`."""
    layers, j = meeting.layers, meeting.j
    way = _way_back_below(out, j)
    fewer = ops.select(down, ops.divide(event.density_back, path.density) * path.chain, 0.0)
    more = ops.divide(event.density, way.density) * way.others
    passed = way.carried * transmittance(layers.slab(j + 1), way.w[2])
    value = event.weight * passed * _share(path, way.reverse, event.reverse, down, fewer + more)
    return ops.select(out.turns & (layers.is_base(j) ^ True), value, 0.0)


def connect_medium_back(layers: WalkedLayers, out: WayOut, path: Path) -> Value:
    """Contribution of a path that scatters in a medium along the way back, per unit of its weight."""
    slab, way = layers.slab(path.slab), _way_back_below(out, path.slab - 1)
    assert slab.phase
    density = slab.phase.density(-ggx.dot(path.w, way.w))
    more = ops.divide(density, way.density) * way.others
    passed = way.carried * transmittance(slab, way.w[2], 1 - path.height)
    return ops.select(out.turns, density * passed * _share(path, way.reverse, density, False, more), 0.0)


def connect_medium(layers: WalkedLayers, out: WayOut, path: Path) -> Value:
    """Contribution of a path that scatters in a medium along the way, per unit of its weight."""
    k, slab = path.slab, layers.slab(path.slab)
    assert slab.phase
    w = _direction(out, k)
    density = slab.phase.density(ggx.dot(path.w, w))
    more = ops.divide(density, pick(out.density, k)) * pick(out.others, k)
    upwards = density * pick(out.up, k) * transmittance(slab, w[2], path.height)
    upwards *= _share(path, pick(out.reverse, k), density, False, more)
    density = slab.phase.density(ggx.dot(path.w, (w[0], w[1], -w[2])))
    return upwards + density * pick(out.down, k) * transmittance(slab, w[2], 1 - path.height)


def _share(path: Path, of_way: Value, reverse: Value, drawn: Value, others: Value) -> Value:
    """Weight of a strategy, where the densities of others from the same end add up to `others` times its own.

    A path that walks from either end by chance has the strategies of both, unless a way could draw all its events. The
    last one is of that kind where `drawn`; `of_way` is `reverse` of the way.
    """
    if path.backward is None or path.straight is None:
        return 1 / (1 + others)
    from_other_end = (path.backward * reverse + path.straight) * of_way
    either = (path.straight > 0) & drawn
    return ops.select(either, 1 / (1 + others), 2 / (1 + others + ops.minimum(from_other_end, events.HUGE)))


def transmittance(slab: WalkedSlab, cosine: Value, depth: Value = 1.0) -> Value:
    """The share of light that passes straight through a part of a slab's depth."""
    return slab.straight(ops.divide(depth, cosine))


def _direction(out: WayOut, k: Value) -> Direction:
    x, y, z = (pick([w[axis] for w in out.w], k) for axis in range(3))
    return x, y, z
