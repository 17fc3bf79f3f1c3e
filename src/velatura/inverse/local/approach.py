"""The lobes nearest to some that a stack may not be able to have.

Every stack that is read lies within the bounds of its coordinates, so that there is an answer at any time.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from velatura import ops
from velatura.inverse.lobes.partial_stack import Array, Mask
from velatura.inverse.local.coordinates import Bound, Point, Reading, Space, units
from velatura.optics import fresnel

MAY, STAYS = (0.03, 1e-4), 1.0  # weights of lobes that may change, at first and in the end, and of others
ALIKE = 10.0  # weight of how the blurs of a lobe's interfaces differ
STILL = 1e-7  # weight of the coordinates themselves, where readings leave them open
ON_BOUND = 1e3  # weight of a bound that no box of coordinates expresses
BOUNDS, HALVINGS = 4, 40  # of these in one step, and of a step that breaks one of them nevertheless
ROUNDS, ENOUGH, CLOSE = 10, 1e-3, 1e-2  # of steps, the share by which the last gets nearer, and the shortest
FURTHER, LITTLE = 0.7, 0.01  # share of a reflectance by which it changes in a step, and least change
MET = 1e-8  # what is missing where all is met
SETTLED = 0.9  # share of what was missing, above which corrections end
DAMPED, DAMPINGS = 1e-3, 3  # share of slopes that damps steps at first, and tenfold ones that are tried
SLOW, COARSE = 0.02, 1e-4  # shares of squares that a step gains, below which slopes are differences again, or it ends
FAINT, BLURRED = 1e-4, 0.01  # energy and variance that is added before logarithms are compared


@dataclass(frozen=True)
class Approach:
    """The problem: a start, the readings (3 K + V I,) that are wanted, which of them may change, and what is held.

    held: coordinates that keep their values. caps: coordinates that stay below others.
    """

    start: Point
    goal: Array
    loose: Mask
    held: Collection[int] = ()
    caps: Sequence[tuple[int, int]] = ()

    def solve(self, readings: int) -> Point:
        """The nearest point, by weighted squares, of those that are read.

        Of a model that is slow, the nearest one that adds up layers descends, to a goal that is shifted by what the two
        differ by at the last point; so each reading is one more correction.
        """
        space, goal = self.start.space, self._seen(self.goal)
        x = best = space.clipped(self.start.x)
        if not space.slow:
            return Point(space, self._descended(space, x, goal))
        adder, found, least = space.quickly, np.empty(0), np.inf
        for _ in range(readings):
            read = space.read(x[:, None])[:, 0]
            off = float(np.linalg.norm(self._rows(MAY[-1]) @ (goal - self._seen(read))))
            gained = off < SETTLED * least
            if off < least:
                best, found, least = x, read, off
            if not gained or off < MET:
                break
            x = self._descended(adder, x, goal + self._seen(adder.read(x[:, None])[:, 0]) - self._seen(read))
        return Point(space, best, Reading(found, np.empty((len(found), 0))))

    def _descended(self, space: Space, x: Array, goal: Array) -> Array:
        """The nearest point to a goal, as it is seen, for a model in closed form: Gauss-Newton within the bounds.

        What may change weighs more at first, so that what stays may be missed on the way.
        """
        free = np.setdiff1d(np.arange(len(x)), np.array(list(self.held), int))
        reading = space.reading(x, free)
        value = self._seen(reading.value)
        for may in MAY:
            rows, reach = self._rows(may), 1.0
            for _ in range(ROUNDS):
                slopes = reading.slopes * self._stretch(reading.value)[:, None]
                missing = rows @ (goal - value)
                off = float(np.linalg.norm(missing))
                if off < MET:
                    return x
                far = reach * space.reach(x, FURTHER, LITTLE)[free]
                tried = step_within(space, space.box, x, missing, rows @ slopes, free, far, units(x[free]), self.caps)
                there = space.reading(tried, free)
                now = self._seen(there.value)
                nearer = float(np.linalg.norm(rows @ (goal - now)))
                if nearer < off:
                    x, value, reading, reach = tried, now, there, min(1.0, 2 * reach)
                else:
                    reach *= 0.3
                if nearer > (1 - ENOUGH) * off and (nearer < off or reach < CLOSE):
                    break
        return x

    @property
    def _logarithmic(self) -> Array:
        """Offsets of readings whose logarithms are seen: of energies, and of variances along axes; 0 of others."""
        space, count = self.start.space, 3 * self.start.space.lobes
        of_variance = [0.0 if field.name == "xy" else BLURRED for field in dataclasses.fields(space.kind)]
        return np.r_[np.full(count, FAINT), np.tile(of_variance, len(space.interfaces))]

    def _seen(self, reading: Array) -> Array:
        """A reading as it is compared."""
        more = self._logarithmic
        return np.where(more > 0, np.log(np.maximum(reading, 0.0) + np.where(more > 0, more, 1.0)), reading)

    def _stretch(self, reading: Array) -> Array:
        """The derivative of `_seen`."""
        more = self._logarithmic
        return np.where(more > 0, 1 / (np.maximum(reading, 0.0) + np.where(more > 0, more, 1.0)), 1.0)

    def _rows(self, may: float) -> Array:
        """Weighted sums of readings: energies, of every lobe the mean variances and how those of neighbours differ.

        may: weight of what may change.
        """
        space, count = self.start.space, 3 * self.start.space.lobes
        weight = np.where(self.loose, may, STAYS)
        rows = list(np.diag(weight)[:count])
        for k in range(space.lobes):
            own = [n for n, part in enumerate(space.interfaces) if part.lobe == k]
            first = count + space.entries * own[0]
            size = np.abs(self.goal[first : first + space.entries]).max() + BLURRED
            for entry in range(space.entries):
                at = [count + space.entries * n + entry for n in own]
                unit = 1.0 if self._logarithmic[at[0]] > 0 else 1 / size
                row = np.zeros(len(self.goal))
                row[at] = weight[at[0]] * unit / len(at)
                rows.append(row)
                for two in pairwise(at):
                    apart = np.zeros(len(self.goal))
                    apart[list(two)] = ALIKE * unit, -ALIKE * unit
                    rows.append(apart)
        return np.array(rows)


def step_within(
    space: Space,
    box: tuple[Array, Array],
    x: Array,
    missing: Array,
    slopes: Array,
    free: Array,
    far: Array,
    size: Array,
    caps: Sequence[tuple[int, int]] = (),
) -> Array:
    """The point, within the bounds, to which a step of some coordinates leads that makes up best for what is missing.

    slopes: over coordinates `free`. far, size: of these, the longest steps and units. caps: coordinates that stay below
    others.
    """
    low, high = (end[free] - x[free] for end in box)
    for below, above in caps:
        high[free == below] = x[above] - x[below]
    low, high = np.maximum(low, -far) / size, np.minimum(high, far) / size
    high = np.maximum(high, low + 1e-12)
    a, b = slopes * size, missing
    kept: list[Bound] = []
    step = np.zeros(len(free))
    for _ in range(BOUNDS):
        step = bounded_step(a, b, STILL, low, high) * size
        broken = space.broken(_moved(x, step, free), None)
        if broken is None or broken in kept:
            break
        kept.append(broken)
        margin, change = space.margin_slopes(broken, x, free)
        a = np.vstack([a, ON_BOUND * change * size])
        b = np.r_[b, -ON_BOUND * margin]
    for _ in range(HALVINGS):
        tried = _capped(space, _moved(x, step, free))
        if space.broken(tried, None) is None:
            return tried
        step = step / 2
    return x


def _moved(x: Array, step: Array, free: Array) -> Array:
    moved = x.copy()
    moved[free] += step
    return moved


def _capped(space: Space, x: Array) -> Array:
    """A point whose dielectrics reflect no more than indices within bounds do."""
    x, above = x.copy(), space.exterior
    for n, own in enumerate(space.interfaces):
        if own.log_index is not None:
            above = float(np.exp(x[own.log_index]))
        elif own.kind == "dielectric":
            ends = np.exp([bound.at for bound in space.bounds if bound.interface == n])
            end = max(ends) if own.side > 0 else min(ends)
            x[own.reflectances] = np.minimum(x[own.reflectances], fresnel.normal_incidence(end / above))
            above = space.index(x, n)
    return x


@dataclass
class Secants:
    """Damped steps within bounds (Levenberg, Marquardt) to where least is missing, of what takes long to read.

    Slopes are differences, and then follow from each reading (Broyden's method), until steps gain little.

    read: what is missing at a point (D,). differences: the slopes at a point, given what is missing there; they take D
    readings. size: units of coordinates.
    """

    read: Callable[[Array], Array]
    differences: Callable[[Array, Array], Array]
    size: Array
    low: Array
    high: Array

    def nearest(self, x: Array, missing: Array, readings: int, enough: float = 0.0) -> tuple[Array, Array]:
        """The nearest point of those read, and what is missing there, from one that is read; not more readings than are
        given, and none once nothing misses more than is enough."""
        slopes, fresh, damping, tried = np.empty(0), False, DAMPED, 0
        while readings > (0 if len(slopes) else len(x)) and np.abs(missing).max() > enough:
            if not len(slopes):
                slopes, fresh, readings = self.differences(x, missing) * self.size, True, readings - len(x)
            # Steps see no more of what is missing than the slopes span
            span, own = np.linalg.qr(slopes)
            reach = (self.low - x) / self.size, (self.high - x) / self.size
            step = bounded_step(own, -span.T @ missing, damping * np.linalg.norm(own, axis=0).max(), *reach)
            there = np.clip(x + step * self.size, self.low, self.high)
            found, readings = self.read(there), readings - 1
            slopes = slopes + np.outer(found - missing - slopes @ step, ops.divide(step, step @ step))
            gained = 1 - float(found @ found) / max(float(missing @ missing), ops.TINY)
            if gained > 0:
                x, missing, damping, tried = there, found, damping / 10, 0
            else:
                damping, tried = 10 * damping, tried + 1
            if gained < (COARSE if fresh else SLOW) and tried in (0, DAMPINGS):
                if fresh:
                    break
                slopes, tried = np.empty(0), 0
            fresh = fresh and gained <= 0
        return x, missing


def bounded_step(slopes: Array, missing: Array, damping: float, low: Array, high: Array) -> Array:
    """The step within bounds that makes up best for what is missing, damped (Levenberg, Marquardt)."""
    from scipy.optimize import lsq_linear  # slow to load

    count = slopes.shape[1]
    a, b = np.vstack([slopes, damping * np.eye(count)]), np.r_[missing, np.zeros(count)]
    return np.clip(lsq_linear(a, b, (low, high), method="bvls").x, low, high)
