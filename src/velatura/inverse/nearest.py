"""The answer to a wish from a present stack: the same for the editor, under the hand and at rest, and for `invert`.

The wish is met if a stack with its lobes is found. Otherwise the answer has the nearest lobes: of those on the straight
line from the present lobes to the wish, in energies and variances, the last ones that a stack is found for. So what the
wish does not change stays. There are two exceptions. A lobe above which nothing absorbs is grey: a colour is first
replaced by its mean. And a metal as bright as can be that is to be blurred more gives up as much energy as it must.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from velatura.inverse.lobes.target import Target
from velatura.inverse.local.coordinates import Bound
from velatura.inverse.local.dragged import DraggedStack
from velatura.inverse.local.line import EXACT, KNOWN, QUICK, Line, Reached
from velatura.inverse.reasons import because
from velatura.inverse.solution import EFFORTS, in_closed_form
from velatura.stack import Stack

EFFORT = EFFORTS[:1]  # to find a stack that is not near
READINGS = 16, 24, 24, 24, 24  # of a slow model, for one line
SAME = 1e-5  # difference of roughnesses of a blur that stays
CLOSE = 0.05  # part of the way from which a wish is met by itself
UNLIKE = 1e-3  # energy or variance by which a stack differs from the nearest that can be dragged, and is taken itself
HALVINGS = 6  # of the way that is left, where other searches are looked at
DIMMED = 0.7  # share of the energy of a lobe that it has in any case if it is blurred more
LEAST = 1e-3  # part of the way that is no change
BEYOND = 0.05  # parts of the way by which models differ
ROUNDED = 1e-3  # share of an energy by which a wish may be off, that is not worth a word


@dataclass(frozen=True)
class Nearest:
    """The nearest stack to a wish.

    part: of the way to the wish, 1 where it is met. lobe, reason: the lobe, from 0, that keeps the answer from the
    wish, and the key of why in `REASONS`; None where nothing does. exact: False for an answer under the hand.
    """

    stack: DraggedStack
    wish: Target
    part: float = 1.0
    lobe: int | None = None
    reason: str | None = None
    exact: bool = True

    @property
    def met(self) -> bool:
        """Whether the stack has the lobes of the wish."""
        return self.reason is None

    @property
    def why(self) -> str | None:
        """Why the wish is not met, in words."""
        return None if self.reason is None or self.lobe is None else because(self.lobe, self.reason, self.wish)

    @property
    def reached(self) -> Target:
        """The lobes of the stack."""
        return self.stack.now(self.wish)


def nearest(present: DraggedStack, wish: Target, now: Target | None = None, quick: bool = False) -> Nearest:
    """The nearest stack to a wish from a present one.

    now: the present lobes, where they are not quite those of a stack that can be dragged, as of metals by spectra.
    quick: as exact as is needed under the hand; readings of a slow model that follow make the answer exact.
    """
    quick = quick and present.space.slow
    if present.space.slow:
        present = present.rounded(KNOWN)
    possible = present.achromatic(wish)
    grey = _colour_lost(present, wish, possible)
    if present.missed(possible, present.space.counted) < EXACT:
        return _told(Nearest(present.renamed(possible), wish), grey)
    if now is None or present.missed(now) <= UNLIKE:
        now = present.now(possible)
    found, bound, part, settled = _along(present, now, possible, quick)
    if bound is not None and (other := _elsewhere(present, possible, quick)) is not None:
        found, bound, part = other, None, 1.0
    if bound is not None and present.space.slow:
        found, bound, part = _by_closed_form(present, now, possible, part, quick) or (found, bound, part)
    if bound is not None and (not present.space.slow or not (settled or part >= LEAST)):
        found, bound, part = _further(present, now, possible, found, bound, part, quick)
    if bound is not None and (dimmer := _dimmed(present, now, possible, bound, quick)) is not None:
        found, bound, part = dimmer, dataclasses.replace(bound, reason="bright"), 1.0
    if bound is None and not quick and _beside(found, possible) > EXACT:
        found = _met(found, possible) or found
    if part < LEAST:
        found, part = present.renamed(present.now(possible)), 0.0
    answer = Nearest(found, wish, part, exact=not quick)
    if bound is not None:
        return dataclasses.replace(answer, lobe=bound.lobe, reason=_named(bound, wish))
    return _told(answer, grey or _colour_lost(present, wish, found.now(wish) if present.coloured else possible))


def _told(answer: Nearest, grey: str | None) -> Nearest:
    return dataclasses.replace(answer, lobe=0, reason=grey) if grey else answer


def _named(bound: Bound, wish: Target) -> str:
    """The reason for a bound: that an index ends is that it reflects too little, unless it is fixed."""
    lobe = wish.lobes[bound.lobe]
    if bound.reason in ("index", "absorption") and lobe.fixed.of("eta", lobe.interfaces - 1) is None:
        return "energy" if lobe.base == "dielectric" else "bright"
    return bound.reason


def _dimmed(present: DraggedStack, now: Target, wish: Target, bound: Bound, quick: bool) -> DraggedStack | None:
    """The stack with the wished blur of a lobe that must give up energy for it, as little as it can: facets lose light,
    and nothing reflects more. None where the wish asks for other energy, or this is not the reason."""
    k = bound.lobe
    lobe, before = wish.lobes[k], now.lobes[k]
    dimmed = np.abs(np.subtract(lobe.colour, before.colour)).max() > ROUNDED
    # Where a metal cannot be brighter, several bounds may meet, and none be named
    metal = ("bright", "unmet blur") if lobe.base == "conductor" else ("bright",)
    if _named(bound, wish) not in metal or dimmed or lobe.roughness <= before.roughness + SAME:
        return None
    dim, stopped, *_ = _along(present, now, wish.with_energy(k, DIMMED * np.array(lobe.colour)), quick)
    if stopped is not None:
        return None
    return _along(dim.at(dim.point.x), dim.now(wish), wish, quick)[0]


def _colour_lost(present: DraggedStack, wish: Target, possible: Target) -> str | None:
    """The reason why the first lobe cannot have the colour that is wished for, if it cannot."""
    asked, given = (np.array(target.lobes[0].colour) for target in (wish, possible))
    if np.max(np.abs(asked - given)) <= ROUNDED * np.max(given):
        return None
    return "mirror" if wish.lobes[0].base == "mirror" else "colour"


def _along(
    start: DraggedStack, now: Target, wish: Target, quick: bool
) -> tuple[DraggedStack, Bound | None, float, bool]:
    """The last stack on the line to a wish, the bound there, the part of the way, and whether the search ended."""
    here, goal = _readings(start, now, now), _readings(start, now, wish)
    line = _line(start, here, goal, wish, quick)
    found = line.last(READINGS)
    if found.off >= line.allowed or found.part >= 1 + line.allowed:
        found = Reached(start.point, 0.0, 0.0, found.bound, settled=False)
    stack = dataclasses.replace(start, point=found.point).renamed(wish)
    if found.part == 0:
        return stack, found.bound or start.space.unmet(int(np.argmax(np.abs(goal - here)))), 0.0, found.settled
    close = found.off < CLOSE and abs(1 - found.part) < CLOSE
    if found.bound is not None and close and (met := _met(stack, wish)) is not None:
        return met, None, 1.0, True
    return stack, found.bound, found.part, found.settled


def _further(
    present: DraggedStack, now: Target, wish: Target, found: DraggedStack, bound: Bound, part: float, quick: bool
) -> tuple[DraggedStack, Bound | None, float]:
    """The stack that other searches find further on the line, by bisection, the bound there, and the part of the way.

    The first search may have ended beside the line: its bound counts only where nothing is looked for from its end. A
    wish far beyond what is possible may lead a slow model astray, where a part of it does not. So the whole wish is
    looked for again from the first part that is found.
    """
    here, goal = _readings(present, now, now), _readings(present, now, wish)
    end, middle, again = 1.0, (part + 1) / 2, True
    for _ in range(HALVINGS):
        asked = present.space.target_of(here + middle * (goal - here), wish)
        stack, stopped, *_ = _along(found, found.now(asked), asked, quick)
        other = stack if stopped is None else None
        if stopped is not None and not present.space.slow:
            other = _elsewhere(present, asked, False)
        if other is None:
            assert stopped is not None
            end, bound = middle, stopped
        elif middle == 1:
            return other.renamed(wish), None, 1.0
        else:
            found, part = other, middle
        whole = again and other is not None and end == 1
        middle, again = (1.0, False) if whole else ((part + end) / 2, again)
    return found.renamed(wish), bound, part


def _by_closed_form(
    present: DraggedStack, now: Target, wish: Target, least: float, quick: bool
) -> tuple[DraggedStack, Bound | None, float] | None:
    """The same of a slow model as `_along`, from the answer of the nearest one that adds up layers; None unless that
    leads further than a part of the way. Where that is a way, the answer must lie well beyond it: by an index on the
    other side of that above, which no line leads to."""
    near = nearest(present.quickly, wish)
    further = near.part >= max(LEAST, least + (0 if present.smooth or least < LEAST else BEYOND))
    fresh = _instead(present, near.stack.stack, wish) if further else None
    if fresh is None:
        return None
    found, bound, part, _ = _along(fresh, now, wish, quick)
    return (found, bound, part) if part >= max(LEAST, least) else None


def _readings(start: DraggedStack, now: Target, wish: Target) -> np.ndarray:
    """Readings of a wish; interfaces of a lobe whose blur stays differ from one another as they do."""
    goal = start.space.goal(wish)
    own = goal[3 * start.space.lobes :].reshape(len(start.interfaces), -1)
    for k, (before, lobe) in enumerate(zip(now.lobes, wish.lobes)):
        if np.abs(np.subtract(before.axes, lobe.axes)).max() < SAME:
            these = [n for n, interface in enumerate(start.interfaces) if interface.lobe == k]
            own[these] += start.variances[these] - start.variances[these].mean(axis=0)
    return goal


def _beside(found: DraggedStack, wish: Target) -> float:
    """The largest difference of the lobes of a stack, of a pair on the average, from those of a wish."""
    space = found.space
    return float(np.abs(space.goal(found.now(wish)) - space.goal(wish))[space.counted].max())


def _line(start: DraggedStack, here: np.ndarray, goal: np.ndarray, wish: Target, quick: bool) -> Line:
    return Line(start.point, here, goal, *start.constant(wish), enough=QUICK if quick else EXACT)


def _met(stack: DraggedStack, wish: Target) -> DraggedStack | None:
    """The stack moved to where it has the lobes of a close wish, to rounding."""
    if wish.pinned:
        return None
    found = stack.at(stack.point.x).met(wish, giving=False, effort=0)
    return found if isinstance(found, DraggedStack) else None


def _elsewhere(present: DraggedStack, wish: Target, quick: bool) -> DraggedStack | None:
    """A stack with the lobes, found independently of the present one; a medium that scatters would be lost."""
    if present.scatters:
        return None
    found = in_closed_form(wish, present.model.without_tir, EFFORT)
    fresh = _instead(present, found.stack, wish) if found else None
    if fresh is None:
        return None
    here, goal = fresh.point.reading.value, _readings(fresh, fresh.now(wish), wish)
    there = _line(fresh, here, goal, wish, quick).last(READINGS, whole=True)
    stack = dataclasses.replace(fresh, point=there.point).renamed(wish)
    if there.bound is None:
        return stack
    return None if there.off > CLOSE else _met(stack, wish)


def _instead(present: DraggedStack, stack: Stack, wish: Target) -> DraggedStack | None:
    """A stack that is found in place of the interfaces of the present one, above what lies below these."""
    fresh = DraggedStack.of(stack, wish, present.model, with_pins=True)
    return fresh and dataclasses.replace(fresh, tail=present.tail, name=present.name, diffuse=present.diffuse)


def lobes_of(stack: Stack, dragged: DraggedStack) -> Target:
    """The lobes of a stack, also where they are not quite those of the nearest one that can be dragged."""
    itself = dragged.achromatic(dragged.of_stack(stack))
    return itself if dragged.missed(itself) > UNLIKE else dragged.now(dragged.target)
