"""How the search of the inverse does beside SciPy's solvers, from the same stacks to the same lobes.

    python benchmarks/solvers.py [--wishes 60] [--model velatura] [--seed 0]

Wishes are those of `nearest.py`. `newton` is `inverse/local/newton.py`; `trf` and `dogbox` are methods of
`scipy.optimize.least_squares` on the same coordinates, bounds, units and slopes, which are differences for a model
without a closed form. Prints how many wishes each meets, and of those that all meet the processor's time and the
number of points that are read, slopes by differences included.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice

import numpy as np
from nearest import wishes
from rows import parsed, row
from scipy.optimize import least_squares

from velatura.inverse.lobes.partial_stack import Array
from velatura.inverse.local.coordinates import SLACK, Point, Space, units
from velatura.inverse.local.newton import ALMOST, Problem
from velatura.model import DEFAULT, named

METHODS = ("newton", "trf", "dogbox")
INSIDE, MOST = 1e-6, 30  # by which a start lies within bounds, as these methods ask for, and their evaluations


def by_newton(problem: Problem) -> bool:
    """Whether the goal is met."""
    return isinstance(problem.solve(), Point)


def by_scipy(problem: Problem, method: str) -> bool:
    """The same by a method of SciPy's."""
    start, space = problem.start, problem.start.space
    free = space.free
    low, high = (end[free] for end in space.box)
    high = np.maximum(high, low + SLACK)

    def placed(values: Array) -> Array:
        x = start.x.copy()
        x[free] = values
        return space.clipped(x)

    def missing(values: Array) -> Array:
        return problem._scaled(space.read(placed(values)[:, None])[:, 0] - problem.goal)

    def slopes(values: Array) -> Array:
        x = placed(values)
        return problem._scaled((space.differences(x, free) if space.slow else space.reading(x, free)).slopes)

    inside = INSIDE * np.where(np.isfinite(high - low), high - low, 1.0)
    first = np.clip(start.x[free], low + inside, high - inside)
    options = {"x_scale": units(start.x[free]), "xtol": 1e-9, "ftol": 1e-12, "gtol": 1e-12, "max_nfev": MOST}
    found = least_squares(missing, first, slopes, bounds=(low, high), method=method, **options)
    return bool(np.abs(found.fun).max() < ALMOST) and space.broken(placed(found.x), None) is None


@contextmanager
def counted(slow: bool) -> Iterator[list[int]]:
    """The number of points that are read by a model that is slow, or by one that is not."""
    count, read = [0], Space.read

    def counting(space: Space, x: Array) -> Array:
        count[0] += x.shape[1] if space.slow == slow else 0
        return read(space, x)

    Space.read = counting  # type: ignore[method-assign]
    try:
        yield count
    finally:
        Space.read = read  # type: ignore[method-assign]


def main() -> int:
    options = parsed(__doc__, wishes=60, model=DEFAULT, seed=0)
    results = {method: list[tuple[bool, float, int]]() for method in METHODS}
    for present, wish in islice(wishes(named(options.model), options.seed), options.wishes):
        goal = present.space.goal(wish)
        for method, found in results.items():
            problem = Problem(present.at(present.point.x.copy()).point, goal)
            with counted(present.space.slow) as count:
                begun = time.process_time()
                met = by_newton(problem) if method == "newton" else by_scipy(problem, method)
                found.append((met, time.process_time() - begun, count[0]))
    by_all = [all(found[n][0] for found in results.values()) for n in range(options.wishes)]
    for method, found in results.items():
        some = [each for each, kept in zip(found, by_all) if kept]
        read = np.mean([each[2] for each in some]) if some else 0
        times = [each[1] for each in some] or [0.0]
        met = sum(each[0] for each in found)
        row("solvers", method, times, remark=f"mean {np.mean(times):.4f} s; {read:.1f} points; {met} met")
    print(f"{options.model}: {sum(by_all)} of {options.wishes} wishes are met by all")
    return 0


if __name__ == "__main__":
    sys.exit(main())
