"""The papers' figures by name, one module each: it computes the numbers, and draws them.

    python -m velatura.figures.belcour2018_12

A figure is a module with `compute`, which takes what makes it quick or exact (paths, picture sizes, a seed, `progress`)
and returns plain numbers and lists, and `draw`, which makes a picture of them. What belongs to `pictures` among the
numbers are pixels, linear RGB in rows.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol, cast

from velatura.errors import InvalidInput
from velatura.stack.schema import show

Progress = Callable[[int, int], None]

FIGURES = (
    "bati2021-07",
    "bati2021-17",
    "bati2021-25",
    "belcour2018-11",
    "belcour2018-12",
    "belcour2018-13",
    "belcour2018-19",
    "belcour2018-21",
    "belcour2018-22",
    "belcour2018-table2",
    "linear-space",
)


class Figure(Protocol):
    """What a figure's module offers."""

    def compute(self, *, progress: Progress | None = None) -> dict[str, Any]:
        """The numbers; `progress` is called with (steps done, all steps)."""

    def draw(self, numbers: dict[str, Any], path: str | Path) -> None:
        """A picture of the numbers as a PNG, PDF or SVG, written whole or not at all."""


def figure(name: str) -> Figure:
    """The figure of that name. Raises InvalidInput for a name that none has."""
    if name not in FIGURES:
        raise InvalidInput(f"unknown figure {show(name)} (known: {', '.join(FIGURES)})")
    return cast(Figure, import_module(f"velatura.figures.{name.replace('-', '_')}"))
