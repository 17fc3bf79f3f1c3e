"""Tables of reflectance as CSV, in degrees and 1/sr."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from velatura.errors import InvalidInput
from velatura.inverse.fitting.angles import Directions, ReflectanceTable
from velatura.inverse.measured import rows

IN_PLANE = ("theta_i", "theta_o", "phi", "r", "g", "b")
ALL_AZIMUTHS = ("theta_i", "phi_i", "theta_o", "phi_o", "r", "g", "b")


def read(path: Path) -> ReflectanceTable:
    """The table in a CSV file, all of it. Raises InvalidInput, in one line that names the file and the line in it."""
    text = rows.text_of(path)
    try:
        lines = list(csv.reader(io.StringIO(text, newline="")))
    except csv.Error as error:
        raise InvalidInput(f"{path}: cannot be read: {error}") from None
    columns = tuple(cell.strip() for cell in lines[0]) if lines else ()
    if columns not in (IN_PLANE, ALL_AZIMUTHS):
        raise InvalidInput(f"{path}: line 1: must be {','.join(IN_PLANE)} or {','.join(ALL_AZIMUTHS)}")
    numbers = [rows.row(f"{path}: line {n}", line, columns) for n, line in enumerate(lines[1:], 2) if line]
    if not numbers:
        raise InvalidInput(f"{path}: holds no directions")
    column = dict(zip(columns, np.array(numbers).T))
    azimuth = column.get("phi_i", 0.0)
    phi = column["phi"] if columns == IN_PLANE else column["phi_o"] - azimuth
    directions = Directions.of(column["theta_i"], column["theta_o"], phi, azimuth)
    return ReflectanceTable(directions, np.array([column[name] for name in "rgb"]))
