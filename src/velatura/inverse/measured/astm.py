"""Measurements as text by ASTM E1392: a header, `VARS` with the names of columns, and lines of numbers, in radians."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from velatura.errors import InvalidInput
from velatura.inverse.fitting.angles import Directions, ReflectanceTable, evenly
from velatura.inverse.measured import rows
from velatura.stack import spectra
from velatura.stack.schema import show

ANGLES = ("theta_i", "phi_i", "theta_s", "phi_s")
TAKEN = 3000  # directions
DEGREES = 180 / np.pi  # of a radian
NANOMETRES = re.compile(r"([0-9.]+) ?nm")


def read(path: Path) -> ReflectanceTable:
    """Colours of at most `TAKEN` directions, evenly many of all.

    The columns after the angles are one of any name, `R,G,B`, `X,Y,Z` (D65), or wavelengths as `550nm`.

    Raises:
        InvalidInput: it is none; one line that names the file and the line in it.
    """
    lines = rows.text_of(path).splitlines()
    head = next((n for n, line in enumerate(lines) if line.split()[:1] == ["VARS"]), None)
    if head is None:
        raise InvalidInput(f"{path}: is no text by ASTM E1392: no line begins with VARS")
    columns = tuple(name.strip() for name in lines[head].partition("VARS")[2].split(","))
    if columns[:4] != ANGLES or len(set(columns)) != len(columns):
        raise InvalidInput(f"{path}: line {head + 1}: VARS must be {','.join(ANGLES)} and names of values")
    in_rgb = _in_rgb(f"{path}: line {head + 1}", columns[4:])
    numbered = [(n, line.split(",")) for n, line in enumerate(lines[head + 1 :], head + 2) if line.strip()]
    if not numbered:
        raise InvalidInput(f"{path}: holds no directions")
    numbers = np.array([_row(f"{path}: line {n}", cells, columns) for n, cells in numbered])
    kept = evenly(len(numbers), TAKEN)
    theta_i, phi_i, theta_s, phi_s = numbers[kept, :4].T
    return ReflectanceTable(Directions.of(theta_i, theta_s, phi_s - phi_i, phi_i), in_rgb @ numbers[kept, 4:].T)


def _row(where: str, cells: list[str], columns: tuple[str, ...]) -> list[float]:
    """The numbers of a line, with angles in degrees."""
    if len(cells) == len(columns):
        angles = [rows.number(f"{where}: {name}", cell) * DEGREES for name, cell in zip(ANGLES, cells)]
        cells = [repr(angle) for angle in angles] + cells[4:]
    return rows.row(where, cells, columns)


def _in_rgb(where: str, names: tuple[str, ...]) -> np.ndarray:
    """The matrix (3, N) from the values of a direction to linear sRGB."""
    upper = tuple(name.upper() for name in names)
    if upper in (("R", "G", "B"), ("RED", "GREEN", "BLUE")):
        return np.eye(3)
    if upper == ("X", "Y", "Z"):
        return np.array(spectra.SRGB_FROM_XYZ)
    if len(names) == 1:
        return np.ones((3, 1))
    found = [NANOMETRES.fullmatch(name) for name in names]
    if names and all(found):
        wavelengths = np.array([rows.number(where, each[1]) for each in found if each])
        if (np.diff(wavelengths) > 0).all():
            return spectra.srgb_of_samples(wavelengths)
    allowed = "one value, R,G,B, X,Y,Z, or wavelengths that ascend, 550nm for one"
    raise InvalidInput(f"{where}: values must be {allowed}, got {show(','.join(names))}")
