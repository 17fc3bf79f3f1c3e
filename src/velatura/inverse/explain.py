"""Why a target has no stack, and which targets near it have one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from velatura.errors import NoSolution
from velatura.inverse import stacks
from velatura.inverse.interface import CONDUCTOR_MIN
from velatura.inverse.target import BLUR, Target
from velatura.model import Model

EFFORT = ((12, 32), (24, 128))
STEPS, HALVINGS = 12, 14  # by which a target that can be reached is looked for, and then approached
TOO_MUCH = "energies sum to {total:.4g}, above 1"
REASONS = {
    "energy": "no index up to {eta_max:g} reflects as much",
    "upper": "its upper interface alone reflects more",
    "absorption": "the fixed index reflects too little",
    "colour": "what lies above it absorbs nothing, or what is fixed, and one index does not give that colour",
    "metal": f"a conductor (k >= eta) reflects more, {CONDUCTOR_MIN:.3f} at least, and what lies above absorbs nothing",
    "blur": "what lies above it blurs light more than that, or bounces it too often",
    "index": "a fixed index is outside its bounds, 1 to {eta_max:g} or k >= eta",
    "fixed": "a fixed roughness is not the one that gives that blur",
    "model": "the model's own reading cannot be met",
}


@dataclass(frozen=True)
class Direction:
    """One way to change a target: the quantity, its description, and the nearest target that has a stack."""

    what: str
    words: str
    change: float
    target: Target


class Infeasible(NoSolution):
    """No stack gives the target.

    lobe: the first one from the top, counted from 1, that cannot be given; 0 where it is all of them. constraint: what
    forbids it, a key of `REASONS`, or "sum". directions: the nearest targets that can be reached.
    """

    def __init__(self, why: str, lobe: int, constraint: str, directions: list[Direction]) -> None:
        self.why, self.lobe, self.constraint, self.directions = why, lobe, constraint, directions
        hints = "; ".join(direction.words for direction in directions)
        super().__init__(f"no stack: {why}" + (f" (possible: {hints})" if hints else ""))

    @property
    def nearest(self) -> Target | None:
        """The target with the smallest change, of all directions."""
        return min(self.directions, key=lambda d: d.change).target if self.directions else None


def infeasible(target: Target, model: Model) -> Infeasible:
    """The error for a target without a stack, with the nearest targets that have one."""
    if not model.recursion.closed_form:
        from velatura.inverse import refined  # which drags, for reasons that stand here

        return refined.refused(target, model)
    total = float(np.sum([lobe.colour for lobe in target.lobes], axis=0).max())
    if total > 1:
        directions = [d for d in [_scaled(target, model)] if d]
        return Infeasible(TOO_MUCH.format(total=total), 0, "sum", directions)
    lobe, constraint = why_not(target, model)
    return Infeasible(because(lobe, constraint, target), lobe + 1, constraint, _directions(target, model, lobe))


def because(lobe: int, constraint: str, target: Target) -> str:
    """The reason in words."""
    return f"lobe {lobe + 1}: {REASONS[constraint].format(eta_max=target.eta_max)}"


def why_not(target: Target, model: Model) -> tuple[int, str]:
    """The first lobe without a solution, and the constraint that the best attempt violates most."""
    spread, keep = EFFORT[-1]
    paths = stacks.beginning(target, model)
    for n, lobe in enumerate(target.lobes):
        tried = stacks.extended(paths, lobe, target, spread, first=n == 0)
        paths = stacks.pruned(tried, lobe.interfaces, keep)
        if not len(tried.cost):
            return n, "fixed"  # between no two interfaces is there an index that gives it
        if not len(paths.cost):
            layers = tried.layers[-lobe.interfaces :]
            names = [key for part in layers for key in part.margins]
            margins = np.array(np.broadcast_arrays(*(m for part in layers for m in part.margins.values())))
            best = margins[:, np.argmax(np.minimum(margins, 0).sum(axis=0))]
            return n, names[int(np.argmin(best))]
    return len(target.lobes) - 1, "model"


def _directions(target: Target, model: Model, n: int) -> list[Direction]:
    """The nearest targets: all of a lobe's energy changed, one channel's, its blur."""
    lobe = target.lobes[n]
    found = []

    def energies(scale: np.ndarray) -> Target:
        colour = tuple(float(e) for e in np.array(lobe.colour) * scale)
        return target.with_lobe(n, energy=colour[0] if len(set(colour)) == 1 else colour)

    channels = [(f"lobe {n + 1} energy", np.ones(3))]
    if len(set(lobe.colour)) > 1:
        channels += [(f"lobe {n + 1} energy {name}", np.eye(3)[c]) for c, name in enumerate("rgb")]
    for what, which in channels:
        for sign in (-1, 1):
            t = _first(target, model, lambda x: energies(np.exp(sign * x * which)), 4.0)  # noqa: B023
            if t is not None:
                change = abs(float(np.sum(np.log(np.array(t.lobes[n].colour) / np.array(lobe.colour)))))
                found.append(Direction(what, f"{what} {digits(t.lobes[n].energy)}", change, t))

    def blurred(x: float) -> Target:
        return target.with_lobe(n, alpha=None, variance=float(max(s * np.exp(x), 0.0)))

    s = float(BLUR.variance(lobe.roughness))
    for sign in (-1, 1) if s > 0 else ():
        t = _first(target, model, lambda x: blurred(sign * x), 4.0)  # noqa: B023
        if t is not None:
            now = t.lobes[n]
            words = f"lobe {n + 1} variance {digits(now.variance or 0.0)}"
            found.append(Direction(f"lobe {n + 1} variance", words, abs(float(np.log((now.variance or 0) / s))), t))
    return found


def _scaled(target: Target, model: Model) -> Direction | None:
    """All lobes darker by the same factor."""

    def darker(x: float) -> Target:
        changed = target
        for n, lobe in enumerate(target.lobes):
            changed = changed.with_lobe(n, energy=tuple(float(e * np.exp(-x)) for e in lobe.colour))
        return changed

    t = _first(target, model, darker, 4.0)
    if t is None:
        return None
    scale = t.lobes[0].colour[0] / max(target.lobes[0].colour[0], 1e-12)
    return Direction("energy", f"all energies times {scale:.3g}", abs(float(np.log(max(scale, 1e-12)))), t)


def _first(target: Target, model: Model, along: Callable[[float], Target], far: float) -> Target | None:
    """The first target along a way that has a stack; None if there is none up to a distance."""

    def possible(x: float) -> bool:
        t = along(x)
        return stacks.search(t, model, EFFORT[:1]) is not None

    steps = far * (np.arange(1, STEPS + 1) / STEPS) ** 2
    end = next((x for x in steps if possible(x)), None)
    if end is None:
        return None
    start = 0.0 if end == steps[0] else float(steps[np.searchsorted(steps, end) - 1])
    for _ in range(HALVINGS):
        middle = (start + end) / 2
        start, end = (start, middle) if possible(middle) else (middle, end)
    return along(float(end))


def digits(value: float | tuple[float, ...]) -> str:
    """A number or colour in a message."""
    return f"{value:.4g}" if isinstance(value, float) else "[" + ", ".join(f"{x:.4g}" for x in value) + "]"
