"""The lobes nearest to a wish on the straight line to it from present ones.

The line leads through readings, energies and variances, so that what a wish does not change stays. The nearest lobes
are the last ones on it that a stack is found for: a part of the way. Where that is all of it, the wish is met.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from velatura import ops
from velatura.inverse.lobes.partial_stack import Array, Mask
from velatura.inverse.local.approach import FURTHER, LITTLE, step_within
from velatura.inverse.local.coordinates import SLACK, SMOOTH, Bound, Point, Reading, Space, rounded, units

ALONG = (1.0, 1e-4)  # weights of the way along the line, beside 1 of what leads off it: at first, and in the end
ROUNDS, CLOSE = 16, 1e-3  # of steps, and the shortest
ENOUGH, HARDLY = 1e-3, 0.1  # the share by which the last step gets nearer: of all coordinates, and while some are kept
BLURRED = 0.05  # change of a variance in one step, at least
KEPT = 0.1  # units of coordinates that are kept, as long as others do as well
EXACT, QUICK = 1e-6, 2e-3  # by which readings of a slow model may miss their place, at rest and under the hand
MET = 1e-9  # the same of a model in closed form
ON_LINE, QUICKLY_ON_LINE = QUICK, 5e-3  # what an answer may miss the line by, at rest and under the hand
CHANGED = 1e-4  # by which a wish changes a reading at least, in those units
DARK, FAINT, SMALL = 1e-3, 1e-4, 0.01  # energies, and variance that is added, for units of readings
NEARLY, INNER, COARSE = 0.1, 5e-3, 1e-3  # of that, and of the last miss, what the model that is followed may miss
FOLLOWED, ASTRAY = 0.05, 0.5  # misses that are small, and first ones that lead nowhere
SLOWLY, NEAR = 0.7, 0.015  # the share of the last miss that is no progress, and misses from which the way goes on
SEEN, BACK = 0.03, 0.7  # of the way that is gone astray: the least that counts, and the share to go
FURTHER_ON, ONWARDS, SHORT = 2.0, 0.02, 2e-3  # steps along the line: by an easy last one, anew, and the least
LANDING, LANDINGS = 4, 2  # readings that lead back to the line, and searches that do, at the end
LOWER = 0.01  # by how much less is aimed at first if they do not
BRIGHTEST, FOLDED = 1.0, 1 - 1e-3  # the largest energy, and variance, folded, that a correction leads to
DIGITS, KNOWN = 7, 9  # of readings of a slow model, and of all else that the search goes on with
BENT = 0.5  # by how much corrections are off their slopes, as a share of the square of a distance
ROUNDED = 10**-DIGITS  # the same, at least
BESIDE = 10.0  # part of the way that it is worth to be as much nearer to the line
HOPE, PATIENCE = 0.5, 4  # share of a miss that a reading must be expected to leave at most, and readings in vain


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
    miss their place on the line, in units of their size. known: readings in closed form, by points.
    """

    start: Point
    origin: Array
    goal: Array
    held: Collection[int] = ()
    caps: Sequence[tuple[int, int]] = ()
    enough: float = EXACT
    known: dict[tuple[bytes, bytes], Reading] = field(default_factory=dict)

    def last(self, readings: Sequence[int], whole: bool = False) -> Reached:
        """The last point of the line that has a stack within the bounds.

        Of a model that is slow, the nearest one that adds up layers is followed, corrected by what the two differ by at
        the points that are read (space mapping, Bandler et al. 1994): see `_Search`.

        readings: of a slow model, at most, of one search and of those that go on from where the last one ended, unless
        that got nowhere; as many as the first may follow until the point is exact, if that is asked for. whole: whether
        only all of the way counts, so that points off the line do as well, and a search ends where nothing leads on.
        """
        space, x = self.start.space, self.start.x
        if not space.slow:
            correction = _Correction.none(space, x)
            x, _ = self._followed(space, x, correction, MET)
            return self._bounded(self._reached(x, space.read(x[:, None])[:, 0]), correction)
        search = _Search.of(self)
        if whole:
            search.end(readings[0])
            if search.settled and self.enough < QUICK:
                search.exact(self)
                search.end(readings[0])
            settled = search.settled
        else:
            for n, most in enumerate(readings):
                before = search.best[0].part
                search.go(most)
                if search.settled or (n and search.best[0].part < before + ONWARDS):
                    break
            settled = search.settled
            for _ in range(LANDINGS):
                search.land(readings[0])
                if search.best[0].off < QUICKLY_ON_LINE:
                    break
            if self.enough < QUICK:
                search.refine(self, readings[0])
        best = search.best[1].unrounded
        found = self._bounded(self._reached(best.x, best.value), _Correction.fitted(space, search.read, best))
        return dataclasses.replace(found, settled=settled)

    def _aimed(self, part: float) -> Line:
        """The line as far as a part of the way."""
        return self if part == 1 else dataclasses.replace(self, goal=self.origin + part * (self.goal - self.origin))

    @property
    def allowed(self) -> float:
        """Largest distance from the line that an answer may have."""
        return QUICKLY_ON_LINE if self.enough >= QUICK else ON_LINE

    def _apart(self, a: Array, b: Array) -> float:
        """The largest difference of two readings."""
        return float(np.abs((a - b) / self._scale).max())

    def _worth(self, reached: Reached) -> tuple[bool, float]:
        """Whether a point is on the line, and how far, less what it is off it."""
        return reached.off < self.allowed, 1 - abs(1 - reached.part) - BESIDE * reached.off

    def _followed(self, space: Space, x: Array, correction: _Correction, enough: float) -> tuple[Array, Array]:
        """The last point of the line as a corrected model in closed form reads it, and what that reads uncorrected.

        Coordinates that are kept move only where the others do not meet the goal.
        """
        box = space.box
        every = self._moving
        free = np.setdiff1d(np.intersect1d(space.free, every), self._resting)
        kept = np.clip(self.start.x, *box)
        kept[free] = x[free]
        ends = list[tuple[Array, float, Array]]()
        for start, moving, least in ((kept, free, HARDLY), (x, every, ENOUGH)):
            ends.append(self._descended(space, start, correction, moving, box, ALONG[0], enough, least))
            if ends[-1][1] <= max(self.enough, enough):
                return ends[-1][0], ends[-1][2]
        # What weighs the line leads to several ends; in closed form other searches follow, which look further
        last = ends if self.start.space.slow else ends[1:]
        ends = [self._descended(space, start, correction, every, box, ALONG[1], enough) for start, *_ in last]
        tried, _, near = min(ends, key=lambda end: end[1])
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
        least: float = ENOUGH,
    ) -> tuple[Array, float, Array]:
        """The nearest point by weighted squares, what it misses, and its reading without correction: Gauss-Newton
        within the bounds, as long as a step gets nearer by a share of at least `least`."""
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
            ends = nearer > (1 - least) * off
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
        if key not in self.known:
            self.known[key] = space.reading(x, free)
        return self.known[key]

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
        free = self._moving
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
    def _moving(self) -> Array:
        """Coordinates that may move: none that is held, nor blurs above a lobe that is smooth all along the way.

        The least of these would blur it: a model reads facets as rough as those that it draws, at least.
        """
        space, x = self.start.space, self.start.x
        read = np.abs([self.origin, self.goal])[:, 3 * space.lobes :].reshape(2, len(space.interfaces), -1)
        smooth = np.flatnonzero(read.max(axis=(0, 2)) < SMOOTH)
        above = [own.variance for own in space.interfaces[: smooth.max(initial=-1) + 1]]
        blurs = [n for span in above for n in range(span.start, span.stop) if np.abs(x[span]).max() < SMOOTH]
        return np.setdiff1d(np.arange(len(x)), np.array([*self.held, *blurs], int))

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
class _Read:
    """A point (D,), and the readings (R,) of a slow model, rounded and exact, and of the one in its place."""

    x: Array
    value: Array
    exact: Array
    near: Array

    @property
    def unrounded(self) -> _Read:
        return dataclasses.replace(self, value=self.exact)


