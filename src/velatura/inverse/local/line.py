"""The lobes nearest to a wish on the straight line to it from present ones.

The line leads through readings, energies and variances, so that what a wish does not change stays. The nearest lobes
are the last ones on it that a stack is found for: a part of the way. Where that is all of it, the wish is met.
"""

from __future__ import annotations

import dataclasses
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
DARK, FAINT, SMALL = 1e-3, 1e-4, 0.01  # energies, and variance that is added, for units of readings
NEARLY, INNER, COARSE = 0.1, 5e-3, 1e-3  # of that, and of the last miss, what the model that is followed may miss
TRUST, LIMIT = 3.0, 0.99  # units of coordinates that measured slopes are good for, and a share that is all of it
FOLLOWED, GOOD = 0.05, 0.25  # misses that are small, and shares of a change, below which a step may be longer
SLOWLY, ASTRAY = 0.7, 0.2  # the share of the last miss that is no progress, and misses that lead nowhere
BESIDE = 10.0  # part of the way that it is worth to be as much nearer to the line


@dataclass(frozen=True)
class Reached:
    """The last point of a line that is found: the part of the way, what readings miss the line by, and the bound there.

    The bound is None at the end of the line. settled: whether the search ended there.
    """

    point: Point
    part: float
    off: float
    bound: Bound | None
    settled: bool = True


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

    def last(self, readings: int, thorough: bool = False) -> Reached:
        """The last point of the line that has a stack within the bounds.

        Of a model that is slow, the nearest one that adds up layers is followed, corrected by what the two differ by at
        the points that are read (space mapping, Bandler et al. 1994), and by how that changes from one to the next
        (Broyden's method). readings: of a slow model, at most. thorough: also by its slopes at the start, and where
        that does not lead to the line, by shorter steps, unless these slopes take more than half of the readings.
        """
        space, x = self.start.space, self.start.x
        if not space.slow:
            correction = _Correction.none(space, x)
            x, _ = self._followed(space, x, correction, MET)
            return self._bounded(self._reached(x, space.read(x[:, None])[:, 0]), correction)
        adder, value, trust = space.quickly, self.start.reading.value, np.inf
        centre = _Correction.none(space, x).at(x, value, adder.read(x[:, None])[:, 0])
        best, last, settled = (self._reached(x, value), centre), np.inf, False
        if thorough:
            moving = np.setdiff1d(np.arange(len(x)), [*self.held, *self._resting]).astype(int)
            if 2 * len(moving) > readings:
                return self._bounded(*best)
            centre, trust, readings = centre.measured(space, moving), TRUST, readings - len(moving)
        correction = centre
        for _ in range(readings):
            nearly = min(max(INNER * last, NEARLY * self.enough), COARSE)
            x, near = self._followed(adder, correction.x, correction, nearly, trust)
            before, value = value, space.read(x[:, None])[:, 0]
            missed, change = (self._apart(value, of) for of in (correction.value_of(x, near), before))
            limited = bool(np.any(np.abs(x - correction.x) > LIMIT * trust * units(correction.x)))
            correction = correction.at(x, value, near)
            best = max(best, (self._reached(x, value), correction), key=lambda each: self._worth(each[0]))
            settled = max(missed, nearly) < self.enough and not limited
            astray = missed > (ASTRAY if thorough else max(FOLLOWED, SLOWLY * last))
            if settled or (astray and not thorough):
                break
            if astray:
                correction, trust = centre, trust / 4
            elif missed < max(FOLLOWED, GOOD * change):
                trust = 2 * trust
            centre, last = correction, missed
        return dataclasses.replace(self._bounded(*best), settled=settled)

    def _apart(self, a: Array, b: Array) -> float:
        """The largest difference of two readings."""
        return float(np.abs((a - b) / self._scale).max())

    def _worth(self, reached: Reached) -> float:
        """How far a point is on the line, less what it is off it."""
        return 1 - abs(1 - reached.part) - BESIDE * reached.off

    def _followed(
        self, space: Space, x: Array, correction: _Correction, enough: float, trust: float = np.inf
    ) -> tuple[Array, Array]:
        """The last point of the line as a corrected model in closed form reads it, and what that reads uncorrected.

        Coordinates that are kept move only where the others do not meet the goal. trust: the longest way, in units of
        coordinates.
        """
        far = trust * units(x)
        box = np.maximum(space.box[0], x - far), np.minimum(space.box[1], x + far)
        held = np.array(list(self.held), int)
        every, free = np.setdiff1d(np.arange(len(x)), held), np.setdiff1d(space.free, [*held, *self._resting])
        kept = np.clip(self.start.x, *box)
        kept[free] = x[free]
        tried, missing, near = self._descended(space, kept, correction, free, box, ALONG[0], enough)
        if missing > max(self.enough, enough):
            tried, missing, near = self._descended(space, x, correction, every, box, ALONG[0], enough)
        if missing > max(self.enough, enough):
            tried, missing, near = self._descended(space, tried, correction, every, box, ALONG[1], enough)
        return tried, near

    def _descended(
        self,
        space: Space,
        x: Array,
        correction: _Correction,
        free: Array,
        box: tuple[Array, Array],
        along: float,
        enough: float,
    ) -> tuple[Array, float, Array]:
        """The nearest point by weighted squares, what it misses, and its reading without correction: Gauss-Newton
        within the bounds."""
        near = self._reading(space, x, free)
        reading, rows, reach = correction.of(x, near, free), self._rows(along), 1.0
        off = float(np.linalg.norm(rows @ (self.goal - reading.value)))
        for _ in range(ROUNDS):
            if off < enough:
                break
            missing = rows @ (self.goal - reading.value)
            far, size = reach * self._reach(x)[free], self._units(x)[free]
            tried = step_within(space, box, x, missing, rows @ reading.slopes, free, far, size, self.caps)
            there = self._reading(space, tried, free)
            corrected = correction.of(tried, there, free)
            nearer = float(np.linalg.norm(rows @ (self.goal - corrected.value)))
            ends = nearer > (1 - ENOUGH) * off
            if nearer < off:
                x, near, reading, off, reach = tried, there, corrected, nearer, min(1.0, 2 * reach)
            else:
                reach *= 0.3
                ends = reach < CLOSE
            if ends:
                break
        return x, off, near.value

    def _reading(self, space: Space, x: Array, free: Array) -> Reading:
        """A reading in closed form, which the next search begins with."""
        key = x.tobytes(), free.tobytes()
        if key not in self._known:
            self._known[key] = space.reading(x, free)
        return self._known[key]

    @cached_property
    def _known(self) -> dict[tuple[bytes, bytes], Reading]:
        return {}

    def placed(self, value: Array) -> tuple[float, float]:
        """The part of the way of a reading, and what it misses the line by."""
        gone = (value - self.origin) / self._scale
        way, counted = self._way, self.start.space.counted
        far = float(way[counted] @ way[counted])
        part = float(gone[counted] @ way[counted]) / far if far > MET**2 else 1.0
        return part, float(np.abs((gone - part * way)[counted]).max())

    def _reached(self, x: Array, value: Array) -> Reached:
        part, off = self.placed(value)
        return Reached(Point(self.start.space, x, Reading(value, np.empty((len(value), 0)))), part, off, None)

    def _bounded(self, reached: Reached, correction: _Correction) -> Reached:
        """A point with the bound there, unless it is the end of the line."""
        way = float(np.abs(self._way[self.start.space.counted]).max(initial=0.0))
        there = abs(1 - reached.part) * way < 10 * self.enough
        return reached if there else dataclasses.replace(reached, bound=self._bound(reached.point.x, correction))

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

    @cached_property
    def _resting(self) -> list[int]:
        """Coordinates of the lobes above the first one that the way changes: what lies below changes nothing there."""
        first = next((k for k in range(self.start.space.lobes) if self._changed(k)), 0)
        above = [own for own in self.start.space.interfaces if own.lobe < first]
        spans = [span for own in above for span in (own.variance, own.reflectances) if span is not None]
        return [n for span in spans for n in range(span.start, span.stop)]

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
    """Difference of a slow model from the one in its place, near a point x: value (R,), and its slopes (R, D).

    Readings and coordinates count as logarithms where they are more than `least` (R,) and the unit of coordinates, so
    that slopes are exponents: of rough facets, readings follow powers of coordinates.
    """

    x: Array
    least: Array
    value: Array
    slopes: Array

    @classmethod
    def none(cls, space: Space, x: Array) -> _Correction:
        variances = len(space.interfaces) * space.entries
        least = np.r_[np.full(3 * space.lobes, FAINT), np.full(variances, SMALL)]
        return cls(x, least, np.zeros_like(least), np.zeros((len(least), len(x))))

    def value_of(self, x: Array, near: Array) -> Array:
        """The reading `near` at a point, corrected."""
        more = _logarithms(near, self.least) + self.value + self.slopes @ self._step(x)
        return np.asarray(np.sign(more) * self.least * np.expm1(np.abs(more)))

    def of(self, x: Array, near: Reading, free: Array) -> Reading:
        """A reading, corrected."""
        value = self.value_of(x, near.value)
        sizes = np.abs(value) + self.least, np.abs(near.value) + self.least
        slopes = near.slopes / sizes[1][:, None] + self.slopes[:, free] / units(x[free])
        return Reading(value, sizes[0][:, None] * slopes)

    def at(self, x: Array, value: Array, near: Array) -> _Correction:
        """The correction that is read at another point, its slopes changed by what they miss (Broyden)."""
        step, now = self._step(x), _logarithms(value, self.least) - _logarithms(near, self.least)
        missed = now - self.value - self.slopes @ step
        return _Correction(x, self.least, now, self.slopes + np.outer(missed, ops.divide(step, step @ step)))

    def measured(self, space: Space, moving: Array) -> _Correction:
        """The correction with the slopes along some coordinates that differences of both models have."""
        slopes = np.zeros_like(self.slopes)
        for sign, model in ((1, space), (-1, space.quickly)):
            reading = model.differences(self.x, moving)
            slopes[:, moving] += sign * reading.slopes / (np.abs(reading.value) + self.least)[:, None]
        return dataclasses.replace(self, slopes=slopes * units(self.x))

    def _step(self, x: Array) -> Array:
        return _logarithms(x, units(0 * x)) - _logarithms(self.x, units(0 * x))


def _logarithms(x: Array, least: Array) -> Array:
    """Numbers of any sign, on a scale that is that of logarithms beyond `least`."""
    return np.asarray(np.sign(x) * np.log1p(np.abs(x) / least))
