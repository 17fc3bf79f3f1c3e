"""The answer to a wish of any kind: the stack that is asked for, or the nearest one.

Lobes come first: those that are asked for, and where the appearance at a second angle is, those of the present
material, of which a lobe that is asked for there gives way in what is asked. Of the stacks that have them the answer is
the nearest to all other wishes, by the CIE 1976 difference of colours and by roughness. Values that no wish is about
stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from velatura.errors import InvalidInput, whole_number
from velatura.inverse.fitting.free_values import Free, FreeValues
from velatura.inverse.fitting.simplify import first_stacks, with_media
from velatura.inverse.invert import alternatives, invert_stack, model_of
from velatura.inverse.lobes.partial_stack import Array, written
from velatura.inverse.lobes.target import Target, TargetLike, TargetLobe, read
from velatura.inverse.local.approach import Secants
from velatura.inverse.reasons import Direction, Infeasible
from velatura.inverse.wishes import KINDS
from velatura.inverse.wishes.available import filled, laid, made_of
from velatura.inverse.wishes.mixture import weighed
from velatura.inverse.wishes.wish import compared
from velatura.model import DEFAULT, Model
from velatura.model.lobe_statistics import StackLobes
from velatura.model.registry import stack_lobes
from velatura.model.roughness_maps import MAPS
from velatura.model.variance import Covariance, Roughness
from velatura.stack import Interface, Material, Medium, MediumValues, Mix, Stack
from velatura.stack.io import Loaded
from velatura.stack.layers import COEFFICIENTS

FIRST = 30.0  # weight of lobes beside other wishes
WIDTHS, BLURRED = 0.2, 0.02  # weight of variances, relative to themselves and this
STRIDE = 1e-4  # of coordinates, for slopes
ENOUGH = 2e-5  # of what is missed, where a search ends
MISSED = 5e-3  # of what is missed that is worth a word: half a unit of CIE 1976, or .001 of a roughness
DRAWN, TRIED = 40, 3  # stacks with the lobes that are looked at, and that searches begin with
INDEX, ABSORPTION = {"eta", "k"}, {"sigma", "depth"}  # keys that stay where substances are given, or optical depths
SAME = 1e-3  # relative difference of values that are one answer

#: What may change of lobes at normal incidence: the place of each, and "energy" or "alpha".
Loose: TypeAlias = frozenset[tuple[int, str]]


@dataclass(frozen=True)
class _Effort:
    """Effort of a search: how many times slopes are differences, readings beside these, and halvings of the line."""

    slopes: int
    readings: int
    halvings: int


QUICK, THOROUGH = _Effort(1, 8, 2), _Effort(2, 20, 5)  # under the hand, and at rest


@dataclass(frozen=True)
class Answer:
    """A stack, and how near it comes to a wish; of a wish for a mixture that is the `stack`.

    missed: the distance, in hundreds of CIE 1976 and five times a roughness; of lobes thirty times as much.
    """

    stack: Loaded
    target: Target
    model: Model
    missed: float

    @cached_property
    def reached(self) -> Target:
        """The wish, with what the stack has of what is asked for."""
        if isinstance(self.stack, Mix):
            has = tuple(wish.had_by(self.stack, self.model) for wish in self.target.mixture)
            return self.target.model_copy(update={"mixture": has})
        return _Seen.of(self.target, self.stack, self.model).reached

    @property
    def units(self) -> float:
        """The distance of lobes in units of CIE 1976; a variance counts by its share."""
        return 100 * self.missed / FIRST

    @property
    def met(self) -> bool:
        """Whether the stack has what is asked for."""
        return self.missed < MISSED


def answer(
    target: TargetLike,
    model: str | Model = DEFAULT,
    **switches: str,
) -> Answer:
    """The stack that is asked for by a target with wishes of any kind.

    Args:
        target: a target, the mapping of a target file, its lobes alone, or a file.
        model: that reads the stack.

    Raises:
        InvalidInput: not a target, a wish that no stack of these layers has, or an unknown model or switch.
        Infeasible: no stack has all; the nearest one is the `start` of the first way out. A film has the nearest colour
            that its thickness gives, and none is refused.
    """
    return answers(target, 1, model, 0, **switches)[0]


def answers(
    target: TargetLike,
    count: int,
    model: str | Model = DEFAULT,
    seed: int = 0,
    **switches: str,
) -> list[Answer]:
    """The answer, and others that meet the wish as well or less, the nearest first: other stacks with the lobes, and
    other thicknesses of a film. Raises as `answer`."""
    wanted, count = read(target), whole_number("count", count, 1)
    chosen = model_of(wanted, model, **switches)
    if not wanted.beyond_lobes:
        return [Answer(one.stack, wanted, chosen, 0.0) for one in alternatives(wanted, count, chosen, seed)]
    found = nearest_answers(wanted, count, chosen, seed)
    if not found[0].met and not wanted.nearest:
        raise refused(found[0])
    return [each for each in found if each.met or wanted.nearest]


def nearest_answers(wanted: Target, count: int, model: Model, seed: int = 0, quick: bool = False) -> list[Answer]:
    """The nearest stacks to further wishes, met or not. Raises InvalidInput, Infeasible where the layers cannot."""
    if isinstance(wanted.start, Mix):
        mix, missed = weighed(wanted.start, wanted.mixture, model)
        return [Answer(mix, wanted, model, missed)]
    starts = _starts(wanted, count, model, seed)
    for wish in wanted.further:
        lacking = wish.lacking(starts[0])
        if lacking and lacking.stack is None:
            raise InvalidInput(lacking.why)
        if lacking:
            other = wanted.model_copy(update={"start": lacking.stack})
            raise Infeasible(lacking.why, 0, wish.key, [Direction("layer", lacking.words, 0.0, other)])
    for wish in wanted.further:
        starts = [other for stack in starts for other in wish.starts(stack)]
    held, loose = _held(wanted, starts[0], model), _loose(wanted)
    wanted = held if wanted.available else wanted
    tried = _made_of(held, starts, model, loose) or starts
    tried.sort(key=lambda stack: _Search.of(held, stack, model.surrogate, loose).cost)
    effort, found = QUICK if quick else THOROUGH, list[Answer]()
    searches = [_Search.of(held, start, model, loose) for start in tried[: max(TRIED, 2 * count)]]
    for search in searches:
        each = search.answer(search.straight(effort), wanted)
        if not any(_alike(each.stack, other.stack) for other in found):
            found.append(each)
        if sum(each.met for each in found) == count:
            break
    if not wanted.nearest and not any(each.met for each in found):
        found.append(searches[0].answer(searches[0].along(effort), wanted))
    return sorted(found, key=lambda each: each.missed)[:count]


def _starts(wanted: Target, count: int, model: Model, seed: int) -> list[Stack]:
    """The present material, or else stacks that have the lobes."""
    if isinstance(wanted.start, Stack):
        return [filled(wanted.start) if wanted.available else wanted.start]
    alone = wanted.model_copy(update={key: Target.model_fields[key].default for key in wanted.beyond_lobes})
    drawn = max(DRAWN, count), model.surrogate, seed
    try:
        found = first_stacks(alone, *drawn) if wanted.nearest else alternatives(alone, *drawn)
    except Infeasible:
        found = [invert_stack(alone, model)]
    return [_pinned(_with_media(each.stack, wanted), wanted) for each in found]


def _with_media(stack: Stack, wanted: Target) -> Stack:
    """The stack with a medium between all interfaces, and with one above them where that is fixed."""
    whole = with_media(stack)
    if wanted.lobes[0].fixed.of("tau", 0) is None:
        return whole
    first = next(n for n, layer in enumerate(stack.layers) if layer.surface)
    return whole.with_layers([*stack.layers[:first], *whole.layers])


def _pinned(stack: Stack, wanted: Target) -> Stack:
    """The stack with what is fixed of its interfaces: one that has the nearest lobes may not have it."""
    places = iter(n for n, layer in enumerate(stack.layers) if isinstance(layer, Interface))
    pins: dict[str, Any] = {}
    for lobe in wanted.lobes:
        for n, place in zip(range(lobe.interfaces), places):
            values = {key: lobe.fixed.of(key, n) for key in ("eta", "k", "alpha")}
            pins |= {f"layer{place}_{key}": value for key, value in values.items() if value is not None}
    return stack.replace(**pins) if pins else stack


def _made_of(wanted: Target, starts: list[Stack], model: Model, loose: Loose) -> list[Stack]:
    """Stacks of substances that are available, whose other values come near to the wish; none where all are."""
    if not wanted.available:
        return []
    kept = [n for n, keys in _fixed(wanted, starts[0]).items() if keys & (INDEX | ABSORPTION)]
    found = []
    for stack in made_of(starts, wanted.available, kept, wanted.thinnest):
        search = _Search.of(wanted, stack, model.surrogate, loose)
        found.append(search.values.placed(search.straight(QUICK))[0])
    return found


def _thickened(stack: Stack, thinnest: float) -> Stack:
    """The stack with media of that depth in the place of thinner ones that absorb and scatter as much.

    Raises:
        InvalidInput: a thinner one has pigments.
    """
    layers = list(stack.layers)
    for n, (layer, values) in enumerate(zip(stack.layers, Material.of(stack).layers)):
        if isinstance(layer, Medium) and isinstance(values, MediumValues) and values.depth < thinnest:
            if layer.pigments:
                raise InvalidInput(f"thinnest: layer {n} has a depth of {values.depth:g}, which its pigments need")
            share = values.depth / thinnest
            thinned = {key: written(share * np.ravel(getattr(values, key))) for key in COEFFICIENTS}
            layers[n] = layer.model_copy(update={"depth": thinnest, **thinned})
    return stack.with_layers(layers)


def _held(wanted: Target, stack: Stack, model: Model) -> Target:
    """The wish, with the lobes of the present material where these stay."""
    alone = wanted.available or not wanted.further
    if wanted.lobes or not (alone or any(wish.keeps_lobes for wish in wanted.further)):
        return wanted
    seen = stack_lobes(stack, 1.0, model=model)
    lobes = []
    for energy, alpha, rotation in zip(seen.energy, seen.alpha, seen.rotation):
        lobe = TargetLobe(energy=tuple(np.clip(energy[:, 0], 0.0, None).tolist()))
        axes = Roughness(min(alpha[0, 0], 1.0), min(alpha[1, 0], 1.0), rotation)
        lobes.append(Target([lobe]).with_roughness(0, axes).lobes[0])
    return wanted.model_copy(update={"lobes": tuple(lobes)})


def _loose(wanted: Target) -> Loose:
    """Numbers that are asked of a lobe of the present material at a second angle, by the place of the lobe: at normal
    incidence these do not stay."""
    if wanted.lobes:
        return frozenset()
    each = ((wish.lobe, key) for wish in wanted.grazing for key in wish.asked_for if getattr(wish, key) is not None)
    return frozenset((lobe - 1, key) for lobe, key in each if lobe is not None)


def refused(found: Answer) -> Infeasible:
    """The refusal of a wish, with the nearest stack as its way out."""
    pairs = zip(found.target.further, found.reached.further)
    off = [(float(np.abs(wish.goal - has.goal).max()), wish, has) for wish, has in pairs]
    _, wish, has = max(off, key=lambda each: each[0])
    lobes = " with its lobes" if found.target.lobes or wish.keeps_lobes else ""
    lobes = " with the rest of its lobes" if _loose(found.target) else lobes
    way = Direction(wish.key, has.words(), found.missed, found.reached.model_copy(update={"start": found.stack}))
    nothing = (
        "no weights of these parts give"
        if wish.key == "mixture"
        else f"no stack of these layers{lobes} is found that has"
    )
    return Infeasible(f"{nothing} {wish.words()}", 0, wish.key, [way])


def _alike(one: Stack, other: Stack) -> bool:
    """Whether two stacks differ by little in numbers, and in nothing else."""
    if one.flat().keys() != other.flat().keys():
        return False
    return all(_close(a, b) for a, b in zip(one.flat().values(), other.flat().values()))


def _close(a: Any, b: Any) -> bool:
    numbers = all(isinstance(x, int | float | tuple) for x in (a, b))
    return bool(np.allclose(a, b, rtol=SAME, atol=SAME) if numbers else a == b)


@dataclass(frozen=True)
class _Seen:
    """A stack as a wish sees it: its lobes at normal incidence, and at the angle of every further wish."""

    wish: Target
    lobes: StackLobes
    model: Model
    loose: Loose = frozenset()

    @classmethod
    def of(cls, wish: Target, stack: Stack, model: Model, loose: Loose = frozenset()) -> _Seen:
        angles = [0.0, *(each.angle for each in wish.further)]
        return cls(wish, stack_lobes(stack, np.cos(np.radians(angles)), model=model), model, loose)

    @property
    def groups(self) -> list[list[int]]:
        """The interfaces of every lobe; of a wish without lobes, each has its own."""
        counts = [lobe.interfaces for lobe in self.wish.lobes] or [1] * len(self.lobes.energy)
        return [list(range(*ends)) for ends in pairwise(np.cumsum([0, *counts]))]

    @property
    def reached(self) -> Target:
        """The wish as the stack has it."""
        found, n = self.wish, 0
        for key in KINDS:
            kind = getattr(found, key)
            has = tuple(wish.reached(self.lobes, n + k + 1, self.groups) for k, wish in enumerate(kind))
            found, n = found.model_copy(update={key: has}), n + len(kind)
        for k, own in enumerate(self.groups if found.lobes else ()):
            found = found.with_energy(k, np.sum([self.lobes.energy[n][:, 0] for n in own], axis=0))
            axes = (*self.lobes.alpha[own[-1]][:, 0], self.lobes.rotation[own[-1]][0])
            found = found.with_roughness(k, Roughness(*axes))
        return found

    @property
    def missed(self) -> Array:
        """Differences from the lobes, and from further wishes, in the units of `Answer.missed`."""
        rows = [FIRST * self._lobe_missed(k) for k in range(len(self.wish.lobes))]
        rows += [has.goal - wish.goal for wish, has in zip(self.wish.further, self.reached.further)]
        return np.concatenate(rows)

    def _lobe_missed(self, k: int) -> Array:
        lobe, own = self.wish.lobes[k], self.groups[k]
        energy = np.sum([self.lobes.energy[n][:, 0] for n in own], axis=0)
        goal = np.array(Covariance.of(lobe.axes, MAPS[self.model.map]).matrix())
        blurs = [WIDTHS * (self.lobes.covariance[n][:, 0] - goal) / (goal.max() + BLURRED) for n in own]
        energies = [] if (k, "energy") in self.loose else [compared(energy, None) - compared(lobe.colour, None)]
        return np.concatenate([*energies, *([] if (k, "alpha") in self.loose else blurs), []])


@dataclass(frozen=True)
class _Search:
    """A search from a stack for one that misses least of a wish."""

    wish: Target
    values: FreeValues
    model: Model
    loose: Loose

    @classmethod
    def of(cls, wish: Target, stack: Stack, model: Model, loose: Loose) -> _Search:
        fixed = _fixed(wish, stack)

        def allowed(free: Free) -> Free | None:
            layer = stack.layers[free.layer]
            if isinstance(layer, Medium) and layer.pigments:  # which give its colour
                return None
            moved = [each for one in wish.further if (each := one.moved(free, stack))]
            if not moved and not (wish.lobes and free.keys != ("albedo",) and not free.keys[0].startswith("film")):
                return None
            kept = fixed.get(free.layer, set()) | (INDEX if wish.available else set())
            return None if free.keys[0].partition("_")[0] in kept else (moved or [free])[0]

        coats = laid(stack, wish.available)
        values = FreeValues(
            start=stack, eta_max=wish.eta_max, allowed=allowed, laid=frozenset(coats), thinnest=wish.thinnest
        )
        return cls(wish, values, model, loose)

    @cached_property
    def missed(self) -> Array:
        """Differences at the start, as far as it lies within the bounds."""
        return self._read(self.values.first)

    @property
    def cost(self) -> float:
        """The sum of their squares."""
        return float(self.missed @ self.missed)

    def straight(self, effort: _Effort) -> Array:
        """The point that misses least of the wish, as a search from the start finds it."""
        return self._to(self.values.first, 1.0, effort)[0]

    def along(self, effort: _Effort) -> Array:
        """The last point that is found, by bisection, on the line from what the start shows to the wish: there a search
        does not lose the lobes."""
        x, off = self._to(self.values.first, 0.0, effort)
        part, step = 0.0, 0.5
        for _ in range(effort.halvings if np.linalg.norm(off) < MISSED else 0):
            there, off = self._to(x, part + step, effort)
            if np.linalg.norm(off) < MISSED:
                x, part = there, part + step
            step /= 2
        return x

    def answer(self, x: Array, wanted: Target) -> Answer:
        """The answer at a point; without the clear media that the search added, unless coats are to be so thick."""
        stack, seen = self.values.placed(x)
        if wanted.thinnest:
            stack = _thickened(stack, wanted.thinnest)
        elif wanted.available or not wanted.start:
            stack = stack.with_layers(stack.layers[n] for n in seen)
        named = stack.model_copy(update={"name": wanted.name or stack.name})
        return Answer(named, wanted, self.model, float(np.linalg.norm(self._read(x))))

    def _to(self, x: Array, part: float, effort: _Effort) -> tuple[Array, Array]:
        """The point that misses least of a part of the way from what the start shows to the wish, and what it misses
        of that."""
        shift = np.zeros(len(self.missed))
        shift[len(self.missed) - self.further :] = (1 - part) * self.missed[len(self.missed) - self.further :]
        missed = self._read(x) - shift
        if not len(x):
            return x, missed
        low, high = np.transpose([free.bounds for free in self.values.free])
        secants = Secants(
            lambda x: self._read(x) - shift,
            lambda x, missed: self._slopes(x, missed + shift),
            self.values.scale,
            low,
            high,
        )
        return secants.nearest(x, missed, effort.slopes * len(x) + effort.readings, ENOUGH)

    @property
    def further(self) -> int:
        """How many of what is missed are of wishes beyond lobes; they come last."""
        return sum(len(wish.goal) for wish in self.wish.further)

    def _read(self, x: Array) -> Array:
        try:
            return _Seen.of(self.wish, self.values.placed(x)[0], self.model, self.loose).missed
        except InvalidInput:  # a rough interface with films between equal indices
            return np.full(len(self.missed), 1e3)

    def _slopes(self, x: Array, missed: Array) -> Array:
        high = np.array([free.bounds[1] for free in self.values.free])
        strides = np.where(x + STRIDE > high, -STRIDE, STRIDE)
        return np.transpose([(self._read(each) - missed) for each in x + np.diag(strides)]) / strides


def _fixed(wish: Target, stack: Stack) -> dict[int, set[str]]:
    """The beginnings of keys that stay, by layer."""
    found: dict[int, set[str]] = {}
    places = iter(n for n, layer in enumerate(stack.layers) if isinstance(layer, Interface))
    for lobe in wish.lobes:
        for n, place in zip(range(lobe.interfaces), places):
            found[place] = {key for key in ("eta", "k", "alpha") if lobe.fixed.of(key, n) is not None}
            above = place - 1
            while lobe.fixed.of("tau", n) is not None and above >= 0 and isinstance(stack.layers[above], Medium):
                found[above], above = ABSORPTION, above - 1
    return found