@dataclass(frozen=True)
class _Correction:
    """Difference of a slow model from the one in its place, near a point x: value (R,), and its slopes (R, D).

    Readings and coordinates count as logarithms where they are more than `least` (R,) and the unit of coordinates, so
    that slopes are exponents: of rough facets, readings follow powers of coordinates. Variances are folded before, as
    those that are read follow those of interfaces less and less. blurs, blurred: which readings and which coordinates
    these are.
    """

    x: Array
    least: Array
    blurs: Mask
    blurred: Mask
    value: Array
    slopes: Array

    @classmethod
    def none(cls, space: Space, x: Array) -> _Correction:
        blurs = np.arange(3 * space.lobes + len(space.interfaces) * space.entries) >= 3 * space.lobes
        blurred = np.zeros(len(x), bool)
        for own in space.interfaces:
            blurred[own.variance] = True
        least, slopes = np.where(blurs, SMALL, FAINT), np.zeros((len(blurs), len(x)))
        return cls(x, least, blurs, blurred, slopes.sum(axis=1), slopes)

    def value_of(self, x: Array, near: Array) -> Array:
        """The reading `near` at a point, corrected."""
        more = _seen(near, self.least, self.blurs) + self.value + self.slopes @ self._step(x)
        # Where readings jump between points close together, slopes are steep, and no exponential may overflow
        most = np.log1p(np.where(self.blurs, FOLDED, BRIGHTEST) / self.least)
        found = self.least * np.expm1(np.minimum(np.abs(more), most))
        return np.asarray(np.sign(more) * found / (1 - self.blurs * found))

    def of(self, x: Array, near: Reading, free: Array) -> Reading:
        """A reading, corrected."""
        value = self.value_of(x, near.value)
        own, other = (_stretch(each, self.least, self.blurs)[:, None] for each in (value, near.value))
        stretch = _stretch(x, units(0 * x), self.blurred)
        return Reading(value, (other * near.slopes + self.slopes[:, free] * stretch[free]) / own)

    @classmethod
    def fitted(cls, space: Space, read: Sequence[_Read], at: _Read) -> _Correction:
        """The correction at one of the points that were read, its slopes by those at the others.

        Slopes are the likeliest where they are about 1, or 0 by coordinates that a reading does not follow, and where a
        difference that is read at a distance is off what they give by about `BENT` times its square.
        """
        here = cls.none(space, at.x)
        here = dataclasses.replace(here, value=here._difference(at))
        steps = np.array([here._step(each.x) for each in read if each is not at]).reshape(-1, len(at.x))
        gains = np.array([here._difference(each) - here.value for each in read if each is not at])
        gains, slopes = gains.reshape(-1, len(here.value)), np.empty_like(here.slopes)
        each, which = np.unique(space.followed, axis=0, return_inverse=True)
        for n, followed in enumerate(each):
            own, rows = np.ravel(which) == n, followed * steps
            weights = 1 / (BENT * np.linalg.norm(rows, axis=1)[:, None] ** 2 + ROUNDED)
            rows, right = weights * rows, weights * gains[:, own]
            slopes[own] = (rows.T @ np.linalg.solve(rows @ rows.T + np.eye(len(rows)), right)).T
        return dataclasses.replace(here, slopes=slopes)

    def _difference(self, read: _Read) -> Array:
        return _seen(read.value, self.least, self.blurs) - _seen(read.near, self.least, self.blurs)

    def _step(self, x: Array) -> Array:
        return np.asarray(np.subtract(*(_seen(each, units(0 * x), self.blurred) for each in (x, self.x))))


