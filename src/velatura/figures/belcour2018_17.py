"""Belcour 2018, figure 17: the variant for real time, the forward model, and the truth, on a coated metal.

Index 1.4 and alpha 0.01 over 1 + i of alpha 0.1, as printed, on a sphere in the studio. The variant for real time takes
Schlick's Fresnel from a split sum, and no correction for total internal reflection.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from velatura.figures import canvas, cells
from velatura.stack import Interface, Stack

STACKS = {"coated metal": Stack([Interface(eta=1.4, alpha=0.01), Interface(eta=1.0, k=1.0, alpha=0.1)])}
COLUMNS: cells.Columns = {
    "forward": ("belcour2018", {"reflectance": "fgd", "tir": "published"}),
    "realtime": ("realtime", {"reflectance": "split-sum", "tir": "off", "lobes": "two"}),
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
    """The truth, and beside it each model's picture and what it has too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path)


if __name__ == "__main__":
    draw(compute(), "belcour2018-17.png")
