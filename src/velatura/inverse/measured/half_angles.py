"""Measurements of isotropic samples on a grid over half-vector and difference angles (Rusinkiewicz 1998)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from velatura.errors import InvalidInput
from velatura.inverse.fitting.angles import Directions, ReflectanceTable, evenly
from velatura.inverse.lobes.partial_stack import Array

TAKEN = (24, 9, 8)  # of half-vector tilts, differences and azimuths: enough for a stack's few values


def thinned(
    path: Path,
    tilt: Array,
    apart: Array,
    turn: Array,
    values: Callable[[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]], Array],
) -> ReflectanceTable:
    """Some of the directions of a grid.

    tilt, apart, turn: angles of the grid along its axes, in degrees. values: the BRDF, (3, A, B, C), of the A, B and C
    of them that are taken, negative or no number where nothing was measured.

    Raises:
        InvalidInput: none was measured; one line that names the file.
    """
    some = [evenly(len(axis), most) for axis, most in zip((tilt, apart, turn), TAKEN)]
    grid = np.meshgrid(*(axis[n] for axis, n in zip((tilt, apart, turn), some)), indexing="ij")
    directions = Directions.about_halves(*(angle.ravel() for angle in grid))
    found = values(*some).reshape(3, -1)
    seen = directions.above & (found.min(axis=0) >= 0)  # false of what is no number, too
    if not seen.any():
        raise InvalidInput(f"{path}: holds no directions")
    return ReflectanceTable(directions.take(seen), found[:, seen])
