"""Zeros of many functions at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUNDS = 60


def false_position(
    function: Callable[[Array], Array], low: Array, high: Array, f_low: Array, f_high: Array, tolerance: float = 1e-9
) -> Array:
    """Zeros of the functions, to `tolerance`, given their values at both ends of the brackets, all of one shape.

    False position, with the value at an end that stays halved (the Illinois rule), is quick where functions are almost
    straight. Without a change of sign the answer is the end whose value is nearer to 0.
    """
    crosses = (f_low < 0) != (f_high < 0)
    x = np.where(np.abs(f_low) < np.abs(f_high), low, high)
    if not crosses.any():
        return x
    a, b, f_a, f_b = low, high, f_low, f_high
    side = np.zeros(np.shape(low))
    for _ in range(ROUNDS):
        step = np.divide(f_b * (b - a), f_b - f_a, out=np.zeros_like(side), where=f_b != f_a)
        x = np.where(crosses, b - step, x)
        f = function(x)
        if np.all(np.abs(np.where(crosses, f, 0.0)) < tolerance):
            break
        left = (f < 0) == (f_a < 0)
        stays = np.where(left, 1.0, -1.0)
        f_a, f_b = (
            np.where(left, f, np.where(side == stays, f_a / 2, f_a)),
            np.where(left, np.where(side == stays, f_b / 2, f_b), f),
        )
        a, b = np.where(left, x, a), np.where(left, b, x)
        side = stays
    return x


def bisect(holds: Callable[[Array], NDArray[np.bool_]], inside: Array, outside: Array, rounds: int = 50) -> Array:
    """The ends of a condition: the last points towards `outside` for which it holds."""
    for _ in range(rounds):
        middle = (inside + outside) / 2
        ok = holds(middle)
        inside, outside = np.where(ok, middle, inside), np.where(ok, outside, middle)
    return inside


def intervals(holds: Callable[[Array], NDArray[np.bool_]], grid: Array) -> list[tuple[float, float]]:
    """The intervals on which a condition holds, as resolved by a grid, with ends found by bisection."""
    ok = holds(grid)
    starts, ends = np.flatnonzero(ok & ~np.r_[False, ok[:-1]]), np.flatnonzero(ok & ~np.r_[ok[1:], False])
    if not len(starts):
        return []
    inside = np.r_[grid[starts], grid[ends]]
    outside = np.r_[grid[np.maximum(starts - 1, 0)], grid[np.minimum(ends + 1, len(grid) - 1)]]
    low, high = np.split(bisect(holds, inside, outside), 2)
    return list(zip(low.tolist(), high.tolist()))
