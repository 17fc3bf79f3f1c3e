"""Newton's method from a stack to one that has given lobes, within the bounds on its coordinates.

SciPy's `least_squares` with the same bounds and slopes meets as many wishes, by `bati2021`, in 2.8 times the processor
time (dogbox; 4.3 times by trf; `benchmarks/solvers.py --model bati2021`), and reports no bound that is in the way.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from velatura import ops
from velatura.inverse.lobes.partial_stack import Array
from velatura.inverse.local.approach import Secants
from velatura.inverse.local.coordinates import SLACK, Bound, Point, Reading, units
from velatura.inverse.reasons import UNMET

ROUNDS = 8
ALMOST, ENOUGH = 1e-5, 1e-8  # missing share that one more round makes good; also where Newton's method is slow
SLOW_ALMOST = 1e-6  # the same by Broyden's method, whose rounds gain less
SLOW_ROUNDS, PATIENCE = 16, 3  # for models that are slow: of Broyden's method, and of these at a bound
# Of lobes with axes, whose readings wind: what those rounds may miss where secants of the model itself follow, how many
# readings these take for each coordinate, also at a bound, and what may be missing in the end
NEAR, MEASURED, MEASURED_THERE, WINDING = 0.05, 4, 2, 1e-3
FAR, MEASURED_FAR = 1.0, 8  # the same where a search does not give up
JUMP = 3e-4  # what may be missing of other lobes in the end, since readings jump where nodes are shared out anew
BLURRED = 0.2  # most that a folded variance changes by in a round
HALF, FURTHER, LITTLE = 0.5, 0.7, 0.05  # shares of a reflectance by which it changes in a round, and least change
NEARER, SLOW_PATIENCE = 0.8, 5  # share of what was missing that is nearer, and such rounds without any


@dataclass(frozen=True)
class Compromise:
    """A bound that the solution lies on, and the kept coordinate that changes in return."""

    bound: Bound
    coordinate: int


@dataclass
class Nearest:
    """The point (D,) of those tried that misses least, what it misses at most, and the number of that reading."""

    x: Array = field(default_factory=lambda: np.empty(0))
    missing: float = np.inf
    worst: int = 0

    def keep(self, x: Array, missing: Array) -> None:
        """Keep a point if it is nearer."""
        most = float(np.max(np.abs(missing)))
        if most < self.missing:
            self.x, self.missing, self.worst = x, most, int(np.argmax(np.abs(missing)))


@dataclass(frozen=True)
class Problem:
    """The problem of moving from a point to one where the model reads the energies and variances `goal`."""

    start: Point
    goal: Array

    def solve(self, compromise: Compromise | None = None, effort: int = 1) -> Point | Bound:
        """The stack that meets the goal; the violated bound if there is none.

        effort: 0 for no differences of a slow model, 1 for some where the search ends near the goal, 2 for more.

        What a slow model reads follows variances less and less as they grow, and they have no bound. So the last search
        folds them.
        """
        if effort > 1 and self.start.space.winds and not self.start.space.folded:
            met = Problem(self.start.refolded, self.goal).solve(compromise, effort)
            return met.refolded if isinstance(met, Point) else met
        nearest = Nearest()
        found = self._searched(compromise, nearest)
        space = self.start.space
        slow = space.slow
        if isinstance(found, Bound) and compromise is None and effort and slow:
            # Near, one step ends the search; from further off, where readings wind, the way leads on: once at a bound,
            # and not where what misses most is at its own
            stopped = space.winds and found.coordinate is not None
            apart = nearest.missing > ALMOST
            if (apart == space.winds or space.coated) and not (stopped and effort == 1 and self._ends(nearest)):
                near, readings = (NEAR, MEASURED_THERE if stopped else MEASURED) if effort == 1 else (FAR, MEASURED_FAR)
                if nearest.missing < near:
                    self._approach(nearest, readings * len(space.free), giving=effort > 1)
            enough = WINDING if space.winds else JUMP if found.reason in UNMET else ALMOST
            if nearest.missing < enough and not space.broken(nearest.x, None):
                return Point(space, nearest.x)
        return replace(found, missing=nearest.missing) if isinstance(found, Bound) else found

    def _searched(self, compromise: Compromise | None, nearest: Nearest) -> Point | Bound:
        """The same by Newton's method with the slopes of `Space.reading`; also keeps the nearest point."""
        space, bound = self.start.space, compromise.bound if compromise else None
        closed = not space.slow
        enough = ENOUGH if bound and closed else ALMOST if closed else SLOW_ALMOST
        free = space.free if compromise is None else np.r_[space.free, compromise.coordinate]
        x, before = self.start.x, None
        blocked, least, waited = dict[int, int](), np.inf, 0
        for n in range(ROUNDS if closed else SLOW_ROUNDS):
            # See what is missing, and how that changes
            known = n == 0 and bound is None
            reading = self.start.reading if known else space.reading(x, free, before)
            before = x, reading
            missing, slopes = self._equations(compromise, reading, x, free)
            if not (np.all(np.isfinite(slopes)) and np.all(np.isfinite(missing))):
                break
            nearest.keep(x, missing[: len(space.free)])

            # Give up where nothing gets nearer
            off = float(np.max(np.abs(missing)))
            least, waited = (off, 0) if off < NEARER * least else (least, waited + 1)
            if not closed and waited > SLOW_PATIENCE:
                break

            # Move, within bounds
            moved: Array = np.asarray(np.linalg.lstsq(slopes, -missing, rcond=1e-12)[0], float)
            full = x.copy()
            full[free] += self._within_reach(moved, x, free)
            x = space.clipped(full)
            outside = {int(c) for c in free if abs(full[c] - x[c]) > SLACK}

            # End where nothing is missing, or where a coordinate keeps meeting its bound
            met = n > 0 and np.max(np.abs(missing)) < enough
            if met and not outside:
                found = Reading(self.goal, reading.slopes[:, : len(space.free)])
                return space.broken(x, bound) or Point(space, x, found)
            blocked = {c: blocked.get(c, 0) + 1 for c in outside}
            if held := [c for c, times in blocked.items() if times > (1 if closed else PATIENCE)]:
                return space.bound_at(min(held), full)
        return space.broken(x, bound) or bound or self._in_the_way(nearest)

    def _approach(self, nearest: Nearest, readings: int, giving: bool) -> None:
        """Keep the nearest point that secants read, from the nearest one so far.

        giving: whether what absorbs between lobes moves, too, which may be needed for roughnesses below 1.
        """
        space, start = self.start.space, nearest.x.copy()
        depths = [own.depth for own in space.interfaces if giving and own.depth is not None]
        free = np.r_[space.free, depths].astype(int)

        def placed(values: Array) -> Array:
            x = start.copy()
            x[free] = values
            return space.clipped(x)

        def read(values: Array) -> Array:
            x = placed(values)
            missing = self._scaled(space.read(x[:, None])[:, 0] - self.goal)
            nearest.keep(x, missing)
            return missing

        def differences(values: Array, missing: Array) -> Array:
            return self._scaled(space.differences(placed(values), free).slopes)

        low, high = (end[free] for end in space.box)
        Secants(read, differences, units(start[free]), low, np.maximum(high, low + SLACK)).nearest(
            start[free], read(start[free]), readings, ALMOST
        )

    def _in_the_way(self, nearest: Nearest) -> Bound:
        """The bound that stops a search that does not end: that of the coordinate whose reading misses most."""
        space = self.start.space
        if ends := self._ends(nearest):
            return ends[0]
        return space.unmet(int(space.counted[nearest.worst]))

    def _ends(self, nearest: Nearest) -> list[Bound]:
        """The bounds that the coordinate lies on whose reading misses most."""
        space, x = self.start.space, nearest.x
        worst = int(space.free[nearest.worst])
        return [b for b in space.bounds if b.coordinate == worst and len(x) and abs(x[worst] - b.at) <= SLACK]

    def _equations(self, compromise: Compromise | None, reading: Reading, x: Array, free: Array) -> tuple[Array, Array]:
        """The shortfall of a reading from the goal, and its slopes.

        In a compromise one equation more, that the point lies on a bound.
        """
        missing, slopes = self._scaled(reading.value - self.goal), self._scaled(reading.slopes)
        if compromise is None:
            return missing, slopes
        margin, change = self.start.space.margin_slopes(compromise.bound, x, free)
        return np.r_[missing, margin], np.vstack([slopes, change])

    def _scaled(self, x: Array) -> Array:
        """The readings, or their slopes, that count, in units of the goal."""
        return (x[self.start.space.counted].T / self._scale).T

    @cached_property
    def _scale(self) -> Array:
        """Energies are seen against the brightest channel of their lobe."""
        k = 3 * self.start.space.lobes
        brightest = np.repeat(self.goal[:k].reshape(-1, 3).max(axis=1), 3)
        return np.r_[np.maximum(brightest, 1e-3), np.abs(self.goal[k:]) + 0.01][self.start.space.counted]

    def _within_reach(self, moved: Array, x: Array, free: Array) -> Array:
        """A step of some coordinates, not further than what their slopes are good for.

        Broyden's slopes hold along the steps that were taken: there all of a step is shortened alike, and variances,
        which rough interfaces follow less and less, have a reach, too.
        """
        space = self.start.space
        if not space.slow:
            reach = space.reach(self.start.x, HALF, LITTLE)[free]
            return np.clip(moved, -reach, reach)
        reach = space.reach(x, FURTHER, LITTLE)
        for own in space.interfaces:
            reach[own.variance] = BLURRED if space.folded else 0.5 * np.abs(x[own.variance]).max() + 0.02
        return moved * min(1.0, float(np.min(reach[free] / np.maximum(np.abs(moved), ops.TINY))))
