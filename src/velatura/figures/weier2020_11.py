"""Weier & Belcour 2020, figure 11: coats of many roughnesses, isotropic and anisotropic, over a smooth metal.

The indices are those of figure 10, the metal's alpha is 0.05, as printed; the coats' roughnesses are chosen here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from velatura.figures import canvas, cells
from velatura.figures.weier2020_10 import ALPHAS, COLUMNS, stack


def compute(
    alphas: Sequence[tuple[float, float]] = ALPHAS,
    size: int = canvas.SIZE,
    spp: int = cells.SAMPLES,
    paths: int = cells.PATHS,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """A cell for each roughness of the coat: see `cells.compute`.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    stacks = {f"coat {u:g}, {v:g}": stack((u, v), (0.05, 0.05)) for u, v in alphas}
    return cells.compute(stacks, COLUMNS, cells.Quality(size, spp, paths), seed, progress)


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """A column for each roughness: the truth, the model, and what it has too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path, exposure=0.4)


if __name__ == "__main__":
    draw(compute(), "weier2020-11.png")
