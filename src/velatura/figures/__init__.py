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

FIGURES = (
    "before-after",
    "cost-error",
    "films-under-coats",
    "bati2021-01",
    "bati2021-04",
    "bati2021-05",
    "bati2021-06",
    "bati2021-07",
    "bati2021-08",
    "bati2021-09",
    "bati2021-10",
    "bati2021-11",
    "bati2021-12",
    "bati2021-14",
    "bati2021-15",
    "bati2021-16",
    "bati2021-17",
    "bati2021-18",
    "bati2021-19",
    "bati2021-20",
    "bati2021-21",
    "bati2021-22",
    "bati2021-23",
    "bati2021-24",
    "bati2021-25",
    "belcour2018-01",
    "belcour2018-03",
    "belcour2018-04",
    "belcour2018-05",
    "belcour2018-06",
    "belcour2018-07",
    "belcour2018-08",
    "belcour2018-11",
    "belcour2018-12",
    "belcour2018-13",
    "belcour2018-14",
    "belcour2018-15",
    "belcour2018-16",
    "belcour2018-17",
    "belcour2018-18",
    "belcour2018-19",
    "belcour2018-20",
    "belcour2018-21",
    "belcour2018-22",
    "belcour2018-table2",
    "linear-space",
    "weier2020-01",
    "weier2020-04",
    "weier2020-05",
    "weier2020-06",
    "weier2020-07",
    "weier2020-08",
    "weier2020-09",
    "weier2020-10",
    "weier2020-11",
    "weier2020-12",
    "weier2020-13",
    "weier2020-14",
    "weier2020-table2",
    "yamaguchi2019-01",
    "yamaguchi2019-02",
    "yamaguchi2019-03",
    "yamaguchi2019-04",
    "yamaguchi2019-05",
    "yamaguchi2019-06",
    "yamaguchi2019-07",
    "yamaguchi2019-08",
)


class Figure(Protocol):
    """The interface of a figure."""

    def compute(self, *, progress: Progress | None = None) -> dict[str, Any]:
        """The numbers; `progress` is called with (steps done, all steps).

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
