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
from velatura.optics.polarisation import Light, Mueller, Transport
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
    the way, followed from outside, brings to the top of each slab, and `light_down` to its bottom, over `up` and
    `down`; none where polarisation is left out.
    """

    w: tuple[Direction, ...]
    up: tuple[Value, ...]
    down: tuple[Value, ...]
    density: tuple[Value, ...]
    others: tuple[Value, ...]
    reverse: tuple[Value, ...]
    back: tuple[WayBack, ...] = ()
    turns: Value = False
    light: tuple[Transport, ...] = ()
    light_down: tuple[Transport, ...] = ()

    def along(self, slab: Value, back: bool) -> tuple[Direction, Light | None]:
        """Direction in which light leaves a slab, by the way back or straight, and what the way brings there."""
        if not back:
            return _direction(self, slab), pick(self.light, slab) if self.light else None
        way = _way_back_below(self, slab - 1)
        x, y, z = way.w
        return (-x, -y, -z), way.light


@dataclass(frozen=True)
class _Crossing:
    """Effects of a surface on the way on light where it and all before it are smooth, else 0: colours or matrices.

    It reflects light from above and from below, or lets it pass to and fro, each time through the slab it comes from.
    """

    reflected: Value | Mueller
    reflected_below: Value | Mueller
    passed: Value | Mueller


def way_out(
    types: Any, layers: WalkedLayers, wo: Direction, rng: Any, turns: Value = False, light: Light | None = None
) -> tuple[WayOut, Any]:
    """Draw a way in from `wo`, which lies above the surface; also the random numbers, advanced.

    Args:
        turns: whether the way goes on by a reflection at the last surface; only for paths that come from above.
        light: that along -wo, where surfaces polarise it.
    """
    lights = [light]
    w, density, others, reverse = [wo], [1.0], [0.0], [1.0]
    straight, smooth = [1.0], 1.0
    crossings: list[_Crossing] = []
    for k, surface in enumerate(layers.surfaces):
        indices = layers.index[k], layers.index[k + 1]
        meeting = SurfaceMeeting(layers, k, *indices, w[k], True, lights[k])
        # Sum up what smooth surfaces do, while all are smooth
        smooth = ops.select(surface.smooth, smooth, 0.0)
        acts = layers.shares if light is None else layers.mueller
        above = transmittance(layers.slabs[k], w[k][2])
        mirrored, passing = acts(k, w[k][2], *indices, True)
        if k == layers.count - 1 and not layers.transmits:
            crossings.append(_Crossing(mirrored * (smooth * above), mirrored * 0.0, mirrored * 0.0))
            break
        # Refract into the next slab
        inward, rng = _refracted(types, meeting, rng)
        w.append((-inward.wo[0], -inward.wo[1], ops.maximum(-inward.wo[2], _GRAZING)))
        lights.append(inward.light)
        spread = w[k][2] / (meeting.eta * meeting.eta * w[k + 1][2])
        straight.append(straight[k] * inward.weight * above * spread)
        below = transmittance(layers.slabs[k + 1], w[k + 1][2])
        mirrored_below = acts(k, w[k + 1][2], *indices[::-1], False)[0] if any(layers.films) else mirrored
        passing = passing * passing * (smooth * above * below)
        crossings.append(_Crossing(mirrored * (smooth * above), mirrored_below * (smooth * below), passing))
        # Sum up the strategies that the path may take instead
        density.append(inward.density)
        rough = ops.select(surface.smooth, 0.0, 1.0)
        more = ops.divide(inward.density_back, density[k]) * others[k] if k else 0.0
        others.append(ops.minimum(rough + more, events.HUGE))
        reverse.append(reverse[k] * ops.divide(inward.reverse, inward.density))
    # Add reflections between smooth surfaces
    sums = _sum_reflections(crossings)
    up, down = straight, straight
    light_up: tuple[Transport, ...] = ()
    light_down: tuple[Transport, ...] = ()
    if light is None:
        up, down = ([x * y for x, y in zip(straight, each)] for each in sums)
    else:
        transports = [each for each in lights if isinstance(each, Transport)]
        light_up, light_down = (tuple(x.after(y) for x, y in zip(transports, each)) for each in sums)
    ways = tuple(w), tuple(up), tuple(down), tuple(density), tuple(others), tuple(reverse)
    out = WayOut(*ways, light=light_up, light_down=light_down)
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
    light: Light | None = out.light[k] if out.light else None
    meeting = SurfaceMeeting(layers, k, layers.index[k], layers.index[k + 1], out.w[k], True, light)
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


def _sum_reflections(crossings: list[_Crossing]) -> tuple[list[Any], list[Any]]:
    """The light that starts at the top of each slab, up, and at its bottom, down, over what goes straight up from the
    top: colours or matrices, solved like adding (up = a + b down in every slab)."""
    # Go down
    none = crossings[0].reflected * 0.0
    a, b, rounds = [_repeated(none)], [none], []
    for k, x in enumerate(crossings):
        rounds.append(_repeated(x.reflected * b[k]))
        a.append(a[k] * rounds[k])
        b.append(x.reflected_below + rounds[k] * b[k] * x.passed)
    # Come back up
    down = [none]
    for k, x in reversed(list(enumerate(crossings))):
        down.insert(0, rounds[k] * (x.reflected * a[k] + x.passed * down[0]))
    return [a[k] + b[k] * d for k, d in enumerate(down)], down


def _repeated(trip: Any) -> Any:
    """Light after any number of round trips."""
    return trip.repeated() if isinstance(trip, Mueller) else 1 / ops.maximum(1 - trip, _GRAZING)


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


def connect_medium_back(layers: WalkedLayers, out: WayOut, path: Path) -> tuple[Value, Light | None]:
    """Contribution of a path that scatters in a medium along the way back, per unit of its weight; and the light that
    the way brings there."""
    slab, way = layers.slab(path.slab), _way_back_below(out, path.slab - 1)
    assert slab.phase
    density = slab.phase.density(-ggx.dot(path.w, way.w))
    more = ops.divide(density, way.density) * way.others
    passed = way.carried * transmittance(slab, way.w[2], 1 - path.height)
    return ops.select(out.turns, density * passed * _share(path, way.reverse, density, False, more), 0.0), way.light


def connect_medium(layers: WalkedLayers, out: WayOut, path: Path) -> tuple[Value, Light | None]:
    """Contribution of a path that scatters in a medium along the way, up or down, per unit of its weight; and the light
    that the way brings there."""
    k, slab = path.slab, layers.slab(path.slab)
    assert slab.phase
    w = _direction(out, k)
    density = slab.phase.density(ggx.dot(path.w, w))
    more = ops.divide(density, pick(out.density, k)) * pick(out.others, k)
    upwards = density * pick(out.up, k) * transmittance(slab, w[2], path.height)
    upwards *= _share(path, pick(out.reverse, k), density, False, more)
    density = slab.phase.density(ggx.dot(path.w, (w[0], w[1], -w[2])))
    downwards = density * pick(out.down, k) * transmittance(slab, w[2], 1 - path.height)
    value = upwards + downwards
    if not out.light:
        return value, None
    each = (out.light, upwards), (out.light_down, downwards)
    above, below = (pick(light, k).times(ops.divide(share, value)) for light, share in each)
    return value, above.plus(below)


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
