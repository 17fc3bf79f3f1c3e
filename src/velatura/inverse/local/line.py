"""The lobes nearest to a wish on the straight line to it from present ones.

The line leads through readings, energies and variances, so that what a wish does not change stays. The nearest lobes
are the last ones on it that a stack is found for: a part of the way. Where that is all of it, the wish is met.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from velatura import ops
from velatura.inverse.lobes.partial_stack import Array
from velatura.inverse.local.approach import FURTHER, LITTLE, step_within
from velatura.inverse.local.coordinates import SLACK, Bound, Point, Reading, Space, units

ALONG = (1.0, 1e-4)  # weights of the way along the line, beside 1 of what leads off it: at first, and in the end
ROUNDS, ENOUGH, CLOSE = 16, 1e-3, 1e-3  # of steps, the share by which the last gets nearer, and the shortest
BLURRED = 0.05  # change of a variance in one step, at least
KEPT = 0.1  # units of coordinates that are kept, as long as others do as well
EXACT, MET = 1e-6, 1e-9  # by which readings of a slow model, and of one in closed form, may miss their place
CHANGED = 1e-4  # by which a wish changes a reading at least, in those units
DARK, SMALL = 1e-3, 0.01  # energy, and variance that is added, for units in which readings miss the line


@dataclass(frozen=True)
class Reached:
    """The last point of a line that is found: the part of the way, what readings miss the line by, and the bound there.

    The bound is None at the end of the line.
    """

    point: Point
    part: float
    off: float
    bound: Bound | None


@dataclass(frozen=True)
class Line:
    """The line from a reading `origin` to the reading `goal`, (3 K + V I,), and the stack from which it is looked for.

    held: coordinates that keep their values. caps: coordinates that stay below others. enough: by which readings may
    miss their place on the line, in units of their size.
    """

    start: Point
    origin: Array
    goal: Array
    held: Collection[int] = ()
    caps: Sequence[tuple[int, int]] = ()
    enough: float = EXACT

    def last(self, readings: int) -> Reached:
        """The last point of the line that has a stack within the bounds.

        Of a model that is slow, the nearest one that adds up layers is followed, corrected by what the two differ by at
        the points that are read (space mapping, Bandler et al. 1994), and by how that changes from one to the next
        (Broyden's method). readings: of a slow model, at most.
        """
        space, x = self.start.space, self.start.x
        if not space.slow:
            x = self._followed(space, x, _Correction.none(x, self.goal))
            return self._reached(x, space.read(x[:, None])[:, 0], _Correction.none(x, self.goal))
        adder, value = space.quickly, self.start.reading.value
        correction = _Correction(x, value - adder.read(x[:, None])[:, 0], np.zeros((len(value), len(x))))
        best, least = None, np.inf
        for _ in range(readings):
            x = self._followed(adder, x, correction)
            near, value = adder.read(x[:, None])[:, 0], space.read(x[:, None])[:, 0]
            missed = np.abs((value - near - correction.more(x)) / self._scale).max()
            correction = correction.at(x, value - near)
            found = self._reached(x, value, correction)
            if found.off < max(least, self.enough):
                best, least = found, found.off
            if missed < self.enough:
                break
        assert best is not None
        return best

    def _followed(self, space: Space, x: Array, correction: _Correction) -> Array:
        """The last point of the line as a corrected model in closed form reads it.

        Coordinates that are kept move only where the others do not meet the goal.
        """
        held = np.array(list(self.held), int)
        every, free = np.setdiff1d(np.arange(len(x)), held), np.setdiff1d(space.free, held)
        kept = self.start.x.copy()
        kept[free] = x[free]
        tried, missing = self._descended(space, kept, correction, free, ALONG[0])
        if missing > self.enough:
            tried, missing = self._descended(space, x, correction, every, ALONG[0])
        return tried if missing <= self.enough else self._descended(space, tried, correction, every, ALONG[1])[0]

    def _descended(
        self, space: Space, x: Array, correction: _Correction, free: Array, along: float
    ) -> tuple[Array, float]:
        """The nearest point by weighted squares, and what it misses: Gauss-Newton within the bounds."""
        reading, rows, reach = correction.of(x, space.reading(x, free), free), self._rows(along), 1.0
        for _ in range(ROUNDS):
            missing = rows @ (self.goal - reading.value)
            off = float(np.linalg.norm(missing))
            if off < MET:
                break
            far, size = reach * self._reach(x)[free], self._units(x)[free]
            tried = step_within(space, x, missing, rows @ reading.slopes, free, far, size, self.caps)
            there = correction.of(tried, space.reading(tried, free), free)
            nearer = float(np.linalg.norm(rows @ (self.goal - there.value)))
            if nearer < off:
                x, reading, reach = tried, there, min(1.0, 2 * reach)
            else:
                reach *= 0.3
            if nearer > (1 - ENOUGH) * off and (nearer < off or reach < CLOSE):
                break
        return x, float(np.linalg.norm(rows @ (self.goal - reading.value)))

    def _reached(self, x: Array, value: Array, correction: _Correction) -> Reached:
        gone = (value - self.origin) / self._scale
        way, counted = self._way, self.start.space.counted
        far = float(way[counted] @ way[counted])
        part = float(gone[counted] @ way[counted]) / far if far > MET**2 else 1.0
        off = float(np.abs((gone - part * way)[counted]).max())
        point = Point(self.start.space, x, Reading(value, np.empty((len(value), 0))))
        there = abs(1 - part) * float(np.abs(way[counted]).max(initial=0.0)) < 10 * self.enough
        return Reached(point, part, off, None if there else self._bound(x, correction))

    def _bound(self, x: Array, correction: _Correction) -> Bound:
        """The bound that keeps a point from going further: the one that it would leave with the steepest gain."""
        space = self.start.space
        free = np.setdiff1d(np.arange(len(x)), np.array(list(self.held), int))
        reading = correction.of(x, space.quickly.reading(x, free), free)
        rows = self._rows(ALONG[-1])
        gain = np.zeros(len(x))
        gain[free] = (rows @ reading.slopes).T @ (rows @ (self.goal - reading.value)) * units(x[free])
        steep: list[tuple[float, Bound]] = []
        for bound in space.bounds:
            if abs(space.margins([bound], x[:, None])[0, 0]) > 100 * SLACK:
                continue
            if bound.coordinate is not None:
                gained = -bound.sign * gain[bound.coordinate]
            else:
                _, change = space.margin_slopes(bound, x, free)
                gained = -float(change * units(x[free]) @ gain[free]) / max(float(np.linalg.norm(change)), ops.TINY)
            if gained > 0:
                steep.append((gained, bound))
        own = [each for each in steep if self._changed(each[1].lobe)]
        if steep:
            return max(own or steep, key=lambda each: each[0])[1]
        counted = space.counted
        return space.unmet(int(counted[np.argmax(np.abs(self._way[counted]))]))

    def _changed(self, lobe: int) -> bool:
        """Whether the way leads to other energies or variances of a lobe."""
        way = np.abs(self._way) > CHANGED
        variances = way[3 * self.start.space.lobes :].reshape(len(self.start.space.interfaces), -1)
        own = [variances[n].any() for n, part in enumerate(self.start.space.interfaces) if part.lobe == lobe]
        return bool(way[3 * lobe : 3 * lobe + 3].any() or any(own))

    @cached_property
    def _scale(self) -> Array:
        """Units of readings: of energies the brightest channel of their lobe."""
        count = 3 * self.start.space.lobes
        most = np.maximum(np.abs(self.origin), np.abs(self.goal))
        brightest = np.repeat(most[:count].reshape(-1, 3).max(axis=1), 3)
        return np.r_[np.maximum(brightest, DARK), most[count:] + SMALL]

    @cached_property
    def _way(self) -> Array:
        """All of the way, in these units."""
        return np.asarray((self.goal - self.origin) / self._scale)

    def _rows(self, along: float) -> Array:
        """Weighted sums of readings: all that leads off the line, and the way along it."""
        counted = self.start.space.counted
        own = self._way[counted]
        forward = own / max(float(np.linalg.norm(own)), ops.TINY)
        rows = np.zeros((len(counted) + 1, len(self.goal)))
        rows[:, counted] = np.vstack([np.eye(len(counted)) - np.outer(forward, forward), along * forward])
        return np.asarray(rows / self._scale)

    def _reach(self, x: Array) -> Array:
        """The longest steps of coordinates."""
        space = self.start.space
        reach = space.reach(x, FURTHER, LITTLE)
        for own in space.interfaces:
            reach[own.variance] = FURTHER * np.abs(x[own.variance]).max() + BLURRED
        return reach

    def _units(self, x: Array) -> Array:
        """Units of coordinates, small for those that are kept."""
        size = KEPT * units(x)
        size[self.start.space.free] /= KEPT
        return size


@dataclass(frozen=True)
class _Correction:
    """Difference of a slow model from the one in its place, near a point x: value (R,), and its slopes (R, D)."""

    x: Array
    value: Array
    slopes: Array

    @classmethod
    def none(cls, x: Array, like: Array) -> _Correction:
        return cls(x, np.zeros_like(like), np.zeros((len(like), len(x))))

    def more(self, x: Array) -> Array:
        """The correction of a reading at a point."""
        return np.asarray(self.value + self.slopes @ (x - self.x))

    def of(self, x: Array, reading: Reading, free: Array) -> Reading:
        """A reading, corrected."""
        return Reading(reading.value + self.more(x), reading.slopes + self.slopes[:, free])

    def at(self, x: Array, value: Array) -> _Correction:
        """The correction that is read at another point, its slopes changed by what they miss (Broyden)."""
        step = x - self.x
        along = step / units(x) ** 2
        missed = value - self.value - self.slopes @ step
        return _Correction(x, value, self.slopes + np.outer(missed, ops.divide(along, along @ step)))
