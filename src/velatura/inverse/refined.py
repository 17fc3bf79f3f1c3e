"""Stacks for a model that has no closed form, and is slow: `velatura`.

The nearest model in closed form finds a stack; then few calls of the model itself, by Broyden's method, meet the
target. They move the coordinates of a drag, within their bounds. Where more is fixed than those can keep, the model in
closed form is asked for other lobes, until the model itself reads those that are wanted.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator

import numpy as np

from velatura.errors import InvalidInput
from velatura.inverse import interface, requests, stacks
from velatura.inverse.drag import Bound, DraggedStack, pinned, seen
from velatura.inverse.explain import TOO_MUCH, Direction, Infeasible, digits, infeasible
from velatura.inverse.interface import ENERGY_MIN, Choice
from velatura.inverse.partial_stack import Array
from velatura.inverse.stacks import Solution
from velatura.inverse.target import BLUR, Target
from velatura.model import Model
from velatura.model.roughness_maps import MAPS

GREY = Bound(0, "colour", 1, 0.0)  # one index for all channels
EFFORT = stacks.EFFORTS[:1]  # to find a stack near which the model is met
STARTS, WIDER = (1.0, 0.7, 0.4, 0.15), 2.5  # energies, and variances of a lobe below another, that a wish starts from
INSIDE = (0.99, 0.9)  # shares of the way to a bound, of which the first that has a stack again is offered
SAID = 1e-3  # changes of quantities that are mentioned, as logarithms
TRIES = 4  # stacks that are begun with, of all that are found
SAME = 0.03  # logarithm by which models differ about the energy of an index
MISSED = 1e-4  # energy or variance that is mentioned
SMALL = 0.01  # variance that is added to that of a goal, for units in which it is missed


def search(target: Target, model: Model) -> Solution | None:
    """The preferred stack of the model in closed form, moved to one whose lobes, read by the model, are the target."""
    candidates = itertools.islice(_candidates(target, model.adder), TRIES)
    moves = (moved(found, target, model, giving=n == 0) for n, found in enumerate(candidates))
    return next((met for met in moves if isinstance(met, Solution)), None)


def _candidates(target: Target, model: Model) -> Iterator[Solution]:
    """Stacks with the lobes of a target, or of one from which it is approached: preferred ones, then ones from all
    over."""
    for n, start in enumerate(starts(target)):
        paths = stacks.found(_as_fixed(start, model), model, EFFORT if n else stacks.EFFORTS)
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


def refused(target: Target, model: Model) -> Infeasible:
    """The error for a target without a stack, with the nearest target on the way from what is found; where nothing is,
    with those of the nearest model in closed form."""
    total = float(np.sum([lobe.colour for lobe in target.lobes], axis=0).max())
    dragged = next(filter(None, (_dragged(found, target, model) for found in _candidates(target, model.adder))), None)
    if dragged is None:
        error = infeasible(target, model.adder)
        nearest = sorted(error.directions, key=lambda way: way.change)[:TRIES]
        ways = [way for way in nearest if search(way.target, model) is not None]
        return Infeasible(error.why, error.lobe, error.constraint, ways)
    possible = dragged.achromatic(target)
    there, bound = dragged.towards(possible)
    inside = (dragged.between(there.target, share) for share in INSIDE)
    near = next((near for near in inside if search(near, model) is not None), None)
    ways = [_way(target, near, model)] if near else []
    if total > 1:
        return Infeasible(TOO_MUCH.format(total=total), 0, "sum", ways)
    if possible is not target or bound is None:
        bound = GREY
    return Infeasible(bound.why(target), bound.lobe + 1, bound.reason, ways)


def _dragged(found: Solution, target: Target, model: Model) -> DraggedStack | None:
    """A stack that is found, with the form of a target; None where it has an index beyond those of materials."""
    try:
        return DraggedStack.of(found.stack, target, model)
    except InvalidInput:
        return None


def _way(target: Target, near: Target, model: Model) -> Direction:
    """A nearest target, in words."""
    words, changes = [], [0.0]
    for k, (asked, lobe) in enumerate(zip(target.lobes, near.lobes), 1):
        energies = np.array([asked.colour, lobe.colour]) + ENERGY_MIN
        variances = np.array([MAPS[model.map].variance(np.array(each.axes[:2])) for each in (asked, lobe)]) + SMALL
        of_energy, of_variance = (float(np.abs(np.log(x[1] / x[0])).max()) for x in (energies, variances))
        blur = lobe.axes[:2] if lobe.brushed else lobe.roughness
        words += [f"lobe {k} energy {digits(lobe.colour)}"] if of_energy > SAID else []
        turn = f" rotation {lobe.rotation:.4g}" if lobe.brushed else ""
        words += [f"lobe {k} alpha {digits(blur)}{turn}"] if of_variance > SAID else []
        changes += [of_energy, of_variance]
    return Direction("all lobes", ", ".join(words), max(changes), near)


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
