"""Cubic interpolation that rises and falls only where the values do (Fritsch and Butland 1984).

The same as SciPy's `PchipInterpolator`, which takes a quarter of a second to import.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def interpolated(nodes: Array, values: Array, places: Array) -> Array:
    """Values (..., N) at rising nodes (N,), two at least, interpolated at places between the first and the last one."""
    step = np.diff(nodes)
    rise = np.diff(values) / step
    slopes = _slopes(step, rise)
    cell = np.clip(np.searchsorted(nodes, places, side="right") - 1, 0, len(step) - 1)
    begin, end, mean = slopes[..., :-1], slopes[..., 1:], rise
    bend = (begin + end - 2 * mean) / step
    x = places - nodes[cell]
    # Powers of the distance from the node below
    cubic, square = (bend / step)[..., cell], ((mean - begin) / step - bend)[..., cell]
    found: Array = ((cubic * x + square) * x + begin[..., cell]) * x + values[..., :-1][..., cell]
    return found


def _slopes(step: Array, rise: Array) -> Array:
    """Slopes at the nodes: harmonic means of those beside them, 0 where these turn."""
    if len(step) == 1:
        return np.repeat(rise, 2, axis=-1)
    before, after = 2 * step[1:] + step[:-1], step[1:] + 2 * step[:-1]
    low, high = rise[..., :-1], rise[..., 1:]
    same = low * high > 0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # of flat parts
        inner = np.where(same, (before + after) / (before / low + after / high), 0.0)
    first = _end(step[0], step[1], rise[..., 0], rise[..., 1])
    last = _end(step[-1], step[-2], rise[..., -1], rise[..., -2])
    return np.concatenate([first[..., None], inner, last[..., None]], axis=-1)


def _end(step: float, following: float, rise: Array, then: Array) -> Array:
    """Slope at an end, by a parabola through three nodes, kept to the side that the values go to."""
    slope = ((2 * step + following) * rise - step * then) / (step + following)
    slope = np.where((rise * then <= 0) & (np.abs(slope) > 3 * np.abs(rise)), 3 * rise, slope)
    kept: Array = np.where(slope * rise > 0, slope, 0.0)
    return kept
