"""Weier & Belcour 2020, figure 9: the map that treats each axis by itself, and the fit over both axes at once.

The material is not printed: here it is that of figure 10 with a metal of roughness 0.05 along the sphere's circles of
latitude and 0.4 across them. Both columns are the model `weier2020` and differ in the map alone.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from velatura.figures import canvas, cells
from velatura.figures.weier2020_10 import stack

STACKS = {"metal 0.05, 0.4": stack((0.05, 0.05), (0.05, 0.4))}
COLUMNS: cells.Columns = {
    name: ("weier2020", {"reflectance": "fresnel", "tir": "off", "map": name}) for name in ("weier-2d", "weier")
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
    return cells.compute(STACKS, COLUMNS, cells.Quality(size, spp, paths), seed, progress)


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """The truth, and beside it each map's picture and what it has too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path, exposure=0.4)


if __name__ == "__main__":
    draw(compute(), "weier2020-09.png")
