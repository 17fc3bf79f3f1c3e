"""Why a target has no stack, and which targets near it have one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from velatura.inverse import refined
from velatura.inverse.lobes import stacks
from velatura.inverse.lobes.target import BLUR, LEAST, Fixed, Target, TargetLobe, distance
from velatura.inverse.reasons import TOO_LITTLE, TOO_MUCH, UNMET, Direction, Infeasible, because
from velatura.inverse.solution import exact
from velatura.model import Model
from velatura.results import digits

EFFORT = ((12, 32), (24, 128))
SHOWN = 3  # ways out, the nearest ones
FAR = 4.0  # the logarithm by which quantities change at most
TINTED, PAIRED, OTHER, FREED, REMADE = 0.5, 0.5, 1.0, 0.5, 3.0  # what another form costs, or a change of another lobe
SURE = (0.02, 0.002, 2e-4)  # energies of lobes that are almost always possible
# Reasons that are lifted by other values than those fixed, by less energy, and by more
OF_FIXED = ("absorption", "excess", "index", "fixed", "upper")
ASKS_MORE, ASKS_LESS = ("energy", "bright", "unmet energy"), ("metal", "mirror", "upper")
ROUNDING = 1e-9  # by which lobes stay below what there is


@dataclass(frozen=True)
class Pace:
    """Effort of a search for ways out.

    steps, halvings: by which a target that can be reached is looked for, and then approached. ways: that are
    approached. channels: whether single channels are changed, too.
    """

    steps: int
    halvings: int
    ways: int
    channels: bool


CLOSELY = Pace(8, 12, 5, True)
ROUGHLY = Pace(4, 1, 3, False)  # where another model moves on from what is found


def infeasible(target: Target, model: Model) -> Infeasible:
    """The error for a target without a stack, with the nearest targets that have one.

    A model without a closed form is explained by the nearest one that has; its ways out are moved to where the model
    itself has stacks.
    """
    if exact(target, model):
        return _in_closed_form(target, model)
    met = refined.obstacle(target, model)
    if met is not None:
        bound, found = met
        return Infeasible(
            bound.why(target), bound.lobe + 1, bound.reason, refined.ways_from(found, target, bound, model)
        )
    closed = _in_closed_form(target, model.surrogate, ROUGHLY)
    return Infeasible(closed.why, closed.lobe, closed.constraint, refined.ways(closed.directions, target, model))


def _in_closed_form(target: Target, model: Model, pace: Pace = CLOSELY) -> Infeasible:
    """The same for a model in closed form."""
    search, found = Search(model, pace), list[Direction]()
    total = target.brightness
    if total > 1:
        why, n, constraint = TOO_MUCH.format(total=total), -1, "sum"
        ways = [*_dimmed(target), *_capped(target)]
        found = search.nearest(ways)
        for way in () if found else ways:
            if (direction := search.completed(way.direction(0.0), way.along(0.0), 0)) is not None:
                found.append(direction)
    else:
        n, constraint = why_not(target, model)
        why = because(n, constraint, target)
        first = search.of_lobe(target, n)
        found = [whole for direction in first if (whole := search.with_rest(direction, target)) is not None]
        for direction in () if found else first[:1]:
            if (whole := search.completed(direction, target, n + 1)) is not None:
                found.append(whole)
    if not found:
        found = next((ends for way in _to_sure(target) if (ends := search.nearest([way]))), [])
    return Infeasible(why, n + 1, constraint, sorted(found, key=lambda direction: direction.change))


# Why -----------------------------------------------------------------------------------------------------------------


def why_not(target: Target, model: Model) -> tuple[int, str]:
    """The first lobe without a solution, and the constraint that the best attempt violates most, of those that alone
    are in the way, if there are any."""
    (spread, keep), search = EFFORT[-1], Search(model)
    paths = stacks.beginning(target, model)
    for n, lobe in enumerate(target.lobes):
        above, tried = paths, stacks.extended(paths, lobe, target, spread, first=n == 0)[0]
        paths = stacks.pruned(tried, lobe.interfaces, keep)
        if len(paths.cost):
            continue
        free = lobe.model_copy(update={"fixed": lobe.fixed.films_alone})
        if free != lobe:
            # What is fixed is the reason only if there is a stack without it
            without, _ = stacks.extended(above, free, target, spread, first=n == 0)
            if not len(stacks.pruned(without, free.interfaces, keep).cost):
                tried, lobe = without, free
        first, reasons = target.model_copy(update={"lobes": target.lobes[: n + 1]}), _violated(tried, lobe)
        return n, next((reason for reason in reasons if search.leads(_lifting(first, n, reason))), reasons[0])
    return len(target.lobes) - 1, UNMET[0]


def _violated(tried: stacks.Partial, lobe: TargetLobe) -> list[str]:
    """The constraints that stacks violate which were tried.

    First is that which the best of them violates most; if some violate one alone, of these. A colour that one index
    does not give is in the way at any brightness. Others follow by how little they are violated, and last any colour.
    """
    if not len(tried.cost):
        return ["fixed"]  # between no two interfaces is there an index that gives it
    layers = tried.layers[-lobe.interfaces :]
    for n, upper in enumerate(layers[:-1], 1):
        if not np.any(upper.feasible):  # what it leaves for those below has no meaning
            layers = layers[:n]
            break
    names = [key for part in layers for key in part.margins]
    margins = np.array(np.broadcast_arrays(*(m for part in layers for m in part.margins.values())))
    broken = np.maximum(np.minimum(margins, 0), -1e9)
    alike = np.array(["energy" if name in TOO_LITTLE else name for name in names])
    each = [np.any(broken[alike == name] < 0, axis=0) for name in dict.fromkeys(alike.tolist())]
    alone = np.sum(each, axis=0) == 1
    best = margins[:, np.argmax(np.where(alone | ~alone.any(), broken.sum(axis=0), -np.inf))]
    violated = names[int(np.argmin(best))]
    if violated == "energy" and np.ptp(lobe.colour) > 0 and dict(zip(names, best)).get("colour", 0) < 0:
        violated = "colour"
    least = np.where(broken < 0, broken, -np.inf).max(axis=1)
    others = [names[k] for k in np.argsort(-least) if np.isfinite(least[k])]
    last = ["colour"] if np.ptp(lobe.colour) > 0 else []
    return list(dict.fromkeys(_named(name, lobe) for name in (violated, *others, *last)))


def _named(constraint: str, lobe: TargetLobe) -> str:
    """The reason for a violated constraint: too little reflectance has another one where an index is fixed."""
    if constraint not in TOO_LITTLE:
        return constraint
    if lobe.fixed.of("eta", lobe.interfaces - 1) is not None:
        return "absorption"
    return "energy" if lobe.base == "dielectric" else "bright"


def _lifting(target: Target, n: int, reason: str) -> Iterator[Way]:
    """The ways to change just what a reason names."""
    lobe = target.lobes[n]
    own = np.maximum(lobe.colour, LEAST)
    if reason in OF_FIXED and lobe.fixed != lobe.fixed.films_alone:
        yield _at(target, target.with_lobe(n, fixed=lobe.fixed.films_alone), "", 0.0)
    if reason in ASKS_MORE:
        yield _darker(target, n)
        yield from _evened(target, n, -1)
    if reason in ASKS_LESS:
        yield _with_energy(target, n, _scaled(own, 1))
    if reason == "colour":
        far = float(np.log(own.max() / own.min()))
        yield _with_energy(target, n, _scaled(np.full(3, own.min()), 1), far=far, inclusive=True)
    if reason in ("blur", "unmet blur"):
        yield from _wider(target, n)


# Ways out ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Way:
    """Targets `along(x)` that lie further from a target the larger x is, from 0 to `far`.

    words: of a target on the way. cost: of the way itself, beside how far the quantities change. inclusive: whether the
    first one is another target already.
    """

    what: str
    start: Target
    along: Callable[[float], Target]
    words: Callable[[Target], str]
    far: float = FAR
    cost: float = 0.0
    inclusive: bool = False

    def direction(self, x: float) -> Direction:
        """The target at x as a direction."""
        found = self.along(x)
        return Direction(self.what, self.words(found), self.cost + distance(self.start, found), found)


@dataclass(frozen=True)
class Search:
    """Targets that a model in closed form has a stack for, found by bisection.

    followed: partial stacks below the first lobes of targets that have these in common.
    """

    model: Model
    pace: Pace = CLOSELY
    followed: stacks.Known = field(default_factory=dict)

    def possible(self, target: Target) -> bool:
        """Whether a target has a stack."""
        paths = stacks.follow(target, self.model, *EFFORT[0], self.followed)
        return target.brightness <= 1 and all(len(each.cost) for each in paths)

    def nearest(self, ways: Iterable[Way]) -> list[Direction]:
        """The first targets along ways that have a stack, of each description one; the nearest of them."""
        ends = {way: self._approached(way, *ends) for way, ends in self._bracketed(ways)}
        found: dict[str, Direction] = {}
        for direction in sorted((way.direction(ends[way]) for way in ends), key=lambda direction: direction.change):
            found.setdefault(direction.words, direction)
        return list(found.values())[:SHOWN]

    def leads(self, ways: Iterable[Way]) -> bool:
        """Whether a target on one of some ways has a stack."""
        return next(self._bracketed(ways), None) is not None

    def of_lobe(self, target: Target, n: int) -> list[Direction]:
        """The nearest ways out of a lobe that cannot be given below those above it, without the lobes below."""
        above = target.model_copy(update={"lobes": target.lobes[: n + 1]})
        last = n == len(target.lobes) - 1
        own = [*_of_energy(above, n, self.pace.channels), *_of_blur(above, n), *_of_form(above, n, last)]
        return self.nearest(own) or self.nearest(_of_others(above, n))

    def with_rest(self, direction: Direction, target: Target) -> Direction | None:
        """A direction of the first lobes together with those below, as a target has them; None if it has no stack."""
        rest = target.lobes[len(direction.target.lobes) :]
        whole = target.model_copy(update={"lobes": (*direction.target.lobes, *rest)})
        return replace(direction, target=whole) if not rest or self.possible(whole) else None

    def completed(self, direction: Direction, target: Target, n: int) -> Direction | None:
        """A direction of the first n lobes together with those below, these changed, too, where they must be."""
        lobes = direction.target.lobes[:n]
        for k in range(n, len(target.lobes)):
            now = target.model_copy(update={"lobes": (*lobes, target.lobes[k])})
            if not self.possible(now):
                nearest = self.nearest([*_of_blur(now, k), _darker(now, k)])
                if not nearest:
                    return None
                words, change = f"{direction.words} and {nearest[0].words}", direction.change + nearest[0].change
                direction, now = Direction(direction.what, words, change, now), nearest[0].target
            lobes = now.lobes
        return replace(direction, target=target.model_copy(update={"lobes": lobes}))

    def _bracketed(self, ways: Iterable[Way]) -> Iterator[tuple[Way, tuple[float, float]]]:
        """Ways, the nearest first, and of each two points, of which only the further one has a stack; as many as are
        tried."""
        steps = []
        for way in ways:
            steps += [(way, (0.0, 0.0))] if way.inclusive else []
            points = [way.far * (n / self.pace.steps) ** 2 for n in range(self.pace.steps + 1)] if way.far else []
            steps += [(way, ends) for ends in pairwise(points)]
        found = set[Way]()
        for way, ends in sorted(steps, key=lambda step: step[0].direction(step[1][1]).change):
            if len(found) == self.pace.ways:
                break
            if way not in found and self.possible(way.along(ends[1])):
                found.add(way)
                yield way, ends

    def _approached(self, way: Way, start: float, end: float) -> float:
        """The first point that has a stack, between one that has none and one that has."""
        for _ in range(self.pace.halvings if start < end else 0):
            middle = (start + end) / 2
            start, end = (start, middle) if self.possible(way.along(middle)) else (middle, end)
        return end


def _of_energy(target: Target, n: int, channels: bool = True) -> Iterator[Way]:
    """A lobe of other energy: all of it, one channel, the dark ones or the bright ones, or grey."""
    own, what = np.maximum(target.lobes[n].colour, LEAST), f"lobe {n + 1} energy"
    for sign in (-1, 1):
        yield _with_energy(target, n, _scaled(own, sign))
    if np.ptp(own) == 0:
        return
    for channel, name in zip(np.eye(3), "rgb" if channels else ""):
        for sign in (-1, 1):
            yield _with_energy(target, n, _scaled(own, sign * channel), f"{what} {name}")
    yield from _evened(target, n, 1)
    yield from _evened(target, n, -1)
    for sign in (-1, 1):
        yield _with_energy(target, n, _scaled(np.full(3, own.mean()), sign), f"{what}, grey", inclusive=True)


def _evened(target: Target, n: int, sign: int) -> Iterator[Way]:
    """A coloured lobe whose dark channels (1) or bright ones (-1) are nearer to the others."""
    own, name = np.maximum(target.lobes[n].colour, LEAST), f"lobe {n + 1} energy, its"
    if np.ptp(own) == 0:
        return
    far = float(np.log(own.max() / own.min()))
    dark, bright = _scaled(own.min(), 1), _scaled(own.max(), -1)
    if sign > 0:
        yield _with_energy(target, n, lambda x: np.maximum(own, dark(x)), f"{name} dark channels", far=far)
    else:
        yield _with_energy(target, n, lambda x: np.minimum(own, bright(x)), f"{name} bright channels", far=far)


def _darker(target: Target, n: int, cost: float = 0.0) -> Way:
    """A lobe of less energy."""
    return _with_energy(target, n, _scaled(np.maximum(target.lobes[n].colour, LEAST), -1), cost=cost)


def _sharper(target: Target, n: int, cost: float = 0.0) -> Iterator[Way]:
    """A lobe of less variance, unless it has none."""
    s = float(BLUR.variance(target.lobes[n].roughness))
    if s > 0:
        yield _with_variance(target, n, _scaled(s, -1), cost=cost)


def _of_blur(target: Target, n: int) -> Iterator[Way]:
    """A lobe of other variance."""
    yield from _sharper(target, n)
    yield from _wider(target, n)


def _wider(target: Target, n: int) -> Iterator[Way]:
    """A lobe of more variance, unless it has the most."""
    s, widest = float(BLUR.variance(target.lobes[n].roughness)), float(BLUR.variance(1.0))
    if s < widest:
        s = max(s, LEAST)
        yield _with_variance(target, n, _scaled(s, 1), far=float(np.log(widest / s)))


def _of_form(target: Target, n: int, last: bool) -> Iterator[Way]:
    """A lobe of as many interfaces as it has not, below a medium of its colour, with another base, or with nothing
    fixed."""
    lobe, what = target.lobes[n], f"lobe {n + 1}"
    count = 1 if lobe.interfaces == 2 else 2
    forms: list[tuple[str, dict[str, object], float]] = [
        (f"{what} interfaces {count}", {"interfaces": count, "fixed": Fixed()}, PAIRED)
    ]
    if n == 0 and lobe.interfaces == 1 and lobe.base == "dielectric" and np.ptp(lobe.colour) > 0:
        tau = tuple((0.5 * np.log(max(lobe.colour) / np.maximum(lobe.colour, LEAST))).tolist())
        forms.append((f"a tinted medium above {what}", {"fixed": Fixed(tau=(tau,))}, TINTED))
    if last:
        base = "dielectric" if lobe.base == "conductor" else "conductor"
        forms.append((f"{what} base {base}", {"base": base, "fixed": Fixed()}, REMADE))
    kept = lobe.fixed.films_alone
    if lobe.fixed != kept:
        forms.append((f"{what} nothing fixed" + " but films" * (kept != Fixed()), {"fixed": kept}, FREED))
    if kept != Fixed():
        forms.append((f"{what} nothing fixed", {"fixed": Fixed()}, REMADE))
    for name, changes, cost in forms:
        yield _at(target, target.with_lobe(n, **changes), name, cost)


def _of_others(target: Target, n: int) -> Iterator[Way]:
    """Lobes above, less bright or less blurred."""
    for k in range(n):
        yield _darker(target, k, OTHER)
        yield from _sharper(target, k, OTHER)


def _dimmed(target: Target) -> Iterator[Way]:
    """All lobes darker by the same factor, so that they sum to 1, and then less."""
    total = target.brightness * (1 + ROUNDING)

    def darker(x: float) -> Target:
        changed = target
        for n, lobe in enumerate(target.lobes):
            changed = changed.with_energy(n, np.array(lobe.colour) * np.exp(-x) / total)
        return changed

    def words(t: Target) -> str:
        return f"all energies times {max(t.lobes[0].colour) / max(*target.lobes[0].colour, LEAST):.3g}"

    yield Way("energy", target, darker, words, inclusive=True)


def _capped(target: Target) -> Iterator[Way]:
    """One lobe of at most what the others leave, and then less."""
    total = np.sum([lobe.colour for lobe in target.lobes], axis=0)
    for n, lobe in enumerate(target.lobes):
        own = np.array(lobe.colour)
        left = (1 - (total - own)) * (1 - ROUNDING)
        if left.min() > LEAST:
            yield _with_energy(target, n, partial(_at_most, own, left), inclusive=True)


def _to_sure(target: Target) -> Iterator[Way]:
    """Lobes ever more like ones that are almost always possible: dark, and blurred more the deeper they lie."""
    for kept in dict.fromkeys((target, target.freed(films=True), target.freed())):
        for dark in SURE:
            sure, s = kept, 0.0
            for n, lobe in enumerate(target.lobes):
                s = max(2.5 * s, float(BLUR.variance(lobe.roughness)), LEAST)
                sure = sure.with_energy(n, np.full(3, dark if lobe.base == "dielectric" else 0.4)).with_variance(n, s)
            yield Way("lobes", target, partial(_between, kept, sure), _described, 1.0, OTHER)


def _between(one: Target, other: Target, x: float) -> Target:
    """A target a share x of the way, in logarithms, from one to another."""
    found = one
    for n, lobes in enumerate(zip(one.lobes, other.lobes)):
        e, e_other = (np.log(np.maximum(lobe.colour, LEAST)) for lobe in lobes)
        s, s_other = (max(float(BLUR.variance(lobe.roughness)), LEAST) for lobe in lobes)
        found = found.with_energy(n, np.exp(e + x * (e_other - e))).with_variance(n, float(s * (s_other / s) ** x))
    return found


def _described(target: Target) -> str:
    lobes = (f"energy {digits(lobe.energy)} variance {digits(lobe.variance or 0.0)}" for lobe in target.lobes)
    return "lobes of " + ", ".join(lobes)


def _at(target: Target, changed: Target, name: str, cost: float) -> Way:
    """A way of one target."""
    return Way(name, target, lambda x: changed, lambda t: name, 0.0, cost, inclusive=True)


def _with_energy(target: Target, n: int, along: Callable[[float], np.ndarray], name: str = "", **options: Any) -> Way:
    """The way to other energies of a lobe."""
    name = name or f"lobe {n + 1} energy"
    return Way(
        name,
        target,
        lambda x: target.with_energy(n, along(x)),
        lambda t: f"{name} {digits(t.lobes[n].energy)}",
        **options,
    )


def _with_variance(target: Target, n: int, along: Callable[[float], float], **options: Any) -> Way:
    """The way to other variances of a lobe."""
    name = f"lobe {n + 1} variance"
    return Way(
        name,
        target,
        lambda x: target.with_variance(n, float(along(x))),
        lambda t: f"{name} {digits(t.lobes[n].variance or 0.0)}",
        **options,
    )


def _scaled(value: Any, by: Any) -> Callable[[float], Any]:
    """The value times exp(by x), over x."""
    return lambda x: value * np.exp(by * x)


def _at_most(value: np.ndarray, bound: np.ndarray, x: float) -> np.ndarray:
    """The value, clamped from above to a bound times exp(-x)."""
    return np.minimum(value, bound * np.exp(-x))
