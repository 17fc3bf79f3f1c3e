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

from velatura.inverse import requests, stacks
from velatura.inverse.drag import Bound, DraggedStack, seen
from velatura.inverse.interface import ENERGY_MIN
from velatura.inverse.partial_stack import Array
from velatura.inverse.stacks import Solution
from velatura.inverse.target import BLUR, Target
from velatura.model import Model
from velatura.model.roughness_maps import MAPS

EFFORT = stacks.EFFORTS[:1]  # to find a stack near which the model is met
STARTS, WIDER = (1.0, 0.7, 0.4, 0.15), 2.5  # energies, and variances of a lobe below another, that a wish starts from
TRIES = 4  # stacks that are begun with, of all that are found
SMALL = 0.01  # variance that is added to that of a goal, for units in which it is missed


def search(target: Target, model: Model) -> Solution | None:
    """The preferred stack of the model in closed form, moved to one whose lobes, read by the model, are the target."""
    moves = (moved(found, target, model) for found in itertools.islice(_candidates(target, model.adder), TRIES))
    return next((met for met in moves if isinstance(met, Solution)), None)


def _candidates(target: Target, model: Model) -> Iterator[Solution]:
    """Stacks with the lobes of a target, or of one from which it is approached: preferred ones, then ones from all
    over."""
    for start in starts(target):
        paths = stacks.found(start, model, stacks.EFFORTS if start is target else EFFORT)
        if paths:
            order = np.argsort(paths.cost, kind="stable")
            some = np.unique(np.linspace(0, len(order) - 1, TRIES - 1, dtype=int))
            yield from stacks.solutions(start, model, paths, order[some].tolist())


def moved(found: Solution, target: Target, model: Model) -> Solution | Bound:
    """A stack near one that is found, with the lobes of a target; the bound that is in the way if there is none."""
    dragged = DraggedStack.of(found.stack, target, model)
    if dragged is None:
        return _requested(found, target, model)
    there = dragged.met(target)
    return there if isinstance(there, Bound) else Solution(target, model, tuple(there.point.layers))


def starts(wish: Target) -> Iterator[Target]:
    """Targets from which a wish is approached: itself, then ones with more blur below, then darker ones."""
    yield wish
    for scale in STARTS:
        start, s = wish, 0.0
        for k, lobe in enumerate(wish.lobes):
            s = max(float(BLUR.variance(lobe.roughness)), WIDER * s)
            grey = k == 0 and lobe.interfaces == 1 and lobe.base == "dielectric"
            energy = (float(np.mean(lobe.colour)),) * 3 if grey else lobe.colour
            start = start.with_lobe(k, energy=tuple(scale * e for e in energy), alpha=None, variance=s)
        yield start


def _requested(found: Solution, target: Target, model: Model) -> Solution:
    """The stack of other requests of the model in closed form, whose lobes are nearest to a target."""
    f, count = MAPS[model.map], len(target.lobes)

    def numbers(of: Target) -> Array:
        energies = [max(e, ENERGY_MIN) for lobe in of.lobes for e in lobe.colour]
        return np.array([*energies, *(float(f.variance(lobe.roughness)) for lobe in of.lobes)])

    def ask(request: Array) -> Solution | None:
        asked = target
        for k, s in enumerate(np.maximum(request[3 * count :], 0)):
            energy = tuple(np.maximum(request[3 * k : 3 * k + 3], 0).tolist())
            asked = asked.with_lobe(k, energy=energy, alpha=float(f.roughness(s)), variance=None)
        return stacks.search(asked, found.model, EFFORT)

    def read(solution: Solution) -> Array:
        return numbers(seen(solution.stack, target, model))

    goal = numbers(target)
    best = requests.met(ask, read, goal, goal, np.r_[np.maximum(goal[: 3 * count], 1e-3), goal[3 * count :] + SMALL])
    return dataclasses.replace(best or found, target=target, model=model)