@dataclass
class _Search:
    """A search along a line, by a slow model.

    All of the way is aimed at first. Where that leads astray, the search goes back to the last point near the line, and
    aims at a part of the way: by how far it got, then on from there, in steps like the last ones. In the end it leads
    back to the line. All of this is the same for all answers; for an exact one, the search goes on from there. Where
    only the end of the line counts, the search is another one (`end`), which does not keep to the line.

    read: the points that corrections follow from. seen: all points so far, and where they are. base: the last point
    near the line. aim: part of the way. step: the length of steps. last: what was missed before, infinite of a new aim.
    landing, stuck: whether it leads back to the line, and whether it has begun anew from where it stood still. lower:
    by how much less is aimed at next where it does not get nearer to the line.
    """

    line: Line
    read: list[_Read]
    seen: list[tuple[Reached, _Read]]
    base: tuple[Reached, _Read]
    correction: _Correction
    aim: float = 1.0
    step: float = 1.0
    last: float = np.inf
    settled: bool = False
    landing: bool = False
    stuck: bool = False
    lower: float = LOWER

    @classmethod
    def of(cls, line: Line) -> _Search:
        """The search from the start of a line."""
        space, x, exact = line.start.space, line.start.x, line.start.reading.value
        value = rounded(exact, DIGITS)
        first = _Read(x, value, exact, space.quickly.read(x[:, None])[:, 0])
        origin, goal = rounded(line.origin, DIGITS), rounded(line.goal, DIGITS)
        line = dataclasses.replace(line, enough=max(line.enough, QUICK), origin=origin, goal=goal)
        begun = line._reached(x, value), first
        return cls(line, [first], [begun], begun, _Correction.fitted(space, [first], first))

    @property
    def best(self) -> tuple[Reached, _Read]:
        """The best point so far."""
        return max(self.seen, key=lambda each: self.line._worth(each[0]))

    def go(self, readings: int) -> None:
        """Read at most so many points, from the best one so far."""
        if len(self.read) > 1:
            self.base, self.landing, self.step = self.best, False, ONWARDS
            self._aimed(self.base[1], self.base[0].part + self.step)
        for left in range(readings, 0, -1):
            if self.step < SHORT and self.base[0].part <= 0:
                return
            if not self.landing and self.base[0].part > 0 and (left <= LANDING or self.step < SHORT):
                self.landing = True
                self._aimed(self.base[1], self.base[0].part, self.base[0].off)
            if self._ends():
                return

    def land(self, readings: int) -> None:
        """Read at most so many points more, which lead back to the line, unless the search has ended on it."""
        if not self._ended and self.best[0].off >= self.line.enough:
            self._landed(self.best)
            self._led(readings, self.best)

    def refine(self, line: Line, readings: int) -> None:
        """Read at most so many points more, until they miss no more than the line allows: on from where the search has
        ended, and if that leads elsewhere, from what was best so far."""
        missed, ended, before = self.line.enough, self._ended, self.best
        self.exact(line)
        if ended:
            self._aimed(self.seen[-1][1], self.aim, missed)
        else:
            before = self.best
            self._landed(before)
        self._led(readings, before)

    def end(self, readings: int) -> None:
        """Read at most so many points that lead to the end of the line, each from the nearest one so far: none that is
        not expected to be much nearer, and few that are not nearer."""

        line, counted = self.line, self.line.start.space.counted

        def missed(value: Array) -> float:
            return float(np.abs((value - line.goal) / line._scale)[counted].max())

        for left in range(readings, -1, -1):
            nearest = min(self.read, key=lambda read: missed(read.value))
            far = missed(nearest.value)
            self.settled = far < line.enough
            if self.settled or not left or all(nearest is not each for each in self.read[-PATIENCE:]):
                return
            self._aimed(nearest, 1.0, far)
            # What is kept stays where it is, or else as it was at first: either may lead nowhere
            for kept in (nearest.x, line.start.x):
                x, near, expected = self._tried(kept)
                if missed(expected) <= max(line.enough, HOPE * far):
                    self._read(x, near)
                    break
            else:
                return

    def exact(self, line: Line) -> None:
        """Go on by exact readings, as exactly as the line asks for."""
        self.line = line
        self.read = [each.unrounded for each in self.read]
        self.seen = [(at, each.unrounded) for at, each in self.seen]

    @property
    def _ended(self) -> bool:
        """Whether the search has ended near the line."""
        return self.settled and self.seen[-1][0].off <= QUICKLY_ON_LINE

    def _led(self, readings: int, before: tuple[Reached, _Read]) -> None:
        """Read at most so many points; where that leads elsewhere, back to the line from a point before."""
        for _ in range(readings):
            if self._ends():
                return
            if not self.landing and self.last == np.inf:
                self._landed(before)

    def _landed(self, at: tuple[Reached, _Read]) -> None:
        """Go back to the line from a point near it."""
        self.base, self.landing, self.lower = at, True, LOWER
        self._aimed(at[1], at[0].part, at[0].off)

    def _aimed(self, at: _Read, part: float, last: float = np.inf) -> None:
        """Go on from a point that is read, to a part of the way."""
        self.correction = _Correction.fitted(self.line.start.space, self.read, at)
        self.aim, self.last = min(1.0, part), last

    def _tried(self, kept: Array) -> tuple[Array, Array, Array]:
        """The next point, its reading without correction, rounded, and the reading that is expected. kept: the point
        whose coordinates are kept."""
        space = self.line.start.space
        line = dataclasses.replace(self.line._aimed(self.aim), start=Point(space, kept))
        x, near = line._followed(space.quickly, self.correction.x, self.correction, self._nearly)
        x, near = rounded(x, KNOWN), rounded(near, KNOWN)
        return x, near, self.correction.value_of(x, near)

    @property
    def _nearly(self) -> float:
        """The most that the corrected model may miss."""
        return min(max(INNER * self.last, NEARLY * self.line.enough), COARSE)

    def _read(self, x: Array, near: Array) -> tuple[Reached, _Read]:
        """Read a point."""
        exact = self.line.start.space.read(x[:, None])[:, 0]
        value = exact if self.line.enough < QUICK else rounded(exact, DIGITS)
        now = _Read(x, value, exact, near)
        self.read.append(now)
        self.seen.append((self.line._reached(x, value), now))
        return self.seen[-1]

    def _ends(self) -> bool:
        """Read one more point; whether the search ends there."""
        line, enough = self.line, self.line.enough
        x, near, expected = self._tried(line.start.x)
        there, now = self._read(x, near)
        missed, hoped = line._apart(now.value, expected), line.placed(expected)[0]
        astray = missed > (ASTRAY if self.last == np.inf else max(FOLLOWED, SLOWLY * self.last))
        self.settled = max(missed, self._nearly) < enough and (self.aim == 1 or abs(hoped - self.aim) > enough)
        if self.settled and there.off > self.line.allowed:
            if not self.stuck:
                self.stuck, self.read = True, [now]
                self._aimed(now, self.aim)
                return False
            self.settled, astray = False, not self.landing
        if self.settled or (self.landing and there.off < enough):
            return True
        return not self._turned(now, there, missed, astray)

    def _turned(self, now: _Read, there: Reached, missed: float, astray: bool) -> bool:
        """Aim at the next part of the way, or at the same again; whether there is any: no way leads back to the line
        where that does not get nearer to its beginning."""
        base = self.base[0]
        gone, far = there.part - base.part, self.aim - base.part
        if self.landing:
            if there.off < max(self.line.allowed, self.last):
                self._aimed(now, self.aim, there.off)
            elif self.aim > self.lower:
                self._aimed(self.base[1], self.aim - self.lower)
                self.lower *= 2
            else:
                return False
        elif astray:
            self.step = BACK * gone if SEEN < gone < far else far / 4
            self._stepped()
        elif self.aim < 1 and max(missed, there.off, abs(there.part - self.aim)) < NEAR:
            self.step = gone if self.last < np.inf else FURTHER_ON * gone
            self.base = there, now
            self._stepped()
        else:
            self._aimed(now, self.aim, missed)
        return True

    def _stepped(self) -> None:
        """Aim one step further than the base."""
        self._aimed(self.base[1], self.base[0].part + self.step)


def _seen(x: Array, least: Array, folded: Mask) -> Array:
    """Numbers of any sign, some of them folded, on a scale that is that of logarithms beyond `least`."""
    size = np.abs(x)
    return np.asarray(np.sign(x) * np.log1p(np.where(folded, size / (1 + size), size) / least))


def _stretch(x: Array, least: Array, folded: Mask) -> Array:
    """The derivative of `_seen`."""
    size = np.abs(x)
    return np.where(folded, 1 / ((1 + size) * (least + (1 + least) * size)), 1 / (least + size))
