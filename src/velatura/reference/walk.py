"""The random walk through a stack: position-free, since only depth and direction matter (Guo et al. 2018).

It computes with the number types of a renderer's variant, or of Dr.Jit alone: `types` is a module that holds Float,
UInt32 and Bool.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Any

from velatura import ops
from velatura.ops import Value
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.optics.phase import deflect
from velatura.optics.polarisation import Light, Transport
from velatura.reference import events, facets
from velatura.reference.events import ScatteringEvent, SurfaceMeeting
from velatura.reference.layers import WalkedLayers, pick
from velatura.reference.metal import is_colour, mean
from velatura.reference.next_event import (
    WayOut,
    connect_back,
    connect_medium,
    connect_medium_back,
    connect_surface,
    on_the_way,
    way_down,
    way_up,
)

ROULETTE = 0.25  # a path that carries less than this survives by chance, and carries this then


@dataclass
class Path:
    """The state of the walk before an event: at the surface ahead, or `inside` a medium.

    `w` is the direction of travel in slab `slab`; `height` is measured downwards, in depths of the slab; `weight` is a
    colour, and so is the only one of `value`, or each of the 16 of a Mueller matrix, row by row. `smooth`: only smooth
    surfaces were met so far; `painted`: the diffuse base was among them. `density` and `chain` weigh the strategies of
    `next_event`, where `value` comes from. So do `backward` and `straight` those of paths from the other end, None
    where there are none: over the density of what was drawn, the sum of theirs, and while a way could have drawn all
    events its density. `light` is the polarised light along `w`, None where polarisation is left out.
    """

    rng: Any
    w: Direction
    slab: Value
    inside: Value
    height: Value
    weight: Value
    smooth: Value
    painted: Value
    deepest: Value
    events: Value
    alive: Value
    density: Value
    chain: Value
    value: list[Value]
    light: Light | None
    backward: Value | None = None
    straight: Value | None = None


def walk(
    types: Any,
    layers: WalkedLayers,
    wi: Direction,
    rng: Any,
    colour: Value,
    active: Value = True,
    max_depth: int = 1000,
    out: WayOut | None = None,
    painted: bool | None = None,
    light: Light | None = None,
    either_end: bool = False,
) -> Path:
    """Follow paths that enter along -wi until they leave, die, or have met `max_depth` events.

    Args:
        types: see above.
        wi: unit vector away from the surface; below it only for a stack that transmits.
        rng: random numbers, with `next_float32`.
        colour: what a path carries at first, all channels 1.
        out: the way out that every event is connected to; the paths then gather the BSDF's `value` for it.
        painted: gathered is from paths that the diffuse base has scattered, from all others (False), or both (None).
        light: that along -wi, where surfaces polarise it; with an `out` that is polarised, the value is a Mueller
            matrix, for frames whose x is `horizontal` at both ends. Media depolarise what they scatter, since their
            phase function has no Mueller matrix, and so does a diffuse base.
        either_end: whether half of all paths, by chance, are to be followed from the other end: with `wi` and `out`
            exchanged. The value is then the mean over both.

    Returns:
        The paths as they ended. Those still `alive` were cut off; the others left along `w`, or died with weight 0.
    """
    import drjit as dr

    # Enter
    below, w = wi[2] < 0, (-wi[0], -wi[1], -wi[2])
    path = Path(
        rng=rng,
        w=w,
        slab=ops.select(below, types.UInt32(layers.count), types.UInt32(0)),
        inside=types.Bool(False),
        height=types.Float(0),
        weight=colour,
        smooth=types.Bool(True),
        painted=types.Bool(False),
        deepest=types.UInt32(0),
        events=types.UInt32(0),
        alive=types.Bool(active),
        density=types.Float(1),
        chain=types.Float(0),
        value=[colour * 0 for _ in range(16 if light and out else 1)],
        light=light,
        backward=types.Float(0) if either_end else None,
        straight=types.Float(1) if either_end else None,
    )
    _travel(layers, path)

    # Scatter on
    def step(path: Path) -> tuple[Path]:
        _scatter(types, layers, path, out, painted)
        _roulette(path)
        _travel(layers, path)
        path.events += 1
        return (path,)

    def goes_on(path: Path) -> Value:
        return path.alive & (path.events < max_depth)

    (path,) = dr.while_loop((path,), goes_on, step)
    return path


def _scatter(types: Any, layers: WalkedLayers, path: Path, out: WayOut | None, painted: bool | None) -> None:
    """One event, at a surface or in a medium."""
    # Meet the surface ahead, as if from above
    down = path.w[2] < 0
    j = ops.select(down, path.slab, path.slab - 1)
    beyond = ops.select(down, path.slab + 1, path.slab - 1)
    wi = (-path.w[0], -path.w[1], ops.absolute(path.w[2]))
    light = path.light and path.light.mirrored(down ^ True)
    # What leaves is gathered, and need not be drawn
    enters, leaves = (False, False) if out is None else (layers.outside(path.slab), layers.outside(beyond))
    index = pick(layers.index, path.slab), pick(layers.index, beyond)
    meeting = SurfaceMeeting(layers, j, *index, wi, down, light, reflects=leaves, refracts=enters)
    u1, u2, u3 = (path.rng.next_float32() for _ in range(3))
    targets = [] if out is None else [(way_up(out, j, down), down)]
    if out is not None and out.back:
        targets.append((way_down(out, j, down), down ^ True))
    if layers.microsurface:
        active = path.alive & (path.inside ^ True)
        onward, towards, path.rng = facets.scatter(types, meeting, path.weight, path.rng, active, targets)
    else:
        onward = events.sample(meeting, path.weight, u1, u2, u3)
        towards = [(events.evaluate(meeting, *target),) for target in targets]
    rough = layers.surface(j).smooth ^ True
    if layers.base == "diffuse":
        path.painted |= layers.is_base(j) & (path.inside ^ True)
    # Gather what leaves from here
    if out is not None:
        kept = True if painted is None else path.painted ^ (not painted)
        _gather(meeting, towards[0], out, path, down, kept, back=False)
    if out is not None and out.back and (painted is not False or layers.base != "diffuse"):
        _gather(meeting, towards[1], out, path, down, True, back=True)
    # Turn
    z = onward.wo[2]
    turned: Direction = (onward.wo[0], onward.wo[1], ops.select(down, z, -z))
    light = onward.light and onward.light.mirrored(down ^ True)
    drawn = on_the_way(layers, out, j, onward.reflected, down)
    chain = ops.select(rough, types.Float(1), 0)
    chain += ops.select(drawn, ops.divide(onward.density_back, path.density) * path.chain, 0.0)
    weight, density, reverse = onward.weight, onward.density, onward.reverse
    certain = ops.select(drawn, onward.certain, 0.0)
    slab = ops.select(onward.reflected, path.slab, beyond)
    if layers.scatters:
        phase = layers.slab(path.slab).phase
        assert phase
        cosine = phase.sample(u1)
        scattered = deflect(path.w, cosine, 2 * pi * u2)
        turned = (
            ops.select(path.inside, scattered[0], turned[0]),
            ops.select(path.inside, scattered[1], turned[1]),
            ops.select(path.inside, scattered[2], turned[2]),
        )
        weight = ops.select(path.inside, 1.0, weight)
        density = ops.select(path.inside, phase.density(cosine), density)
        reverse, certain = ops.select(path.inside, density, reverse), ops.select(path.inside, 0.0, certain)
        chain = ops.select(path.inside, 1.0, chain)
        slab = ops.select(path.inside, path.slab, slab)
        light = path.light and ops.select_record(path.inside, path.light.depolarised(turned), light)
    path.smooth &= (rough | path.inside) ^ True
    path.w, path.slab, path.light = ggx.normalize(turned), slab, light
    path.density, path.chain = density, ops.minimum(chain, events.HUGE)
    if path.backward is not None and path.straight is not None:
        backward = ops.divide(path.backward * reverse + path.straight, density)
        path.backward = ops.minimum(backward, events.HUGE)
        path.straight = ops.minimum(path.straight * ops.divide(certain, density), events.HUGE)
    path.weight = path.weight * weight
    path.deepest = ops.maximum(path.deepest, slab)


def _gather(
    meeting: SurfaceMeeting,
    towards: Sequence[ScatteringEvent],
    out: WayOut,
    path: Path,
    down: Value,
    kept: Value,
    back: bool,
) -> None:
    """Add what paths send along the way out, or `back` to the last surface, where it is `kept`; at a surface by events
    `towards` it that add up."""
    layers, at_surface, in_medium = meeting.layers, connect_surface, connect_medium
    if back:
        at_surface, in_medium = connect_back, connect_medium_back
    slab = ops.select(path.inside, path.slab, meeting.j + back)
    for n, event in enumerate(towards):
        gathered, light = at_surface(meeting, event, out, path, down), event.light and event.light.mirrored(down ^ True)
        w, way = out.along(slab, back)
        if layers.scatters:
            scattered, there = in_medium(layers, out, path)
            gathered = ops.select(path.inside, scattered if n == 0 else 0.0, gathered)
            light = ops.select_record(path.inside, path.light and path.light.depolarised(w), light)
            way = ops.select_record(path.inside, there, way)
        gathered = path.weight * ops.select(kept, gathered, 0.0)
        if path.light is None:
            path.value[0] += gathered
            continue
        assert isinstance(light, Transport) and isinstance(way, Transport)
        for k, part in enumerate(light.joined(w, way)):
            path.value[k] += gathered * part


def _roulette(path: Path) -> None:
    """End faint paths by chance, and make up for it in the others."""
    carried = mean(path.weight)
    survival = ops.minimum(carried / ROULETTE, 1.0)
    survives = path.rng.next_float32() < survival
    path.weight = ops.select(survives, ops.divide(path.weight, survival), 0.0)
    path.alive &= survives


def _travel(layers: WalkedLayers, path: Path) -> None:
    """Go on to the next event in the slab, or leave the stack."""
    # Fly freely, or to the surface ahead
    down, cosine = path.w[2] < 0, ops.maximum(ops.absolute(path.w[2]), 1e-7)
    slab = layers.slab(path.slab)
    if layers.scatters:
        path.height = ops.select(path.inside, path.height, ops.select(down, 0.0, 1.0))
        ahead = ops.select(down, 1 - path.height, path.height) / cosine
        density = _of_one_channel(path.rng.next_float32(), path.weight, slab.scattering)
        flight = ops.divide(-ops.log(1 - path.rng.next_float32()), density)
        path.inside = flight < ahead
        length = ops.minimum(flight, ahead)
        path.height += ops.select(down, length, -length) * cosine
        seen = ops.exp(-slab.scattering * length) * ops.select(path.inside, slab.scattering, 1.0)
        path.weight *= ops.divide(seen, ops.divide(mean(path.weight * seen), mean(path.weight)))
    else:
        length = 1 / cosine
    path.weight *= slab.absorbed(length)
    # Leave
    leaves = ops.select(down, path.slab == layers.count, path.slab == 0)
    path.alive &= (leaves & (path.inside ^ True)) ^ True


def _of_one_channel(u: Value, carried: Value, colour: Value) -> Value:
    """The channel of `colour` that u falls on, the channels being as likely as the path carries them."""
    import drjit as dr

    if not is_colour(colour):  # a number for all channels
        return colour
    chosen, end = colour[0], carried[0]
    for i in range(1, len(colour)):
        chosen = ops.select(u * dr.sum(carried) < end, chosen, colour[i])
        end = end + carried[i]
    return chosen
