"""Lobes to stacks: any number of lobes, of one or two interfaces each, from the top (Bati et al. 2021, Algorithm 2).

Every lobe has free choices: one of two indices, and in a pair the index between its interfaces. Choices above limit the
possible layers below, so that many partial stacks are followed at once.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from pathlib import Path
from typing import Any

import numpy as np

from velatura.inverse import interface, pair
from velatura.inverse.equivalence import VANISHED, EquivalenceClass, dislike
from velatura.inverse.interface import DENSER, RARER, Choice
from velatura.inverse.partial_stack import Above, Array, Batch, Layers, take
from velatura.inverse.roots import false_position
from velatura.inverse.target import Target, TargetLobe, read
from velatura.model import DEFAULT, Model, named
from velatura.model.registry import stack_lobes
from velatura.model.variance import ALPHA_MIN, Variance
from velatura.ops import Value
from velatura.stack import Diffuse, MaterialLike, Stack, load

EFFORTS = ((12, 32), (24, 128), (64, 512))  # indices tried between the interfaces of a pair, and partial stacks kept
GRAZING = (0.5, 0.4, 0.3, 0.2, 0.1)  # cosines at which members of a class may differ
NARROWEST = 2 * ALPHA_MIN  # roughness of lobes below a rough interface
DRAWS, ALIKE = 4, 1e-4  # times that alternatives are drawn, and by which their values differ at least
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


@dataclass(frozen=True)
class Solution:
    """A stack with the lobes of a target, and the classes that its parts are chosen from.

    reached: the lobes of the stack, where these miss the target by more than rounding since so much is fixed.
    """

    target: Target
    model: Model
    layers: tuple[Layers, ...]
    reached: Target | None = None

    @cached_property
    def stack(self) -> Stack:
        """The material."""
        axes = [lobe.axes.rotation for lobe in self.target.lobes for _ in range(lobe.interfaces)]
        written = [layer for layers, axis in zip(self.layers, axes) for layer in layers.written(0, axis)]
        return Stack(written, name=self.target.name, exterior=self.target.exterior)

    def alike(self, other: Solution) -> bool:
        """Whether another stack of the same form has almost the same values."""
        pairs = [
            values
            for one, two in zip(self.layers, other.layers)
            for values in (
                (one.eta, two.eta),
                (one.kappa, two.kappa),
                (one.tau, two.tau),
                *zip(one.roughness[:2], two.roughness[:2]),
            )
            if values[0] is not None
        ]
        return all(np.allclose(*values, rtol=ALIKE, atol=ALIKE) for values in pairs)

    @cached_property
    def in_closed_form(self) -> Solution:
        """The same stack, and its lobes as the nearest model in closed form reads them."""
        if exact(self.target, self.model):
            return self
        from velatura.inverse.drag import seen  # which solves with this

        return Solution(
            seen(self.stack, self.target, self.model.surrogate, quick=True), self.model.surrogate, self.layers
        )

    @cached_property
    def classes(self) -> tuple[EquivalenceClass, ...]:
        """The equivalence class of every lobe, below the layers chosen above it, by that model in closed form."""
        target, layers, found = self.in_closed_form.target, iter(self.layers), []
        above = start(target, self.model)
        for n, lobe in enumerate(target.lobes):
            found.append(class_of(above, lobe, target, first=n == 0))
            for _ in range(lobe.interfaces):
                above, _read = above.below(next(layers))
        return tuple(found)


def invert_stack(
    target: Target | Mapping[str, Any] | Sequence[Mapping[str, Any]] | str | Path,
    model: str | Model = DEFAULT,
    **switches: str,
) -> Solution:
    """A stack whose lobes at normal incidence are those of the target.

    Args:
        target: a target, the mapping of a target file, its lobes alone, or a file.
        model: that reads the stack; its `channels` are those of the target, if given there and by no switch.

    Raises:
        InvalidInput: not a target, or an unknown model or switch.
        Infeasible: there is no such stack; the error gives the reason, and the nearest targets that have one.
    """
    wanted = read(target)
    chosen, start = model_of(wanted, model, **switches), wanted.start
    wanted = wanted.model_copy(update={"start": None})
    found = (start and _near(start, wanted, chosen)) or search(wanted, chosen)
    if found is None:
        from velatura.inverse.explain import infeasible

        raise infeasible(wanted, chosen)
    return found


def _near(start: Stack, target: Target, model: Model) -> Solution | None:
    """The stack that a search begins with, or one close to it, where it has the lobes of a target."""
    from velatura.inverse import refined  # which solves with this

    return refined.from_start(start, target, model)


def model_of(target: Target, model: str | Model, **switches: str) -> Model:
    """The model that reads the stacks of a target; a given switch overrides that of the target."""
    return named(model, **({"channels": target.channels} if target.channels else {}) | switches)


def search(target: Target, model: Model, efforts: Sequence[tuple[int, int]] = EFFORTS) -> Solution | None:
    """The preferred stack, of those found at the lowest effort that finds any."""
    if target.brightness > 1:
        return None
    if not exact(target, model):
        from velatura.inverse import refined  # which begins with this

        met = refined.search(target, model)
        smooth = _smoothed(target)
        if met is None and smooth != target:
            near = refined.search(smooth, model)
            return near and dataclasses.replace(near, target=target, reached=smooth)
        return met
    return in_closed_form(target, model, efforts)


def exact(target: Target, model: Model) -> bool:
    """Whether the closed form reads lobes as the model itself does: films it knows roughly."""
    return model.closed_form and not target.has_films


def in_closed_form(target: Target, model: Model, efforts: Sequence[tuple[int, int]] = EFFORTS) -> Solution | None:
    """The preferred stack of a model in closed form, films on it known roughly."""
    if target.brightness > 1:
        return None
    paths = found(target, model, efforts)
    return next(solutions(target, model, paths, [int(np.argmin(paths.cost))]), None) if paths else None


def _smoothed(target: Target) -> Target:
    """The target, smooth where a lobe is narrower than what is evaluated of rough interfaces."""
    for n, lobe in enumerate(target.lobes):
        if 0 < max(lobe.axes[:2]) < NARROWEST:
            target = target.with_lobe(n, alpha=0.0, variance=None)
    return target


def found(target: Target, model: Model, efforts: Sequence[tuple[int, int]] = EFFORTS) -> Partial | None:
    """The stacks of a model in closed form that are found at the lowest effort that finds any.

    If all efforts find none, or only stacks with an interface that vanishes, the indices between theirs are tried.
    """
    paths = None
    for spread, keep in efforts:
        for paths in follow(target, model, spread, keep):
            if not len(paths.cost):
                break
        if paths is not None and len(paths.cost):
            break
        if not any(is_open(lobe) for lobe in target.lobes):
            return None
    some = paths if paths is not None and len(paths.cost) else None
    if len(efforts) == len(EFFORTS) and (some is None or some.cost.min() >= VANISHED):
        from velatura.inverse import sampling  # which is made of the steps here

        return sampling.closer(target, model, some)
    return some


def solutions(target: Target, model: Model, paths: Partial, which: Iterable[int]) -> Iterator[Solution]:
    """Some of the stacks of a target."""
    return (Solution(target, model, paths.take(np.array([n])).layers) for n in which)


def alternatives(
    target: Target | Mapping[str, Any] | Sequence[Mapping[str, Any]] | str | Path,
    count: int,
    model: str | Model = DEFAULT,
    seed: int = 0,
    **switches: str,
) -> list[Solution]:
    """Stacks that all have the lobes of a target: the one of `invert_stack`, then others drawn at random.

    They are drawn over all free coordinates of all lobes: indices, optical depths and tints. So a medium may absorb
    above the whole stack, where `invert_stack` has one only if it is fixed.

    Fewer than `count` where the target leaves nothing open.

    Raises:
        InvalidInput, Infeasible: as `invert_stack`.
    """
    from velatura.inverse import sampling

    first = invert_stack(target, model, **switches)
    rng, found = np.random.default_rng(seed), [first]
    near = first.in_closed_form
    for _ in range(DRAWS):
        paths, known = sampling.drawn(near, rng), len(found)
        for drawn in solutions(near.target, near.model, paths, range(min(len(paths.cost), 2 * count))):
            if len(found) == count:
                return found
            other = _met(drawn, first)
            if other is not None and not any(other.alike(each) for each in found):
                found.append(other)
        if len(found) == known:  # too much is fixed for another one
            break
    return found


def _met(drawn: Solution, first: Solution) -> Solution | None:
    """What is drawn, moved to where the model of the first stack reads its lobes; None if there is no such stack."""
    if exact(first.target, first.model):
        return drawn
    from velatura.inverse import refined

    met = refined.moved(drawn, first.reached or first.target, first.model)
    if not isinstance(met, Solution) or met.reached:
        return None
    return dataclasses.replace(met, target=first.target, reached=first.reached)


def on_black(stack: MaterialLike) -> Stack:
    """A stack that ends in a dielectric, on a base that absorbs what it transmits: it shows by reflection alone.

    Raises:
        InvalidInput: not a valid material (a stack, a file, or a preset's name).
    """
    stack = load(stack)
    return Stack([*stack.layers, Diffuse(albedo=0.0)], exterior=stack.exterior) if stack.transmits else stack


def grazing(stack: MaterialLike, model: str | Model = DEFAULT) -> Array:
    """Energy of all lobes together at the cosines of GRAZING, (3, len(GRAZING)).

    Raises:
        InvalidInput: not a valid material (a stack, a file, or a preset's name), an unknown model, a texture.
    """
    return np.sum(stack_lobes(load(stack), GRAZING, model=model).energy, axis=0)


def follow(target: Target, model: Model, spread: int, keep: int) -> Iterator[Partial]:
    """The partial stacks after every lobe."""
    paths = beginning(target, model)
    for n, lobe in enumerate(target.lobes):
        paths = pruned(extended(paths, lobe, target, spread, first=n == 0), lobe.interfaces, keep)
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
) -> Partial:
    """All partial stacks with all free choices of a lobe, feasible or not; `given`: an index between its interfaces for
    each, (N,)."""
    energy = np.array(lobe.colour)[:, None]
    choice = choice_of(lobe, target, first)

    # Let the index between two interfaces run, that of the medium above included, where the upper one vanishes
    if lobe.interfaces == 2 and given is not None:
        paths, energy = with_upper(paths, lobe, target, given[None], pinned_above(lobe))
    elif lobe.interfaces == 2:
        count = len(paths.cost)
        pinned = lobe.fixed.of("eta", 0)
        tried = np.array([pinned]) if pinned is not None else np.geomspace(1, target.eta_max, spread)
        eta = np.tile(tried, count)
        if pinned is None:
            eta = np.r_[eta, np.broadcast_to(paths.above.eta, (1, count))[0]]
        index = np.r_[np.repeat(np.arange(count), len(tried)), np.arange(count)][: len(eta)]
        if pinned is None and lobe.fixed.of("alpha", 1) is not None:
            index, eta = _of_fixed_roughness(paths, lobe, _variance(paths, lobe), choice, tried)
        paths, energy = with_upper(paths.take(index), lobe, target, eta[None], pinned_above(lobe))
        possible = np.broadcast_to(paths.layers[-1].feasible, paths.cost.shape)
        if possible.any():  # what the others leave takes long to solve for
            kept = np.flatnonzero(possible)
            paths, energy = paths.take(kept), take(energy, kept, len(possible))

    # Take either index of the interface that gives what is left
    if choice.kind == "dielectric" and choice.eta is None:
        count = len(paths.cost)
        index = np.tile(np.arange(count), 2)
        paths, energy = paths.take(index), take(energy, index, count)
        choice = dataclasses.replace(choice, side=np.repeat([DENSER, RARER], count))
    return with_last(paths, energy, lobe, choice)


def with_upper(paths: Partial, lobe: TargetLobe, target: Target, eta: Array, tau: Value) -> tuple[Partial, Array]:
    """Partial stacks with the upper interfaces of a pair, and the energy that these leave, (C, N)."""
    energy = np.array(lobe.colour)[:, None]
    coated = lobe.fixed.films_of(0)
    upper = pair.top(paths.above, energy, _variance(paths, lobe), eta, tau, target.eta_max, coated=coated)
    return _with(paths, _held(upper.layers, lobe, 0), upper.below), energy - upper.energy


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
    """Whether the index between the interfaces of a lobe is free."""
    return lobe.interfaces == 2 and lobe.fixed.of("eta", 0) is None


def pinned_above(lobe: TargetLobe) -> Value:
    """Optical depths of the medium above a pair, 0 where they are free."""
    tau = _pinned(lobe, "tau", 0)
    return 0.0 if tau is None else tau


def choice_of(lobe: TargetLobe, target: Target, first: bool) -> Choice:
    """The choice of the last interface of a lobe; nothing absorbs above the first interface unless that is fixed."""
    return _choice(lobe, lobe.interfaces - 1, target, absorbs=lobe.interfaces == 2 or not first)


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
    """With the constraint that a fixed roughness equals the one that the target needs."""
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
