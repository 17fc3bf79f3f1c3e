"""Stacks at random: closer to where a target has some than a grid of indices is, and over all free coordinates."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from itertools import islice

import numpy as np

from velatura.inverse.lobes import interface, stacks
from velatura.inverse.lobes.equivalence import VANISHED, metal_depths, random_depths
from velatura.inverse.lobes.interface import DENSER, RARER, Choice
from velatura.inverse.lobes.partial_stack import Array, Layers, join, take
from velatura.inverse.lobes.stacks import Partial
from velatura.inverse.lobes.target import Target, TargetLobe
from velatura.model import Model
from velatura.ops import Value

PLANS, ELITES, ROUNDS = 96, 12, 16  # of indices, those that have offspring, and generations of these
WIDEST, SHRINKS = 0.4, 0.5  # share of the range of indices that the first of them spread over, and of that the next
SETTLED = 3  # generations with a stack
STALE, NEARER = 6, 0.99  # generations that end the search, unless what is missing is this share of it, or less
DRAWN, KEPT = 1024, 256  # partial stacks that are tried and followed, to be drawn from
DRAWN_COATED = 64  # of those with films, each of which takes longer
SELDOM = 1e-9  # weight of an interface that vanishes
NARROWEST = 1e-4  # share of a range within which others near a known stack are tried


# Where a grid steps over what there is -------------------------------------------------------------------------------


def closer(target: Target, model: Model, found: Partial | None) -> Partial | None:
    """Stacks of a target where a grid of indices between the interfaces of pairs finds none, or none to be preferred.

    Generations of indices about those that come nearest to the bounds, or that are preferred, ever closer. The stacks
    that are found already stay. None where there are none.
    """
    open_ = [n for n, lobe in enumerate(target.lobes) if lobe.interfaces == 2 and stacks.is_open(lobe)]
    if not open_ or any(target.lobes[n].fixed.of("alpha", 1) is not None for n in open_):
        return found
    rng, top = np.random.default_rng(0), float(np.log(target.eta_max))
    if found:
        known = _indices(found.take(np.argsort(found.cost)[:ELITES]), target, open_)
        spread = WIDEST * top * rng.normal(0, 1, (len(open_), PLANS)) * NARROWEST ** rng.random(PLANS)
        y = np.c_[known, np.clip(np.resize(known, (len(open_), PLANS)) + spread, 0, top)]
    else:
        inside = _of_first(target, model, open_[0])
        if inside is None:
            return None
        y = rng.uniform(0, top, (len(open_), len(inside)))
        y[0] = np.log(inside)
    parts, settled, missing = [found] if found else [], 0, list[float]()
    for n in range(ROUNDS):
        paths, origin, score = _along(target, model, dict(zip(open_, np.exp(y))))
        cost = np.full(y.shape[1], np.inf)
        np.minimum.at(cost, origin, paths.cost)
        if len(paths.cost):
            parts.append(paths.take(np.argsort(paths.cost)[:ELITES]))
            settled += 1
        missing.append(len(target.lobes) - float(score.max()))
        if settled > SETTLED or (not parts and n >= STALE and missing[n] > NEARER * missing[n - STALE]):
            break
        scale = WIDEST * SHRINKS**n * top
        best = _apart(y, np.lexsort((cost, -score)), scale / 2)
        spread = rng.normal(0, scale, (len(open_), PLANS))
        y = np.c_[y[:, best], np.clip(np.resize(y[:, best], (len(open_), PLANS)) + spread, 0, top)]
    return join(parts, [len(part.cost) for part in parts]) if parts else None


def _of_first(target: Target, model: Model, first: int) -> Array | None:
    """Indices between the interfaces of the first pair, (N,), each for a stack above it; None if there are none."""
    spans, lobe = [], target.lobes[first]
    paths = [stacks.beginning(target, model), *islice(stacks.follow(target, model, 1, ELITES), first)][-1]
    for n in range(len(paths.cost)):
        above = take(paths.above, np.array([n]), len(paths.cost))
        spans += stacks.class_of(above, lobe, target, first == 0).indices_1()
    return np.concatenate([np.geomspace(*span, -(-PLANS // len(spans))) for span in spans]) if spans else None


def _apart(y: Array, order: np.ndarray, distance: float) -> np.ndarray:
    """The first of an order that are not near to one another, at most as many as have offspring."""
    chosen: list[int] = []
    for n in order:
        if all(np.max(np.abs(y[:, n] - y[:, other])) > distance for other in chosen):
            chosen.append(int(n))
        if len(chosen) == ELITES:
            break
    return np.array(chosen)


def _along(target: Target, model: Model, indices: Mapping[int, Array]) -> tuple[Partial, np.ndarray, Array]:
    """The stacks with given indices, (N,) by lobe, which of the N each has, and how near each of the N comes, (N,).

    Other pairs have a fixed index, and lobes of three interfaces few. The last is the number of lobes that it has, and
    less than 1 for the margin that the next one misses.
    """
    paths = stacks.beginning(target, model)
    count = len(next(iter(indices.values())))
    origin, score = np.arange(count), np.full(count, -1.0)
    paths = paths.take(np.zeros(count, int))
    for n, lobe in enumerate(target.lobes):
        given = indices[n][origin] if n in indices else None
        if lobe.interfaces == 2 and given is None:
            given = np.full(len(origin), lobe.fixed.of("eta", 0))
        paths, above = stacks.extended(paths, lobe, target, 1, n == 0, given)
        origin = origin[above]
        margins = [margin for part in paths.layers[-lobe.interfaces :] for margin in part.margins.values()]
        margin = np.nan_to_num(np.min(np.broadcast_arrays(paths.cost * np.inf, *margins), axis=0), nan=-np.inf)
        margin = np.maximum(margin, -1e9)
        ok = margin >= 0
        np.maximum.at(score, origin, n + 1 + np.where(ok, 0.0, margin / (1 - margin)))
        paths, origin = paths.take(np.flatnonzero(ok)), origin[ok]
        if not len(origin):
            break
    return paths, origin, score


def _indices(paths: Partial, target: Target, which: list[int]) -> Array:
    """Logarithms of the indices between the interfaces of some lobes, (which, N)."""
    first = np.cumsum([0, *(lobe.interfaces for lobe in target.lobes)])
    eta = [np.broadcast_to(paths.layers[first[n]].eta, (1, len(paths.cost)))[0] for n in which]
    return np.log(np.array(eta))


# Over all free coordinates -------------------------------------------------------------------------------------------


def drawn(target: Target, model: Model, known: Sequence[Layers], rng: np.random.Generator) -> Partial:
    """Stacks with the lobes of a known one, by a model in closed form, drawn over all that its target leaves free.

    They are drawn anywhere, and near the known one in case that there is none elsewhere; the former come first. Their
    costs are weights: shares of the ranges of coordinates that they are drawn from.
    """
    layers = iter(known)
    paths = dataclasses.replace(stacks.beginning(target, model), cost=np.ones(1))
    count = DRAWN_COATED if target.has_films else DRAWN
    for n, lobe in enumerate(target.lobes):
        own = [next(layers) for _ in range(lobe.interfaces)]
        paths = paths.take(rng.integers(len(paths.cost), size=count))
        share = np.where(rng.random(count) < 0.5, 1.0, NARROWEST ** rng.random(count))
        tried = _redrawn(paths, lobe, target, n == 0, own, share, rng)
        weight = paths.cost * share * np.where(tried.cost - paths.cost >= VANISHED, SELDOM, 1.0)
        paths = stacks.pruned(dataclasses.replace(tried, cost=weight), lobe.interfaces, count)
        # A race that each wins with a probability in proportion to its share
        paths = paths.take(np.argsort(rng.exponential(1 / paths.cost))[:KEPT])
        if not len(paths.cost):
            break
    return paths


def _redrawn(
    paths: Partial,
    lobe: TargetLobe,
    target: Target,
    first: bool,
    known: list[Layers],
    share: Array,
    rng: np.random.Generator,
) -> Partial:
    """Partial stacks with a lobe whose free coordinates are drawn from shares of their ranges, feasible or not."""
    count, energy = len(paths.cost), np.array(lobe.colour)[:, None]
    for n in range(lobe.interfaces - 1):
        tau: Value = stacks.pinned_above(lobe, n)
        if lobe.fixed.of("tau", n) is None and n == 0:
            state = paths.above.state
            most = 0.5 * np.log(np.maximum(state.t_0i * state.t_i0 / np.maximum(energy, interface.ENERGY_MIN), 1.0))
            tau = share * random_depths(np.broadcast_to(most, (3, count)), rng)
        eta = np.broadcast_to(known[n].eta, (1, count))
        if lobe.fixed.of("eta", n) is None and lobe.fixed.of("alpha", lobe.interfaces - 1) is None:
            top = np.log(target.eta_max)
            near = np.clip(np.log(eta) + share * top * rng.uniform(-1, 1, count), 0, top)
            eta = np.exp(np.where(share < 1, near, top * rng.random(count)))
        paths, energy = stacks.with_upper(paths, lobe, n, energy, target, eta, tau)
    choice = stacks.choice_of(lobe, target, first)
    side = np.where(rng.random(count) < 0.5, DENSER, RARER)
    choice = dataclasses.replace(choice, side=side, tint=rng.random(count))
    least = stacks.with_last(paths, energy, lobe, choice)
    return stacks.with_last(paths, energy, lobe, _more(choice, lobe, paths, least.layers[-1], target, share, rng))


def _more(
    choice: Choice,
    lobe: TargetLobe,
    paths: Partial,
    least: Layers,
    target: Target,
    share: Array,
    rng: np.random.Generator,
) -> Choice:
    """The choice of last interfaces below media that absorb more than the least, drawn at random."""
    count = len(paths.cost)
    if choice.tau is not None or choice.kind == "mirror":
        return choice
    if choice.kind == "dielectric":
        if choice.eta is not None:
            return choice
        # Beyond the index that needs least absorption, as far as the bound
        bound = np.where(np.asarray(choice.side) > 0, target.eta_max, 1.0)
        beyond = share * rng.random(count) * (rng.random(count) < 0.75)
        return dataclasses.replace(choice, eta=least.eta * (bound / least.eta) ** beyond, absorbs=True)
    if choice.eta is not None and choice.kappa is not None:
        return choice
    energy = np.array(lobe.colour)[:, None]
    reflected = paths.above.reflectance(least) * np.exp(-2 * np.asarray(least.tau))
    low, high = metal_depths(paths.above, reflected, least.roughness, choice, (len(energy), count))
    return dataclasses.replace(choice, tau=low + share * random_depths(high - low, rng))
