"""Yamaguchi et al. 2019, figure 6: three layered materials against the truth, with the RMSE of each.

The materials are (a), (b) and (d) of its figure 4, as chosen there, on a sphere, the fields being straight: along
circles of latitude or across them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from velatura.figures import canvas, cells
from velatura.figures.yamaguchi2019_04 import COLUMNS, SPREAD, stack

STACKS = {
    "(a)": stack(0.1, 0.0, 0.1, 0.0),
    "(b)": stack(0.05, 0.0, SPREAD, 0.0),
    "(d)": stack(SPREAD, 0.0, SPREAD, 90.0),
}


def compute(
    stacks: Sequence[str] = tuple(STACKS),
    size: int = canvas.SIZE,
    spp: int = cells.SAMPLES,
    paths: int = cells.PATHS,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """A cell for each of the materials: see `cells.compute`.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    return cells.compute(
        {name: STACKS[name] for name in stacks}, COLUMNS, cells.Quality(size, spp, paths), seed, progress
    )


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """A column for each material: the truth, the model, and what it has too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path)


if __name__ == "__main__":
    draw(compute(), "yamaguchi2019-06.png")
