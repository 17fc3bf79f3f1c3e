"""Yamaguchi et al. 2019, figure 7: two brushed layers whose directions are 90, 60 or 30 degrees apart.

Indices and roughnesses are those chosen for its figure 4 (d), on a sphere in the studio. The metal is brushed along
circles of latitude.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from velatura.figures import canvas, cells
from velatura.figures.yamaguchi2019_04 import COLUMNS, SPREAD, stack

GAPS = (90, 60, 30)  # degrees


def compute(
    gaps: Sequence[float] = GAPS,
    size: int = canvas.SIZE,
    spp: int = cells.SAMPLES,
    paths: int = cells.PATHS,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """A cell for each gap: see `cells.compute`.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    stacks = {f"{gap:g}°": stack(SPREAD, float(gap), SPREAD, 0.0) for gap in gaps}
    return cells.compute(stacks, COLUMNS, cells.Quality(size, spp, paths), seed, progress)


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """A column for each gap: the truth, the model, and what it has too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path)


if __name__ == "__main__":
    draw(compute(), "yamaguchi2019-07.png")
