"""Numbers in lines of text, of directions and colours, each within its range."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from velatura import files
from velatura.errors import InvalidInput
from velatura.stack.schema import show

GRAZING, BRIGHTEST = 90.0, 1e9  # degrees: directions must be above the surface; 1/sr: more than any lobe has
LARGEST = 2**25  # bytes of a file of text


def text_of(path: Path) -> str:
    """The text of a file, with its numbers taken from the budget of what is read. Raises InvalidInput."""
    text = files.text_of(path, LARGEST)
    with files.budget() as left:
        left.spend(path, "values", text.count(",") + text.count("\n") + len(text.split()))
    return text


def row(where: str, cells: Sequence[str], columns: Sequence[str]) -> list[float]:
    """The numbers of a line: `theta...` and `phi...` are angles in degrees, all others are values in 1/sr.

    Raises:
        InvalidInput: not as many numbers as columns, or one out of range; one line that begins with `where`.
    """
    if len(cells) != len(columns):
        raise InvalidInput(f"{where}: must hold {len(columns)} numbers, {','.join(columns)}, got {len(cells)}")
    numbers: Mapping[str, float] = {name: number(f"{where}: {name}", cell) for name, cell in zip(columns, cells)}
    for name, value in numbers.items():
        if name.startswith("theta") and not 0 <= value < GRAZING:
            raise InvalidInput(f"{where}: {name}: must lie in 0 to 90 (excluded) degrees, got {value:g}")
        if name.startswith("phi") and not -360 <= value <= 360:
            raise InvalidInput(f"{where}: {name}: must lie in -360 to 360 degrees, got {value:g}")
        if not name.startswith(("theta", "phi")) and not abs(value) <= BRIGHTEST:
            raise InvalidInput(f"{where}: {name}: must lie in -{BRIGHTEST:g} to {BRIGHTEST:g}, got {value:g}")
    return list(numbers.values())


def number(where: str, text: str) -> float:
    """A finite number. Raises InvalidInput, in one line that begins with `where`, if it is none."""
    try:
        found = files.number(text)
    except ValueError:
        found = float("nan")
    if not np.isfinite(found):
        raise InvalidInput(f"{where}: must be a finite number, got {show(text.strip())}")
    return found
