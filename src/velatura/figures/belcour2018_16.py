"""Belcour 2018, figure 16: two layers of which three parameters are textured.

Index and roughness of the coat and the extinction of the smooth metal (index 1) come from images, as in the paper.
The images are chosen here: a checkerboard for the index (1.2 and 1.8), bands for alpha (0 to 0.4), and a gradient of
colours for the extinction (up to 4); so is the object, a hollow ball. The forward form stands beside the symmetric
one, which the paper renders.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from velatura.figures import canvas, cells
from velatura.figures.belcour2018_15 import COLUMNS
from velatura.stack import Interface, Stack


def compute(
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """One cell: see `cells.compute`.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    u, v = np.meshgrid(np.linspace(0, 1, 256, endpoint=False), np.linspace(0, 1, 256, endpoint=False))
    squares = (np.floor(16 * u) + np.floor(8 * v)) % 2
    images = {
        "eta": np.repeat((1.2 + 0.6 * squares)[..., None], 3, axis=-1),
        "alpha": 0.4 * np.abs(np.sin(6 * np.pi * v)),
        "k": np.stack([4 * v, 2 * np.ones_like(v), 4 * (1 - v)], axis=-1),
    }
    with tempfile.TemporaryDirectory() as folder:
        read = {name: canvas.texture(Path(folder) / f"{name}.exr", image) for name, image in images.items()}
        stack = Stack([Interface(eta=read["eta"], alpha=read["alpha"]), Interface(eta=1.0, k=read["k"], alpha=0.0)])
        return cells.compute({"textured": stack}, COLUMNS, cells.Quality(size, spp), seed, progress, "ball")


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """The truth, both forms, and what each has too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path)


if __name__ == "__main__":
    draw(compute(), "belcour2018-16.png")
