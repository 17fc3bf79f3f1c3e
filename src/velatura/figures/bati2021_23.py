"""Bati et al. 2021, figure 23: two smooth pairs that reflect the same and transmit differently.

Members of the class of figure 15 (b), with little and with much absorption.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from velatura.figures import bati2021_15, canvas, looks
from velatura.model.stack_lobes import stack_lobes

NAMES = {"15 b, low": "low absorption", "15 b, high": "high absorption"}


def compute(
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """By name, over `cosines`, the energies `reflected` and `transmitted` (rgb); and `pictures` of spheres of each.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    numbers: dict[str, Any] = {"cosines": list(looks.COSINES), "pictures": {}}
    stacks = bati2021_15.stacks()
    for found, name in canvas.track(list(NAMES.items()), progress):
        read = stack_lobes(stacks[found], looks.COSINES, model=looks.MODEL)
        assert read.transmitted is not None
        energies = {"reflected": np.sum(read.energy, axis=0).T, "transmitted": read.transmitted.energy.T}
        numbers[name] = {key: energy.tolist() for key, energy in energies.items()}
        passes = canvas.spheres(stacks[found], looks.MODEL, "studio", size, spp, seed)
        numbers["pictures"][name] = passes.mean(axis=0).tolist()
    return numbers


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """Both spheres, which let light pass.

    Raises:
        InvalidInput: the file cannot be written.
    """
    figure = canvas.canvas(2.8 * len(NAMES), 3)
    for axes, name in zip(figure.subplots(1, len(NAMES)), NAMES.values()):
        canvas.show(axes, np.array(numbers["pictures"][name]), name)
    canvas.save(figure, path)


if __name__ == "__main__":
    draw(compute(), "bati2021-23.png")
