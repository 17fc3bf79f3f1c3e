"""Measurements of the MERL database (Matusik et al. 2003): isotropic, over half-vector and difference angles."""

from __future__ import annotations

from math import prod
from pathlib import Path

import numpy as np

from velatura import files
from velatura.errors import InvalidInput
from velatura.inverse.fitting.angles import ReflectanceTable
from velatura.inverse.measured import half_angles

LARGEST = 2**27  # bytes
SCALES = np.array([1.0, 1.15, 1.66]) / 1500  # of red, green and blue


def read(path: Path) -> ReflectanceTable:
    """A file of three numbers of steps, then all of red, of green and of blue, the azimuth running first.

    Raises:
        InvalidInput: it is none; one line that names the file.
    """
    content = files.content(path, LARGEST)
    counts = [int(n) for n in np.frombuffer(content[: len(content) // 4 * 4][:12], "<i4")]
    if len(counts) < 3 or min(counts) < 1 or len(content) != 12 + 24 * prod(counts):
        raise InvalidInput(f"{path}: is no MERL file, three counts and then as many numbers for each colour")
    value = np.frombuffer(content[12:], "<f8").reshape(3, *counts) * SCALES[:, None, None, None]
    if not np.isfinite(value).all():
        raise InvalidInput(f"{path}: holds values that are no finite numbers")

    # Bins at their centres; tilts of half-vectors are close where lobes are sharp
    tilt, apart, turn = ((np.arange(n) + 0.5) / n for n in counts)
    return half_angles.thinned(
        path, 90 * tilt**2, 90 * apart, 180 * turn, lambda a, b, c: value[:, a[:, None, None], b[:, None], c]
    )
