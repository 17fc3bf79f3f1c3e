"""Lobes to stacks: any number of lobes, of one to three interfaces each, from the top (Bati et al. 2021, Algorithm 2).

Every lobe has free choices: one of two indices, and the indices between its interfaces. Choices above limit the
possible layers below, so that many partial stacks are followed at once.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from velatura.inverse.lobes import interface, pair
from velatura.inverse.lobes.equivalence import EquivalenceClass, dislike
from velatura.inverse.lobes.interface import DENSER, RARER, Choice
from velatura.inverse.lobes.partial_stack import Above, Array, Batch, Layers, take
from velatura.inverse.lobes.roots import false_position
from velatura.inverse.lobes.target import Target, TargetLobe
from velatura.model import Model
from velatura.model.variance import Variance
from velatura.ops import Value

TRIED = 8192  # stacks with two interfaces of a lobe of three, of all that there are
ALPHA_APART, ENOUGH = 1e-4, 1e-6  # by which a roughness may miss the one that is fixed, and may where that is sought


@dataclass(frozen=True)
class Partial(Batch):
    """N partial stacks: their layers, the state below them, and their costs."""

    above: Above
    layers: tuple[Layers, ...]
    cost: Array

    def take(self, index: np.ndarray) -> Partial:
        """Some of the N."""
        if np.array_equal(index, np.arange(len(self.cost))):
            return self
        above, layers = take((self.above, self.layers), index, len(self.cost))
        return Partial(above, layers, self.cost[index])


#: Partial stacks by the lobes that they have.
Known = dict[tuple[TargetLobe, ...], Partial]


def follow(target: Target, model: Model, spread: int, keep: int, known: Known | None = None) -> Iterator[Partial]:
    """The partial stacks after every lobe; `known`: those of targets that have the first lobes in common."""
    paths, last = beginning(target, model), len(target.lobes) - 1
    for n, lobe in enumerate(target.lobes):
        first = target.lobes[: n + 1]
        if known and first in known:
            paths = known[first]
        else:
            paths = pruned(extended(paths, lobe, target, spread, first=n == 0)[0], lobe.interfaces, keep)
            if known is not None and n < last:
                known[first] = paths
        yield paths


def beginning(target: Target, model: Model) -> Partial:
    """No layer at all."""
    return Partial(start(target, model), (), np.zeros(1))


def pruned(tried: Partial, interfaces: int, keep: int) -> Partial:
    """The feasible ones of the stacks that were just extended, at most as many as are followed."""
    feasible = reduce(np.logical_and, (layers.feasible for layers in tried.layers[-interfaces:]))
    return _thinned(tried.take(np.flatnonzero(np.broadcast_to(feasible, tried.cost.shape))), keep)


def start(target: Target, model: Model) -> Above:
    """Only the exterior medium."""
    return Above.nothing(model, target.exterior, target.kind)


def class_of(above: Above, lobe: TargetLobe, target: Target, first: bool) -> EquivalenceClass:
    """The class of one lobe below given layers."""
    return EquivalenceClass(
        above=above,
        energy=np.array(lobe.colour)[:, None],
        variance=lobe.blur(above.f, above.variance) if lobe.brushed else float(above.f.variance(lobe.roughness)),
        interfaces=lobe.interfaces,
        tau=_pinned(lobe, "tau", 0) if lobe.interfaces == 2 else 0.0,
        choice=_choice(lobe, lobe.interfaces - 1, target, absorbs=True),
        films=lobe.fixed.films_of(0) if lobe.interfaces == 2 else (),
    )


def extended(
    paths: Partial, lobe: TargetLobe, target: Target, spread: int, first: bool, given: Array | None = None
) -> tuple[Partial, np.ndarray]:
    """All partial stacks with all free choices of a lobe, feasible or not, and which of those above each has, (M,);
    `given`: an index between two interfaces for each, (N,)."""
    energy, above = np.array(lobe.colour)[:, None], np.arange(len(paths.cost))
    choice = choice_of(lobe, target, first)

    # Let indices between interfaces run, that of the medium above included, where the upper one vanishes
    for n in range(lobe.interfaces - 1):
        if given is not None:
            paths, energy = with_upper(paths, lobe, n, energy, target, given[None], pinned_above(lobe, n))
            continue
        count = len(paths.cost)
        pinned = lobe.fixed.of("eta", n)
        tried = np.array([pinned]) if pinned is not None else np.geomspace(1, target.eta_max, spread)
        eta = np.tile(tried, count)
        if pinned is None:
            eta = np.r_[eta, np.broadcast_to(paths.above.eta, (1, count))[0]]
        index = np.r_[np.repeat(np.arange(count), len(tried)), np.arange(count)][: len(eta)]
        if pinned is None and lobe.interfaces == 2 and lobe.fixed.of("alpha", 1) is not None:
            index, eta = _of_fixed_roughness(paths, lobe, _variance(paths, lobe), choice, tried)
        if len(index) > TRIED and n:  # below each stack all indices of two interfaces would be too many
            some = np.sort(np.random.default_rng(0).choice(len(index), TRIED, replace=False))
            index, eta = index[some], eta[some]
        left = take(energy, index, count)
        paths, energy = with_upper(paths.take(index), lobe, n, left, target, eta[None], pinned_above(lobe, n))
        above = above[index]
        possible = np.broadcast_to(paths.layers[-1].feasible, paths.cost.shape)
        if possible.any():  # what the others leave takes long to solve for
            kept = np.flatnonzero(possible)
            paths, energy, above = paths.take(kept), take(energy, kept, len(possible)), above[kept]

    # Take either index of the interface that gives what is left
    if choice.kind == "dielectric" and choice.eta is None:
        count = len(paths.cost)
        index = np.tile(np.arange(count), 2)
        paths, energy, above = paths.take(index), take(energy, index, count), above[index]
        choice = dataclasses.replace(choice, side=np.repeat([DENSER, RARER], count))
    return with_last(paths, energy, lobe, choice), above


def with_upper(
    paths: Partial, lobe: TargetLobe, n: int, energy: Array, target: Target, eta: Array, tau: Value
) -> tuple[Partial, Array]:
    """Partial stacks with the n-th interfaces of a lobe, others of which follow, and the energy, (C, N), that these
    leave of one."""
    coated = lobe.fixed.films_of(n)
    upper = pair.top(paths.above, energy, _variance(paths, lobe), eta, tau, target.eta_max, coated=coated)
    return _with(paths, _held(upper.layers, lobe, n), upper.below), energy - upper.energy


def with_last(paths: Partial, energy: Array, lobe: TargetLobe, choice: Choice) -> Partial:
    """Partial stacks with the last interfaces of a lobe, for the energy that is left."""
    last = interface.solve(paths.above, energy, _variance(paths, lobe), choice)
    return _with(paths, _held(last.layers, lobe, lobe.interfaces - 1), last.below)


def _with(paths: Partial, layers: Layers, below: Above) -> Partial:
    return Partial(below, (*paths.layers, layers), paths.cost + dislike(paths.above.eta, layers))


def _variance(paths: Partial, lobe: TargetLobe) -> Variance:
    return lobe.blur(paths.above.f, paths.above.variance)


def _of_fixed_roughness(
    paths: Partial, lobe: TargetLobe, variance: Variance, choice: Choice, tried: Array
) -> tuple[np.ndarray, Array]:
    """Indices between the interfaces for which the lower one is as rough as is fixed, and below which stack."""
    energy, alpha, tau = np.array(lobe.colour)[:, None], lobe.fixed.of("alpha", 1), _pinned(lobe, "tau", 0)
    count = len(paths.cost)

    def apart(index: np.ndarray, eta: Array) -> Array:
        above = take(paths.above, index, count)
        depth, coated = 0.0 if tau is None else tau, lobe.fixed.films_of(0)
        _, lower = pair.solve(above, energy, variance, eta[None], depth, choice, coated=coated)
        return np.broadcast_to(lower.layers.alpha, eta.shape) - alpha

    # Where the roughness passes the fixed one between the indices that are tried, and where it is that one throughout
    index, eta = np.repeat(np.arange(count), len(tried)), np.tile(tried, count)
    miss = apart(index, eta)
    same = np.abs(miss) <= ALPHA_APART
    steps = miss.reshape(count, -1)
    passes = np.flatnonzero(np.pad((steps[:, 1:] < 0) != (steps[:, :-1] < 0), ((0, 0), (0, 1))))
    if not len(passes):
        return index[same], eta[same]
    found = false_position(
        lambda x: apart(index[passes], x), eta[passes], eta[passes + 1], miss[passes], miss[passes + 1], ENOUGH
    )
    return np.r_[index[same], index[passes]], np.r_[eta[same], found]


def is_open(lobe: TargetLobe) -> bool:
    """Whether an index between the interfaces of a lobe is free."""
    return any(lobe.fixed.of("eta", n) is None for n in range(lobe.interfaces - 1))


def pinned_above(lobe: TargetLobe, n: int = 0) -> Value:
    """Optical depths of the medium above an upper interface of a lobe, 0 where they are free."""
    tau = _pinned(lobe, "tau", n)
    return 0.0 if tau is None else tau


def choice_of(lobe: TargetLobe, target: Target, first: bool) -> Choice:
    """The choice of the last interface of a lobe; nothing absorbs above the first interface unless that is fixed."""
    return _choice(lobe, lobe.interfaces - 1, target, absorbs=lobe.interfaces > 1 or not first)


def _choice(lobe: TargetLobe, n: int, target: Target, absorbs: bool) -> Choice:
    return Choice(
        kind=lobe.base,
        eta=_pinned(lobe, "eta", n),
        kappa=_pinned(lobe, "k", n),
        tau=_pinned(lobe, "tau", n),
        tint=lobe.tint,
        absorbs=absorbs,
        eta_max=target.eta_max,
        films=lobe.fixed.films_of(n),
    )


def _pinned(lobe: TargetLobe, key: str, n: int) -> Any:
    """A fixed parameter of an interface as a colour, None where it is free."""
    value = lobe.fixed.of(key, n)
    return value if value is None else np.reshape(np.asarray(value, float), (-1, 1))


def _held(layers: Layers, lobe: TargetLobe, n: int) -> Layers:
    """The interfaces with the constraint that a fixed roughness equals the one that the target needs."""
    alpha = lobe.fixed.of("alpha", n)
    if alpha is None:
        return layers
    apart = np.maximum(*(np.abs(own - alpha) for own in layers.roughness[:2]))
    return layers.with_margins(fixed=interface.margin(ALPHA_APART - apart))


def _thinned(paths: Partial, keep: int) -> Partial:
    """The preferred half of many partial stacks, and others evenly over the rest."""
    count = len(paths.cost)
    if count <= keep:
        return paths
    order = np.argsort(paths.cost, kind="stable")
    rest = np.sort(order[keep // 2 :])
    others = rest[np.linspace(0, len(rest) - 1, keep - keep // 2).astype(int)]
    return paths.take(np.r_[order[: keep // 2], others])
