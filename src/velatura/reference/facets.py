"""Many scattering events between the facets of one rough interface (Heitz et al. 2016).

Functions alike those of `events`, with `rng` for random numbers, which they return advanced. Light that has met one
facet and light that has met more are weighed apart: the first by the densities of single events, on top of a small
constant; the second, whose densities are unknown, by one number of their order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from velatura import ops
from velatura.ops import Value
from velatura.optics import ggx, microsurface, refraction
from velatura.optics.ggx import Direction
from velatura.optics.polarisation import Light, Transport, horizontal
from velatura.reference import events
from velatura.reference.events import ScatteringEvent, SurfaceMeeting
from velatura.reference.metal import mean

_MOST_EVENTS = 1000
_FLOOR = 1e-3  # density of single events at least, per steradian
_MANY = 2.0  # density that stands for that of several events

Target = tuple[Direction, Value]  # and whether it lies on the side of reflection
Evaluated = tuple[ScatteringEvent, ...]  # events that add up


@dataclass
class Flight:
    """Light between facets: its direction of travel, and the rank of its height, both as seen from its own medium.

    Beyond the interface (not `outside`) that is upside down. `weight` and `values` are colours; `light` is polarised
    light, None where polarisation is left out. `sent` is the sum of what `values` are the
    sum of, each with its light, or none.
    """

    rng: Any
    w: Direction
    rank: Value
    outside: Value
    weight: Value
    values: list[Value]
    count: Value
    alive: Value
    light: Light | None
    sent: list[Transport]


def scatter(
    types: Any, meeting: SurfaceMeeting, carried: Value, rng: Any, active: Value, targets: Sequence[Target]
) -> tuple[ScatteringEvent, list[Evaluated], Any]:
    """Scatter until the light leaves the interface; also what goes into the directions `targets`.

    The value of the first facet is its mean over all heights, that of later ones an estimate.
    """
    # Scatter as if smooth or diffuse, where it is
    once = events.sample(meeting, carried, *(rng.next_float32() for _ in range(3)))
    towards = [events.evaluate(meeting, *target) for target in targets]
    surface = meeting.layers.surface(meeting.j)
    rough = surface.smooth ^ True
    if meeting.layers.base == "diffuse":
        rough &= meeting.opaque ^ True
    # Scatter between the facets elsewhere
    flight = _fly(types, meeting, carried, rng, active & rough, [surface.into(w) for w, _ in targets])
    wo = surface.out_of(ops.select_record(flight.outside, flight.w, _reverse(flight.w)))
    many = _weighed(events.evaluate(meeting, wo, flight.outside), flight.weight, flight.count > 1)
    if flight.light is not None:
        many = replace(
            many, light=ops.select_record(flight.outside, flight.light, flight.light.inverted).seen_by(surface.out_of)
        )
    values: list[Evaluated] = []
    for k, (target, event) in enumerate(zip(targets, towards)):
        first = _weighed(event, event.weight * _unmasked(meeting, *target), False)
        later = _weighed(event, flight.values[k], True)
        if flight.sent:
            sent = flight.sent[k].times(ops.divide(1.0, flight.values[k]))
            later = replace(later, light=sent.seen_by(surface.out_of))
        values.append((ops.select_record(rough, first, event), later))
    return ops.select_record(rough, many, once), values, flight.rng


def sample_refraction(types: Any, meeting: SurfaceMeeting, rng: Any) -> tuple[ScatteringEvent, Any]:
    """Scatter until the light leaves the interface; its weight is 0 where that is by reflection."""
    # Refract once where the interface is smooth
    once = events.sample_refraction(meeting, rng.next_float32(), rng.next_float32())
    surface = meeting.layers.surface(meeting.j)
    rough = surface.smooth ^ True
    # Scatter between the facets elsewhere
    colour = types.Float(1) + 0.0 * meeting.shares(1.0)[0]
    flight = _fly(types, meeting, colour, rng, rough, [])
    through = flight.outside ^ True
    wo = ops.select_record(through, surface.out_of(_reverse(flight.w)), once.wo)
    # Weigh by what single events would do, here and back
    i = meeting.wi
    below = meeting.above ^ True
    back = SurfaceMeeting(meeting.layers, meeting.j, meeting.n_out, meeting.n_in, (wo[0], wo[1], -wo[2]), below)
    densities = events.evaluate(back, (i[0], i[1], -i[2]), False)
    onward = densities.density_back
    turned = replace(densities, wo=wo, density=onward, density_back=densities.density, certain=onward)
    many = _weighed(turned, ops.select(through, flight.weight, 0.0), flight.count > 1)
    if flight.light is not None:
        many = replace(many, light=flight.light.inverted.seen_by(surface.out_of))
    return ops.select_record(rough, many, once), flight.rng


def sample_reflection(types: Any, meeting: SurfaceMeeting, rng: Any) -> tuple[ScatteringEvent, Any]:
    """Scatter until the light leaves the interface; its weight is 0 where that is by refraction."""
    # Reflect once where the interface is smooth or diffuse
    once = events.sample_reflection(meeting, rng.next_float32(), rng.next_float32())
    surface = meeting.layers.surface(meeting.j)
    if meeting.layers.base == "diffuse":
        return once, rng
    rough = surface.smooth ^ True
    # Scatter between the facets elsewhere
    colour = types.Float(1) + 0.0 * meeting.shares(1.0)[0]
    flight = _fly(types, meeting, colour, rng, rough, [])
    wo = ops.select_record(flight.outside, surface.out_of(flight.w), once.wo)
    # Weigh by what single events would do, here and back
    there = events.evaluate(meeting, wo, True)
    turned = replace(there, density=there.certain, density_back=there.reverse, reverse=there.density)
    many = _weighed(turned, ops.select(flight.outside, flight.weight, 0.0), flight.count > 1)
    if flight.light is not None:
        many = replace(many, light=flight.light.seen_by(surface.out_of))
    return ops.select_record(rough, many, once), flight.rng


def _fly(
    types: Any,
    meeting: SurfaceMeeting,
    carried: Value,
    rng: Any,
    active: Value,
    targets: Sequence[Direction],
) -> Flight:
    """Follow light from facet to facet; `targets` are directions away from the surface, up or down, and gathered is
    what facets after the first send there."""
    import drjit as dr

    surface, colour = meeting.layers.surface(meeting.j), carried * 0
    alpha = surface.alpha_u, surface.alpha_v
    start = surface.into((-meeting.wi[0], -meeting.wi[1], -meeting.wi[2]))
    light = meeting.light and meeting.light.seen_by(surface.into)
    sent = []
    if isinstance(light, Transport):
        sent = [Transport(horizontal(target), light.columns).times(colour) for target in targets]
    flight = Flight(
        rng,
        start,
        types.Float(1),
        types.Bool(True),
        colour + 1,
        [colour] * len(targets),
        types.UInt32(0),
        types.Bool(active),
        light,
        sent,
    )

    def step(f: Flight) -> tuple[Flight]:
        # Fly to the next facet, or away
        f.rank = microsurface.fly(f.w, f.rank, *alpha, f.rng.next_float32())
        f.alive &= f.rank <= 1
        i = _reverse(f.w)
        # Send light to the targets
        again = f.alive & (f.count > 0)
        for k, target in enumerate(targets):
            value, sent = _value(meeting, f, i, target)
            value = ops.select(again, f.weight * value, 0.0)
            f.values[k] = f.values[k] + value
            if isinstance(sent, Transport):
                f.sent[k] = f.sent[k].plus(sent.along(target, horizontal(target)).times(value))
        # Meet a facet
        h = ggx.sample_visible(i, *alpha, f.rng.next_float32(), f.rng.next_float32())
        sides = _sides(meeting, f.outside)
        (reflectance, passing), mirrored, refracted = meeting.layers.meet(meeting.j, i, h, *sides, f.light)
        kept = carried * f.weight
        chance = ops.divide(mean(kept * reflectance), mean(kept * (reflectance + passing)))
        chance = ops.select(meeting.opaque, 1.0, chance)
        reflected = f.rng.next_float32() < chance
        share = ops.select(reflected, reflectance / chance, ops.divide(passing, 1 - chance))
        f.weight = ops.select(f.alive, f.weight * share, f.weight)
        # Turn; for refracted light the surface is upside down
        o = ops.select_record(
            reflected, ggx.reflect(i, h), _reverse(refraction.refract(i, h, _eta(meeting, f.outside)))
        )
        f.w = ops.select_record(f.alive, o, f.w)
        if mirrored is not None and refracted is not None:
            f.light = ops.select_record(f.alive, ops.select_record(reflected, mirrored, refracted.inverted), f.light)
        f.rank = ops.select(reflected | (f.alive ^ True), f.rank, 1 - f.rank)
        f.outside ^= f.alive & (reflected ^ True)
        f.count += ops.select(f.alive, 1, 0)
        return (f,)

    def goes_on(f: Flight) -> Value:
        return f.alive & (f.count < _MOST_EVENTS)

    (flight,) = dr.while_loop((flight,), goes_on, step)
    flight.weight = ops.select(flight.alive, 0.0, flight.weight)
    return flight


def _value(meeting: SurfaceMeeting, flight: Flight, i: Direction, target: Direction) -> tuple[Value, Light | None]:
    """Light that a facet met from i scatters along `target` and out of the interface, f |cos theta_o|; also as it is
    polarised."""
    # Find the facet that serves
    goal = ops.select_record(flight.outside, target, _reverse(target))
    same_side = goal[2] > 0
    eta = ops.select(same_side, 1.0, _eta(meeting, flight.outside))
    h = refraction.half_vector(i, goal, eta)
    cos_i, cos_o = ggx.dot(i, h), ggx.dot(goal, h)
    serves = (cos_i > 0) & ((cos_o > 0) ^ same_side ^ True)
    # Scatter there, and leave without meeting another
    surface = meeting.layers.surface(meeting.j)
    alpha = surface.alpha_u, surface.alpha_v
    sides = _sides(meeting, flight.outside)
    shares, mirrored, refracted = meeting.layers.meet(meeting.j, i, h, *sides, flight.light)
    share, light = ops.select(same_side, *shares), ops.select_record(same_side, mirrored, refracted)
    density = microsurface.visible(i, h, *alpha) * refraction.jacobian(cos_i, cos_o, eta)
    rank = ops.select(same_side, flight.rank, 1 - flight.rank)
    leaves = microsurface.escape(ops.select_record(same_side, goal, _reverse(goal)), rank, *alpha)
    sent = light and ops.select_record(flight.outside, light, light.inverted)
    return share * ops.select(serves, density * leaves, 0.0), sent


def _unmasked(meeting: SurfaceMeeting, target: Direction, reflected: Value) -> Value:
    """Share of the light of a first facet that leaves along `target` without meeting another, over Smith's G1, by which
    single events lose it: the mean of `microsurface.escape` over the ranks of `microsurface.fly`, r^(1 + Lambda)."""
    surface = meeting.layers.surface(meeting.j)
    i, (x, y, z) = surface.into(meeting.wi), surface.into(target)
    alpha = surface.alpha_u, surface.alpha_v
    here = microsurface.smith_lambda(i, *alpha)
    there = ops.maximum(microsurface.smith_lambda((x, y, ops.absolute(z)), *alpha), 0.0)
    above = (1 + here) / (1 + here + there)
    below = ops.exp(ops.log_gamma(2 + here) + ops.log_gamma(1 + there) - ops.log_gamma(2 + here + there))
    return (1 + there) * ops.select(reflected, above, below)


def _eta(meeting: SurfaceMeeting, outside: Value) -> Value:
    return ops.select(outside, meeting.eta, 1 / meeting.eta)


def _sides(meeting: SurfaceMeeting, outside: Value) -> tuple[Value, Value, Value]:
    """Indices of the medium that the light is in, and of that beyond; and whether the first is the one above."""
    here = ops.select(outside, meeting.n_in, meeting.n_out)
    there = ops.select(outside, meeting.n_out, meeting.n_in)
    return here, there, outside ^ meeting.above ^ True


def _weighed(event: ScatteringEvent, weight: Value, many: Value) -> ScatteringEvent:
    names = "density", "density_back", "certain", "reverse"
    densities = {name: ops.select(many, _MANY, getattr(event, name) + _FLOOR) for name in names}
    return replace(event, weight=weight, **densities)


def _reverse(w: Direction) -> Direction:
    return -w[0], -w[1], -w[2]
