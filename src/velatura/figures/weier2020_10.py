"""Weier & Belcour 2020, figure 10: a smooth coat over metals of many roughnesses, isotropic and brushed.

The coat has index 1.5 and alpha 0.05, the metal 0 + i, as printed; an index of 0 is 0.001 here. The roughnesses of the
metal are not legible in the paper and chosen here, as are the sphere, brushed around its axis, and the studio.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from velatura.figures import canvas, cells
from velatura.stack import Interface, Stack

ALPHAS = ((0.01, 0.01), (0.01, 0.1), (0.1, 0.1), (0.1, 0.3), (0.3, 0.3), (0.05, 0.5))
COLUMNS: cells.Columns = {"weier2020": ("weier2020", {"reflectance": "fresnel", "tir": "off"})}


def stack(coat: tuple[float, float], metal: tuple[float, float]) -> Stack:
    """The dielectric over the metal, of these roughnesses."""
    return Stack([Interface(eta=1.5, alpha=coat), Interface(eta=0.001, k=1.0, alpha=metal)])


def compute(
    alphas: Sequence[tuple[float, float]] = ALPHAS,
    size: int = canvas.SIZE,
    spp: int = cells.SAMPLES,
    paths: int = cells.PATHS,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """A cell for each roughness of the metal: see `cells.compute`.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    stacks = {f"metal {u:g}, {v:g}": stack((0.05, 0.05), (u, v)) for u, v in alphas}
    return cells.compute(stacks, COLUMNS, cells.Quality(size, spp, paths), seed, progress)


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """A column for each roughness: the truth, the model, and what it has too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path, exposure=0.4)


if __name__ == "__main__":
    draw(compute(), "weier2020-10.png")
