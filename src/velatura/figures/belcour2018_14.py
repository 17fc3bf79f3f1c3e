"""Belcour 2018, figure 14: gold under a scattering medium that grows deeper.

g = 0.7, no absorption and a scattering coefficient of 1, as printed; the depths, the gold's alpha of 0.01 and the
object, a hollow ball, are chosen here. Beside the medium as published stands the one that scatters many times.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from velatura.figures import canvas, cells
from velatura.stack import Interface, Medium, Stack

DEPTHS = (0.1, 0.5, 1.0)
COLUMNS: cells.Columns = {
    medium: ("belcour2018", {"reflectance": "fgd", "tir": "published", "medium": medium})
    for medium in ("shipped", "doubled")
}


def stack(depth: float) -> Stack:
    """The medium over gold."""
    medium = Medium(depth=depth, sigma_s=1.0, g=0.7)
    return Stack([medium, Interface(conductor="Au", alpha=0.01)])


def compute(
    depths: Sequence[float] = DEPTHS,
    size: int = canvas.SIZE,
    spp: int = cells.SAMPLES,
    paths: int = cells.PATHS,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """A cell for each depth: see `cells.compute`.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    stacks = {f"depth {depth:g}": stack(depth) for depth in depths}
    return cells.compute(stacks, COLUMNS, cells.Quality(size, spp, paths), seed, progress, "ball")


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """A row for each depth: the truth, and beside it both media and what they have too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path)


if __name__ == "__main__":
    draw(compute(), "belcour2018-14.png")
