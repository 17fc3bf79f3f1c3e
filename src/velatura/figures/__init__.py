"""The papers' figures by name: modules and rows that compute the numbers, and draw them.

    velatura figure belcour2018-12

A figure is a module, or a row of `FIGURES` in the module of its paper. It has `compute`, which takes what makes it
quick or exact (paths, picture sizes, a seed, `progress`) and returns plain numbers and lists, and `draw`, which makes a
picture of them. What belongs to `pictures` among the numbers are pixels: linear RGB in rows, or one value each.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol, cast

from velatura.errors import InvalidInput
from velatura.stack.schema import show

Progress = Callable[[int, int], None]

#: Numbers of the figures of each paper; beside them, tables and figures of no paper.
NUMBERS = {
    "bati2021": (1, *range(4, 13), *range(14, 26)),
    "belcour2018": (1, *range(3, 9), *range(11, 23)),
    "weier2020": (1, *range(4, 15)),
    "yamaguchi2019": range(1, 9),
}
FIGURES = (
    *("before-after", "cost-error", "films-under-coats", "linear-space", "belcour2018-table2", "weier2020-table2"),
    *(f"{paper}-{number:02}" for paper, numbers in NUMBERS.items() for number in numbers),
)


class Figure(Protocol):
    """The interface of a figure."""

    def compute(self, *, progress: Progress | None = None, **options: Any) -> dict[str, Any]:
        """The numbers; `progress` is called with (steps done, all steps), `options` are the figure's own.

        Raises:
            InvalidInput, MissingTool: as `vt.render`, where there are pictures, or as `reference.statistics`.
        """

    def draw(self, numbers: dict[str, Any], path: str | Path) -> None:
        """A picture of the numbers as a PNG, WebP, PDF or SVG, written whole or not at all.

        Raises:
            InvalidInput: the file cannot be written.
            MissingTool: matplotlib is missing.
        """


def figure(name: str) -> Figure:
    """The figure of that name. Raises InvalidInput for a name that none has."""
    if name not in FIGURES:
        raise InvalidInput(f"unknown figure {show(name)} (known: {', '.join(FIGURES)})")
    module = import_module(f"{__name__}.{module_of(name)}")
    return cast(Figure, module.FIGURES[name] if name in getattr(module, "FIGURES", ()) else module)


def module_of(name: str) -> str:
    """The module of a figure: its own, or that of its paper, of which it is a row."""
    own = name.replace("-", "_")
    return own if (Path(__file__).parent / f"{own}.py").is_file() else own.partition("_")[0]
