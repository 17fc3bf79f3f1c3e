"""Tables in text files: lines of two numbers, the first ones ascending; what follows # is a comment."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

from velatura.files import number, text_of

Table: TypeAlias = tuple[Sequence[float], Sequence[float]]

LARGEST = 2**20  # bytes of a file


def read(path: Path, first: str, firsts: str) -> list[tuple[float, float]]:
    """The rows of a file, finite; `first` is what the first column holds, and `firsts` its plural.

    Raises:
        ValueError: the file holds no such rows; one line that names the file, without its content.
    """
    rows: list[tuple[float, float]] = []
    for at, line in enumerate(text_of(path, LARGEST).splitlines(), start=1):
        cells = line.partition("#")[0].replace(",", " ").split()
        if not cells:
            continue
        try:
            place, value = map(number, cells)
        except ValueError:
            raise ValueError(f"{path}: line {at}: must be {first} and a value") from None
        if not (math.isfinite(place) and math.isfinite(value)):
            raise ValueError(f"{path}: line {at}: must be finite")
        if rows and place <= rows[-1][0]:
            raise ValueError(f"{path}: line {at}: {firsts} must ascend")
        rows.append((place, value))
    return rows
