"""Yamaguchi et al. 2019, figure 4: two layers, each brushed in its own way, over the whole of a surface.

A dielectric of index 1.49 over (1 + i, 1, 1) for (a) to (d), as printed, and over the metal of its (e). Which layers
are brushed, in which fields and how roughly is not legible in the paper, and chosen here: (a) neither, (b) the metal,
(c) the coat, (d) both, across each other, (e) both, along diagonals that cross. The surface is a low dome.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from velatura.figures import canvas, cells
from velatura.stack import Brushing, Interface, Stack

RADIAL, CONCENTRIC = Brushing(brushing="radial"), Brushing(brushing="concentric")
SPREAD = (0.03, 0.3)


def stack(coat: float | tuple[float, float], turn: Any, metal: float | tuple[float, float], below: Any) -> Stack:
    """The two layers, with the roughness of each and the field or angle that turns it."""
    eta, k = 1.0, (1.0, 0.0, 0.0)
    return Stack([Interface(eta=1.49, alpha=coat, rotation=turn), Interface(eta=eta, k=k, alpha=metal, rotation=below)])


_COPPER = Interface(eta=(0.143, 0.373, 1.444), k=(3.983, 2.387, 1.602), alpha=SPREAD, rotation=-45.0)
STACKS = {
    "(a)": stack(0.1, 0.0, 0.1, 0.0),
    "(b)": stack(0.05, 0.0, SPREAD, CONCENTRIC),
    "(c)": stack(SPREAD, RADIAL, 0.05, 0.0),
    "(d)": stack(SPREAD, RADIAL, SPREAD, CONCENTRIC),
    "(e)": Stack([Interface(eta=1.49, alpha=SPREAD, rotation=45.0), _COPPER]),
}
COLUMNS: cells.Columns = {"yamaguchi2019": ("yamaguchi2019", {"reflectance": "fresnel", "tir": "off"})}


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
        {name: STACKS[name] for name in stacks}, COLUMNS, cells.Quality(size, spp, paths), seed, progress, "lid"
    )


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """A column for each material: the truth, the model, and what it has too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path)


if __name__ == "__main__":
    draw(compute(), "yamaguchi2019-04.png")
