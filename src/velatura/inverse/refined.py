"""Stacks for a model that has no closed form, and is slow: `velatura`.

The nearest model in closed form finds a stack; then few calls of the model itself, by Broyden's method, meet the
target. They move the coordinates of a drag, within their bounds. Where more is fixed than those can keep, the model in
closed form is asked for other lobes, until the model itself reads those that are wanted.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from velatura.errors import InvalidInput
from velatura.inverse.lobes import interface, stacks
from velatura.inverse.lobes.interface import ENERGY_MIN, Choice
from velatura.inverse.lobes.partial_stack import Array
from velatura.inverse.lobes.stacks import Partial
from velatura.inverse.lobes.target import BLUR, Fixed, Target, distance
from velatura.inverse.local import surrogate
from velatura.inverse.local.coordinates import Bound, plain
from velatura.inverse.local.dragged import DraggedStack, seen
from velatura.inverse.local.line import Line
from velatura.inverse.nearest import lobes_of
from velatura.inverse.nearest import nearest as nearest_from
from velatura.inverse.reasons import UNMET, Direction
from velatura.inverse.solution import EFFORTS, Solution, closed_form_paths, in_closed_form, solutions
from velatura.model import Model
from velatura.model.roughness_maps import MAPS
from velatura.model.variance import Isotropic, Roughness
from velatura.results import digits
from velatura.stack import Stack

GREY = Bound(0, "colour", 1, 0.0)  # one index for all channels
EFFORT = EFFORTS[:1]  # to find a stack near which the model is met
STARTS, WIDER = (1.0, 0.7, 0.4, 0.15), 2.5  # energies, and variances of a lobe below another, that a wish starts from
READINGS = 60  # to find ways out, as interfaces that are read
LEAST_READINGS, MOST_READINGS = 5, 8  # of stacks, for one way
SAID = 1e-4  # changes of quantities that are mentioned, as logarithms
TRIES, OWN, FEWER = 6, 4, 4  # stacks that are begun with; those that have the lobes of one target; where none has
HOPELESS = 0.5  # share of what is asked that the first of these misses, where none has and no other one follows
PARTS = (1.0, 0.5, 0.25)  # of a correction, where all of it has no stack
FOLLOWED, EXACT = 12, 2e-7  # readings of a search that follows the closed form, and by which these may miss
BRUSHED = 1e-6  # the same of lobes with axes, whose readings take longest
LIKELY = 3  # stacks that it begins with
MAPPED, CLOSE = 4, 0.1  # requests, each corrected by what the model misses of the last one's stack, unless that is less
SAME = 0.03  # logarithm by which models differ about the energy of an index
MISSED = 1e-4  # energy or variance that is mentioned
COLOURED = 1e-5  # energy by which the colour of a lobe that films make may be missed
SMALL = 0.01  # variance that is added to that of a goal, for units in which it is missed


def search(target: Target, model: Model) -> Solution | None:
    """The preferred stack of the model in closed form, moved to one whose lobes, read by the model, are the target.

    At first the closed form is followed from few stacks, which ends after few readings where it leads astray. Of
    brushed lobes the search goes on from the stack that came nearest, if none of them leads to one.
    """
    own = _of(target, model.surrogate, EFFORTS)
    if own is not None:
        likely, first = list[Solution](), next(own)
        others = itertools.chain([first], _corrected(first, target, model), own, _approaching(target, model.surrogate))
        for found in itertools.islice(others, 0 if target.pinned or target.has_films else LIKELY):
            if (followed := _followed(found, target, model)) is not None:
                return followed
            likely.append(found)
        # Readings of lobes of three interfaces take longest, and no stack but the likely ones has led to one
        triple = any(lobe.interfaces > 2 for lobe in target.lobes)
        tried = itertools.islice(itertools.chain(likely, others), LIKELY if triple else TRIES)
    else:
        tried = itertools.islice(_approaching(target, model.surrogate), FEWER)
    nearest, least = None, np.inf
    for n, found in enumerate(tried):
        met = moved(found, target, model, giving=own is not None and n == 0)
        if isinstance(met, Solution):
            return met
        if met.missing < least:
            nearest, least = found, met.missing
        if own is None and target.kind is Isotropic and HOPELESS < met.missing < np.inf:
            break
    last = moved(nearest, target, model, giving=False, effort=2) if nearest and target.kind is not Isotropic else None
    return last if isinstance(last, Solution) else None


def _approaching(target: Target, model: Model) -> Iterator[Solution]:
    """Stacks with the lobes of targets from which one is approached."""
    for start in itertools.islice(starts(target), 1, None):
        yield from _of(start, model, EFFORT) or ()


def _followed(found: Solution, target: Target, model: Model) -> Solution | None:
    """A stack near one that is found, with the lobes of a target, as the corrected closed form leads to it."""
    dragged = _dragged(found, target, model)
    if dragged is None or dragged.achromatic(target) is not target:
        return None
    here, goal = dragged.point.reading.value, dragged.space.goal(target)
    enough = EXACT if target.kind is Isotropic else BRUSHED
    there = Line(dragged.point, here, goal, *dragged.constant(target), enough=enough).last([FOLLOWED], whole=True)
    if there.bound is not None or not there.settled:
        return None
    return Solution(target, model, tuple(there.point.layers))


def _corrected(found: Solution, target: Target, model: Model) -> Iterator[Solution]:
    """The stack of other lobes in closed form, which the model itself reads as nearer to those of a target.

    Where facets scatter much light often, models differ by factors. So each request is the last one, times what the
    model misses of its stack, or half of that (as logarithms) where it has none: space mapping (Bandler et al. 1994).
    """
    f, count = MAPS[model.map], 3 * len(target.lobes)

    def numbers(of: Target) -> Array:
        variances = [f.variance(np.array(lobe.axes[:2])) for lobe in of.lobes]
        return np.log(np.maximum(np.concatenate([*(lobe.colour for lobe in of.lobes), *variances]), ENERGY_MIN))

    def ask(request: Array) -> Solution | None:
        asked, x = target, np.exp(request)
        for k, (lobe, axes) in enumerate(zip(target.lobes, f.roughness(x[count:]).reshape(-1, 2))):
            asked = asked.with_lobe(k, energy=tuple(x[3 * k : 3 * k + 3].tolist()))
            asked = asked.with_roughness(k, Roughness(axes[0], axes[1], lobe.axes.rotation))
        return in_closed_form(asked, model.surrogate, EFFORT)

    request = goal = numbers(target)
    for _ in range(MAPPED):
        missing = goal - numbers(seen(found.stack, target, model))
        if request is not goal and np.abs(missing).max() < CLOSE:
            break
        tried = (request + share * missing for share in PARTS)
        answers = ((other, each) for each in tried if (other := ask(each)))
        nearer = next(answers, None)
        if nearer is None:
            return
        found, request = nearer
    yield dataclasses.replace(found, target=target)


def _of(start: Target, model: Model, efforts: Sequence[tuple[int, int]]) -> Iterator[Solution] | None:
    """Stacks with the lobes of a start: the preferred ones of either side, then ones from all over. None if there are
    none."""
    paths = closed_form_paths(_as_fixed(start, model), model, efforts)
    if not paths:
        return None
    order = np.argsort(paths.cost, kind="stable")
    _, first = np.unique(_sides(start, paths)[order], return_index=True)
    spread = np.linspace(0, len(order) - 1, OWN, dtype=int)
    some = list(dict.fromkeys([*sorted(first), *spread]))[:OWN]
    return solutions(start, model, paths, order[some].tolist())


def _sides(target: Target, paths: Partial) -> Array:
    """Which lobes end in an interface denser than what is above it, of N stacks, as bits, (N,).

    No step leads from one side to the other.
    """
    sides, above = np.zeros(len(paths.cost), int), np.array(target.exterior)
    last = np.cumsum([lobe.interfaces for lobe in target.lobes]) - 1
    for n, part in enumerate(paths.layers):
        if part.kind == "dielectric":
            sides = 2 * sides + (part.eta > above)[0] * (n in last)
            above = part.eta
    return sides


def moved(found: Solution, target: Target, model: Model, giving: bool = True, effort: int = 1) -> Solution | Bound:
    """A stack near one that is found, with the lobes of a target; the bound that is in the way if there is none.

    giving: whether kept coordinates may change at bounds, which takes longer. effort: as `DraggedStack.met`.
    """
    if target.pinned:
        return _requested(found, target, model)
    dragged = _dragged(found, target, model)
    if dragged is None or dragged.achromatic(target) is not target:
        return GREY
    there = dragged.met(target, giving, effort)
    if isinstance(there, Bound):
        return there
    missed = there.missed(target) > MISSED
    if there.coloured and there.missed(target) > COLOURED:
        return GREY
    return Solution(target, model, tuple(there.point.layers), there.now(target) if missed else None)


def from_start(start: Stack, target: Target, model: Model) -> Solution | Direction | None:
    """A stack itself, if it has the lobes of a target and all that is fixed; or else the answer of `nearest` from it.

    That is a way out where the target is not met. None where the stack is not of the form of the target.
    """
    layers, dragged = plain(start), DraggedStack.of(start, target, model, with_pins=True)
    if dragged is None or start.exterior != target.exterior or not target.kept(layers):
        return None
    if dragged.snapped(target) == target:
        return Solution(target, model, tuple(layers))
    found = nearest_from(dragged, target, lobes_of(start, dragged))
    has = DraggedStack.of(found.stack.stack, target, model, with_pins=True)
    assert has is not None
    if found.met:
        missed = has.missed(target, has.space.counted) > MISSED
        return Solution(target, model, tuple(found.stack.point.layers), has.now(target) if missed else None)
    lobe = 0 if found.lobe is None else found.lobe
    way = Direction(f"lobe {lobe + 1}", "", 0.0, target)
    near = has.snapped(target).model_copy(update={"start": found.stack.stack})
    return dataclasses.replace(_way(way, target, near, model), why=found.why, lobe=lobe + 1, constraint=found.reason)


def obstacle(target: Target, model: Model) -> tuple[Bound, Solution] | None:
    """The bound that keeps the model from lobes that the nearest one in closed form has a stack for, and that stack.

    None if the closed form has none.
    """
    found = in_closed_form(target, model.surrogate, EFFORT)
    if found is None:
        return None
    there = moved(found, target, model, giving=False, effort=0)
    return there if isinstance(there, Bound) else Bound(len(target.lobes) - 1, UNMET[0], 1, 0.0), found


def ways(offered: Sequence[Direction], target: Target, model: Model) -> list[Direction]:
    """Ways out that the model itself has: from the stacks of those of the closed form, the nearest lobes that it reads.

    What a way changes may change, all else stays. The number of readings is limited, and one way is always found.
    """
    found, tried, left = dict[str, Direction](), list[object](), READINGS
    for way in offered:
        loose, form = _loose(way, target), _in_form_of(way.target, target)
        readings = _readings(target, min(left, READINGS // 2))
        if (form, loose) in tried or (found and readings < LEAST_READINGS):
            continue
        tried.append((form, loose))
        start = in_closed_form(way.target, model.surrogate, EFFORT)
        if start is not None:
            near = nearest(start, form, loose, model, max(readings, LEAST_READINGS))
            left -= READINGS // 2
            direction = _way(way, target, near, model)
            found.setdefault(direction.words, direction)
    return sorted(found.values(), key=lambda way: way.change)


def ways_from(found: Solution, target: Target, bound: Bound, model: Model) -> list[Direction]:
    """Ways out where the closed form has a stack, and the model itself meets a bound near it."""
    directions = []
    for what, name in (("energy", "energy"), ("blur", "variance")):
        way = Direction(f"lobe {bound.lobe + 1} {name}", "", 0.0, target)
        near = nearest(found, target, [(bound.lobe, what)], model, _readings(target, READINGS // 2))
        directions.append(_way(way, target, near, model))
    return sorted(directions, key=lambda way: way.change)


def _readings(target: Target, interfaces: int) -> int:
    """The number of readings of a stack of a target that read as many interfaces; brushed ones count twice."""
    units = sum(lobe.interfaces for lobe in target.lobes)
    return min(interfaces // (units if target.kind is Isotropic else 2 * units), MOST_READINGS)


def nearest(found: Solution, target: Target, loose: Sequence[tuple[int, str]], model: Model, readings: int) -> Target:
    """The lobes nearest to a target that the model reads on the way from a stack, and the stack that has them."""
    dragged = DraggedStack.of(found.stack, target, model, with_pins=True)
    assert dragged is not None
    stack = dragged.nearest(target, loose, readings).stack
    there = DraggedStack.of(stack, target, model, with_pins=True)
    assert there is not None
    return there.snapped(target).model_copy(update={"start": stack})


def _loose(way: Direction, target: Target) -> list[tuple[int, str]]:
    """Which energies and blurs a way changes."""
    found = []
    for k, (asked, lobe) in enumerate(zip(target.lobes, way.target.lobes)):
        found += [(k, "energy")] if asked.colour != lobe.colour else []
        found += [(k, "blur")] if asked.axes != lobe.axes else []
    return found


def _in_form_of(form: Target, target: Target) -> Target:
    """The lobes of a target, made as those of another one are."""
    for k, made in enumerate(form.lobes):
        target = target.with_lobe(k, interfaces=made.interfaces, base=made.base, fixed=made.fixed)
    return target


def _dragged(found: Solution, target: Target, model: Model) -> DraggedStack | None:
    """A stack that is found, with the form of a target; None where it has an index beyond those of materials."""
    try:
        return DraggedStack.of(found.stack, target, model)
    except InvalidInput:
        return None


def _way(way: Direction, target: Target, near: Target, model: Model) -> Direction:
    """The way to a target near that of another way, in words."""
    words: list[str] = []
    for k, (asked, lobe) in enumerate(zip(target.lobes, near.lobes), 1):
        energies = np.array([asked.colour, lobe.colour]) + ENERGY_MIN
        variances = np.array([MAPS[model.map].variance(np.array(each.axes[:2])) for each in (asked, lobe)]) + SMALL
        of_energy, of_variance = (float(np.abs(np.log(x[1] / x[0])).max()) for x in (energies, variances))
        blur = lobe.axes[:2] if lobe.brushed else lobe.roughness
        words += [f"lobe {k} interfaces {lobe.interfaces}"] if lobe.interfaces != asked.interfaces else []
        words += [f"lobe {k} base {lobe.base}"] if lobe.base != asked.base else []
        if lobe.fixed != asked.fixed:
            pins = [
                key if key == "films" else f"{key} {_listed(entries)}"
                for key, entries in lobe.fixed
                if any(x is not None for x in entries)
            ]
            tinted = k == 1 and asked.fixed == Fixed() and lobe.fixed == Fixed(tau=lobe.fixed.tau)
            given = f"lobe {k} fixed {', '.join(pins)}" if pins else f"lobe {k} nothing fixed"
            words.append("a tinted medium above lobe 1" if tinted else given)
        words += (
            [f"lobe {k} energy {digits(lobe.colour if np.ptp(lobe.colour) else lobe.colour[0])}"]
            if of_energy > SAID
            else []
        )
        turn = f" rotation {lobe.rotation:.4g}" if lobe.brushed else ""
        words += [f"lobe {k} alpha {digits(blur)}{turn}"] if of_variance > SAID else []
    moved = distance(target, near) - distance(target, way.target)
    return Direction(way.what, ", ".join(words), way.change + moved, near)


def _listed(entries: Sequence[float | tuple[float, ...] | None]) -> str:
    """Fixed values of the interfaces of a lobe."""
    return "[" + ", ".join("null" if entry is None else digits(entry) for entry in entries) + "]"


def starts(wish: Target) -> Iterator[Target]:
    """Targets from which a wish is approached: itself, then ones with more blur below, then darker ones."""
    yield wish
    for scale in STARTS:
        start, s = wish, 0.0
        for k, lobe in enumerate(wish.lobes):
            s = max(float(BLUR.variance(lobe.roughness)), WIDER * s)
            grey = k == 0 and lobe.interfaces == 1 and lobe.base == "dielectric"
            energy = (float(np.mean(lobe.colour)),) * 3 if grey else lobe.colour
            start = start.with_lobe(k, energy=tuple(scale * e for e in energy)).with_variance(k, s)
        if distance(wish, start) > SAID:
            yield start


def _as_fixed(target: Target, model: Model) -> Target:
    """The target, with the energy that a fixed index of the first lobe gives by the model, where that is as asked."""
    lobe = target.lobes[0]
    eta = lobe.fixed.of("eta", 0)
    if eta is None or lobe.interfaces > 1 or lobe.base != "dielectric":
        return target
    above, asked = stacks.start(target, model), np.array(lobe.colour)[:, None] + ENERGY_MIN
    variance = lobe.blur(above.f, above.variance)
    own = interface.solve(above, asked, variance, Choice(eta=eta, absorbs=False)).energy
    same = np.abs(np.log(own / asked)).max() < SAME
    return target.with_lobe(0, energy=tuple(np.broadcast_to(own, (3, 1))[:, 0].tolist())) if same else target


def _requested(found: Solution, target: Target, model: Model) -> Solution | Bound:
    """The stack of other requests to the model in closed form whose lobes are nearest to a target; a bound if there is
    none."""
    f, kind, count = MAPS[model.map], target.kind, len(target.lobes)

    def numbers(of: Target) -> Array:
        energies = [max(e, ENERGY_MIN) for lobe in of.lobes for e in lobe.colour]
        return np.concatenate([energies, *(np.ravel(list(vars(lobe.blur(f, kind)).values())) for lobe in of.lobes)])

    def ask(request: Array) -> Solution | None:
        asked, first = target, target.lobes[0].colour
        for k, s in enumerate(request[3 * count :].reshape(count, -1)):
            energy = tuple(np.maximum(request[3 * k : 3 * k + 3], 0).tolist())
            asked = asked.with_lobe(k, energy=energy).with_roughness(k, kind(*s).roughness(f))
        asked = _as_fixed(asked.with_lobe(0, energy=first), found.model) if held else asked
        return in_closed_form(asked, found.model, EFFORT)

    def read(solution: Solution) -> Array:
        return numbers(seen(solution.stack, target, model))

    goal = numbers(target)
    scale = np.r_[np.maximum(goal[: 3 * count], 1e-3), np.abs(goal[3 * count :]) + SMALL]
    held = _as_fixed(target, found.model) is not target
    free = np.arange(len(goal)) >= (3 if held else 0)
    best = surrogate.met(ask, read, goal, goal, scale, free)
    if best is None:
        return Bound(count - 1, "fixed", 1, 0.0)
    reached = seen(best.stack, target, model)
    missed = np.abs(numbers(reached) - goal).max() > MISSED
    return dataclasses.replace(best, target=target, model=model, reached=reached if missed else None)
