"""Weier & Belcour 2020, figure 8: their roughness map against that of Belcour 2018, on a rough coat over a metal.

Index 1.5 over one of 0 + i, both of alpha 0.1, as printed; an index of 0 is 0.001 here. The scene is not printed: a
sphere in the studio. Both columns are the model `weier2020` and differ in the map alone.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from velatura.figures import canvas, cells
from velatura.stack import Interface, Stack

STACK = Stack([Interface(eta=1.5, alpha=0.1), Interface(eta=0.001, k=1.0, alpha=0.1)])
COLUMNS: cells.Columns = {
    name: ("weier2020", {"reflectance": "fresnel", "tir": "off", "map": name}) for name in ("belcour", "weier")
}


def compute(
    size: int = canvas.SIZE,
    spp: int = cells.SAMPLES,
    paths: int = cells.PATHS,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """One cell with two columns: see `cells.compute`.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    return cells.compute({"alpha 0.1": STACK}, COLUMNS, cells.Quality(size, spp, paths), seed, progress)


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """The truth, and below it each map's picture and what it has too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path, exposure=0.4)


if __name__ == "__main__":
    draw(compute(), "weier2020-08.png")
