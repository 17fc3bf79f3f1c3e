"""Tables in text files: lines of numbers, the first ones ascending; what follows # is a comment."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

from velatura.files import number, text_of

Table: TypeAlias = tuple[Sequence[float], Sequence[float]]

LARGEST = 2**20  # bytes of a file


def read(
    path: Path, first: str, firsts: str, others: Sequence[str] = ("a value",), head: Sequence[str] = ()
) -> list[tuple[float, ...]]:
    """The rows of a file, finite.

    Args:
        first: what the first column holds; `firsts` is its plural.
        others: what each column after it holds.
        head: names of the columns, which may stand above them.

    Raises:
        ValueError: the file holds no such rows; one line that names the file, without its content.
    """
    rows: list[tuple[float, ...]] = []
    for at, line in enumerate(text_of(path, LARGEST).splitlines(), start=1):
        cells = line.partition("#")[0].replace(",", " ").split()
        if not cells:
            continue
        if not rows and cells == [*head]:
            continue
        try:
            row = tuple(map(number, cells))
        except ValueError:
            row = ()
        if len(row) != 1 + len(others):
            raise ValueError(f"{path}: line {at}: must be {', '.join([first, *others[:-1]])} and {others[-1]}")
        if not all(map(math.isfinite, row)):
            raise ValueError(f"{path}: line {at}: must be finite")
        if rows and row[0] <= rows[-1][0]:
            raise ValueError(f"{path}: line {at}: {firsts} must ascend")
        rows.append(row)
    return rows
