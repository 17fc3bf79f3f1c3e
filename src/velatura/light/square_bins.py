"""Light over equal squares of the projected disc, whose x and y are those of directions, from -1 to 1."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

BINS = 40  # along a side


def grids(points: Array, energy: Array, group: Any = 0, count: int = 1, bins: int = BINS) -> Array:
    """Energies (C, count, bins, bins) of light that arrives at points (2, n) of the disc with energies (C, n).

    group: number (n,) of the grid that each point belongs to.
    """
    x, y = np.clip((0.5 * (points + 1) * bins).astype(int), 0, bins - 1)
    cell = (group * bins + x) * bins + y
    found = [np.bincount(cell, channel, count * bins * bins) for channel in energy]
    return np.array(found, float).reshape(len(found), count, bins, bins)
