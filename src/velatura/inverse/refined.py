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
from velatura.inverse import interface, requests, stacks
from velatura.inverse.drag import Bound, DraggedStack, pinned, plain, seen
from velatura.inverse.explain import LEAST, Direction, digits, distance, freed
from velatura.inverse.interface import ENERGY_MIN, Choice
from velatura.inverse.partial_stack import Array
from velatura.inverse.stacks import Solution
from velatura.inverse.target import BLUR, Target
from velatura.model import Model
from velatura.model.roughness_maps import MAPS
from velatura.stack import Stack

GREY = Bound(0, "colour", 1, 0.0)  # one index for all channels
EFFORT = stacks.EFFORTS[:1]  # to find a stack near which the model is met
STARTS, WIDER = (1.0, 0.7, 0.4, 0.15), 2.5  # energies, and variances of a lobe below another, that a wish starts from
FURTHER = (0.1, 0.0)  # beyond what a closed form can reach, as shares of the way there
SAID = 1e-3  # changes of quantities that are mentioned, as logarithms
TRIES = 4  # stacks that are begun with, of all that are found
SAME = 0.03  # logarithm by which models differ about the energy of an index
MISSED = 1e-4  # energy or variance that is mentioned
SMALL = 0.01  # variance that is added to that of a goal, for units in which it is missed


def search(target: Target, model: Model) -> Solution | None:
    """The preferred stack of the model in closed form, moved to one whose lobes, read by the model, are the target."""
    candidates = itertools.islice(_candidates(target, model.adder, stacks.EFFORTS), TRIES)
    moves = (moved(found, target, model, giving=n == 0) for n, found in enumerate(candidates))
    return next((met for met in moves if isinstance(met, Solution)), None)


def _candidates(target: Target, model: Model, efforts: Sequence[tuple[int, int]]) -> Iterator[Solution]:
    """Stacks with the lobes of a target, or of one from which it is approached: preferred ones, then ones from all
    over."""
    for n, start in enumerate(starts(target)):
        paths = stacks.found(_as_fixed(start, model), model, EFFORT if n else efforts)
        if paths:
            order = np.argsort(paths.cost, kind="stable")
            some = np.unique(np.linspace(0, len(order) - 1, TRIES - 1, dtype=int))
            yield from stacks.solutions(start, model, paths, order[some].tolist())


def moved(found: Solution, target: Target, model: Model, giving: bool = True) -> Solution | Bound:
    """A stack near one that is found, with the lobes of a target; the bound that is in the way if there is none.

    giving: whether kept coordinates may change at bounds, which takes longer.
    """
    if any(pinned(lobe, first=n == 0) for n, lobe in enumerate(target.lobes)):
        return _requested(found, target, model)
    dragged = _dragged(found, target, model)
    if dragged is None or dragged.achromatic(target) is not target:
        return GREY
    there = dragged.met(target, giving)
    if isinstance(there, Bound):
        return there
    missed = there.missed(target) > MISSED
    return Solution(target, model, tuple(there.point.layers), there.now(target) if missed else None)


def obstacle(target: Target, model: Model) -> Bound | None:
    """What keeps the model from lobes that the nearest one in closed form has a stack for; None if it has none."""
    found = stacks.search(target, model.adder, EFFORT)
    if found is None:
        return None
    there = moved(found, target, model)
    return there if isinstance(there, Bound) else GREY


def ways(offered: Sequence[Direction], target: Target, model: Model) -> list[Direction]:
    """Ways out by the model in closed form that the model itself has a stack for; where it has none for any, the first
    lobes that it reads of the stacks of these, and finds again. Of several lobes, which take longer, one way."""
    met = list[Direction]()
    for way in offered:
        if _is_met(way.target, model):
            met.append(way)
        elif not met and (near := _near(target, way.target, model)) is not None:
            met.append(_way(way, target, near, model))
        if met and len(target.lobes) > 1:
            break
    return sorted(met, key=lambda way: way.change)


def _is_met(target: Target, model: Model) -> bool:
    """Whether the first stack that is found leads to one of the model."""
    found = next(_candidates(target, model.adder, EFFORT), None)
    return found is not None and isinstance(moved(found, target, model, giving=False), Solution)


def _near(target: Target, way: Target, model: Model) -> Target | None:
    """Lobes that the model reads of a stack with those of a way, or of a target just beyond, and finds again: where it
    must, with the indices between interfaces of that stack, and nothing else fixed."""
    asked = (_beyond(target, way, share) for share in FURTHER)
    found = next(filter(None, (stacks.search(each, model.adder, EFFORT) for each in asked)), None)
    if found is None:
        return None
    near = seen(found.stack, way, model)
    kept = (near, _with_indices(near, found.stack), _with_indices(freed(near), found.stack))
    return next((each for n, each in enumerate(kept) if each not in kept[:n] and _is_met(each, model)), None)


def _with_indices(target: Target, stack: Stack) -> Target:
    """A target whose pairs keep the indices between their interfaces that a stack has."""
    first = 0
    for k, lobe in enumerate(target.lobes):
        if stacks.is_open(lobe):
            eta = float(np.mean(plain(stack)[first].eta)), lobe.fixed.of("eta", 1)
            target = target.with_lobe(k, fixed=lobe.fixed.model_copy(update={"eta": eta}))
        first += lobe.interfaces
    return target


def _beyond(target: Target, way: Target, share: float) -> Target:
    """A target beyond another one, as seen from a first one: by a share of how their energies and variances differ."""
    found = way
    for k, (asked, lobe) in enumerate(zip(target.lobes, way.lobes)):
        one, two = (np.log(np.maximum(each.colour, LEAST)) for each in (asked, lobe))
        if np.any(one != two):
            step = two - one if np.ptp(two) else np.mean(two - one)
            found = found.with_lobe(k, energy=tuple(np.exp(two + share * step).tolist()))
        a, b = (max(float(BLUR.variance(each.roughness)), LEAST) for each in (asked, lobe))
        if a != b:
            found = found.with_variance(k, min(b * (b / a) ** share, float(BLUR.variance(1.0))))
    return found


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
            pins = [f"{key} {_listed(entries)}" for key, entries in lobe.fixed if any(x is not None for x in entries)]
            words.append(f"lobe {k} fixed {', '.join(pins)}" if pins else f"lobe {k} nothing fixed")
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
        return stacks.search(asked, found.model, EFFORT)

    def read(solution: Solution) -> Array:
        return numbers(seen(solution.stack, target, model))

    goal = numbers(target)
    scale = np.r_[np.maximum(goal[: 3 * count], 1e-3), np.abs(goal[3 * count :]) + SMALL]
    held = _as_fixed(target, found.model) is not target
    free = np.arange(len(goal)) >= (3 if held else 0)
    best = requests.met(ask, read, goal, goal, scale, free)
    if best is None:
        return Bound(count - 1, "fixed", 1, 0.0)
    reached = seen(best.stack, target, model)
    missed = np.abs(numbers(reached) - goal).max() > MISSED
    return dataclasses.replace(best, target=target, model=model, reached=reached if missed else None)
