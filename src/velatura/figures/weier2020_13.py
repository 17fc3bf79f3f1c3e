"""Weier & Belcour 2020, figure 13: failure at grazing angles, a brushed metal below a coat.

Roughnesses (0.05, 0.05) over (0.1, 0), as printed; the indices are those of figure 10, the sphere is chosen here.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from velatura.figures import canvas, cells
from velatura.figures.weier2020_10 import COLUMNS, stack

STACKS = {"brushed": stack((0.05, 0.05), (0.1, 0.0))}


def compute(
    size: int = canvas.SIZE,
    spp: int = cells.SAMPLES,
    paths: int = cells.PATHS,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """One cell: see `cells.compute`.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    return cells.compute(STACKS, COLUMNS, cells.Quality(size, spp, paths), seed, progress)


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """The truth, the model, and what it has too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path, exposure=0.4)


if __name__ == "__main__":
    draw(compute(), "weier2020-13.png")
