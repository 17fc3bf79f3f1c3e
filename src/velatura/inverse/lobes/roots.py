"""Zeros of many functions at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUNDS, NARROW = 40, 1e-11  # of false position, and the width of a bracket that holds one number
COARSE, NARROWED = 1e-4, 6  # of zeros of functions that are known roughly, and halvings towards those that have none
ZOOMS, PEAKS, BETWEEN = 6, 8, 4  # of a grid about its highest peaks, and points between these and their neighbours


def false_position(
    function: Callable[[Array], Array], low: Array, high: Array, f_low: Array, f_high: Array, tolerance: float = 1e-9
) -> Array:
    """Zeros of the functions, to `tolerance`, given their values at both ends of the brackets, all of one shape.

    A bracket narrower than `NARROW` is its zero, regardless of how steep or discontinuous the function is there.

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
        if np.all(~crosses | (np.abs(f) < tolerance) | (np.abs(b - a) < NARROW)):
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


def first_crossing(function: Callable[[Array], Array], nodes: Array, each: Array) -> Array:
    """Zeros of functions between the first nodes (K,) where their values there, (K, ...), change sign; the first node
    where none does."""
    crosses = (each[1:] < 0) != (each[:-1] < 0)
    at = np.argmax(crosses, axis=0)
    f_low, f_high = (np.take_along_axis(each, n[None], axis=0)[0] for n in (at, at + 1))
    crossed = crosses.any(axis=0)
    low, high = np.where(crossed, nodes[at], nodes[0]), np.where(crossed, nodes[at + 1], nodes[0])
    return false_position(function, low, high, f_low, np.where(crossed, f_high, f_low), COARSE)


def nearest_to_zero(function: Callable[[Array], Array], nodes: Array, each: Array) -> Array:
    """Points where functions come nearest to 0, given their values (K, ...) at nodes (K,)."""
    width = abs(nodes[1] - nodes[0])
    best, off = nodes[np.argmin(np.abs(each), axis=0)], np.min(np.abs(each), axis=0)
    for _ in range(NARROWED):
        for side in (-0.5, 0.5):
            tried = np.clip(best + side * width, min(nodes[0], nodes[-1]), max(nodes[0], nodes[-1]))
            other = np.abs(function(tried))
            best, off = np.where(other < off, tried, best), np.minimum(other, off)
        width /= 2
    return best


def bisect(holds: Callable[[Array], NDArray[np.bool_]], inside: Array, outside: Array, rounds: int = 50) -> Array:
    """The ends of a condition: the last points towards `outside` for which it holds."""
    for _ in range(rounds):
        middle = (inside + outside) / 2
        ok = holds(middle)
        inside, outside = np.where(ok, middle, inside), np.where(ok, outside, middle)
    return inside


def intervals(margin: Callable[[Array], Array], grid: Array, rounds: int = 50) -> list[tuple[float, float]]:
    """The intervals on which a margin is not negative, with ends found by bisection.

    Those that a grid steps over are found where the margin has a peak between its points.
    """
    grid, value = _about_peaks(margin, grid)
    ok = value >= 0
    starts, ends = np.flatnonzero(ok & ~np.r_[False, ok[:-1]]), np.flatnonzero(ok & ~np.r_[ok[1:], False])
    if not len(starts):
        return []
    inside = np.r_[grid[starts], grid[ends]]
    outside = np.r_[grid[np.maximum(starts - 1, 0)], grid[np.minimum(ends + 1, len(grid) - 1)]]
    low, high = np.split(bisect(lambda x: margin(x) >= 0, inside, outside, rounds), 2)
    return list(zip(low.tolist(), high.tolist()))


def _about_peaks(margin: Callable[[Array], Array], grid: Array) -> tuple[Array, Array]:
    """The grid with more points about the peaks of a margin below 0, and the margin there."""
    value = margin(grid)
    for _ in range(ZOOMS):
        rises = np.pad(value, 1, constant_values=-np.inf)
        peaks = np.flatnonzero((value < 0) & np.isfinite(value) & (value >= rises[:-2]) & (value >= rises[2:]))
        if not len(peaks):
            break
        peaks = peaks[np.argsort(-value[peaks])[:PEAKS]]
        low, high = grid[np.maximum(peaks - 1, 0)], grid[np.minimum(peaks + 1, len(grid) - 1)]
        added = np.setdiff1d(np.linspace(low, high, 2 * BETWEEN + 1), grid)
        grid, found = np.r_[grid, added], margin(added) if len(added) else added
        order = np.argsort(grid)
        grid, value = grid[order], np.r_[value, found][order]
    return grid, value
