"""Yamaguchi et al. 2019, figure 1: layers brushed in fields of their own, which a model of isotropic ones cannot show.

The brushed materials of figure 4, as chosen there, in truth, by Yamaguchi's model, and by the isotropic one of Belcour
2018, given for every layer the one roughness that is the geometric mean of its two.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from velatura.figures import canvas, cells
from velatura.figures.yamaguchi2019_04 import COLUMNS, STACKS
from velatura.stack import Interface, Stack

BRUSHED = {name: stack for name, stack in STACKS.items() if name != "(a)"}
_, CHOICES = COLUMNS["yamaguchi2019"]


def isotropic(stack: Stack) -> Stack:
    """The stack with the geometric mean of each interface's roughnesses, and no brushing."""
    return Stack([Interface(eta=i.eta, k=i.k, alpha=_mean(i.alpha)) for i in stack.interfaces])


def _mean(alpha: Any) -> float:
    return float(np.sqrt(np.prod(np.broadcast_to(alpha, 2))))


def compute(
    names: Collection[str] = tuple(BRUSHED),
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """A list of `cells` by `name`, with `canvas.errors` of both models; and their `pictures`.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    numbers: dict[str, Any] = {"cells": [], "pictures": []}
    for name in canvas.track(list(names), progress):
        stack = BRUSHED[name]
        shown: dict[str, tuple[Stack, str, Mapping[str, Any]]] = {
            "reference": (stack, "reference", {}),
            "isotropic": (isotropic(stack), "belcour2018", CHOICES),
            "anisotropic": (stack, "yamaguchi2019", CHOICES),
        }
        images = {
            title: canvas.pictures("lid", material, model, "studio", size, spp, seed, **choices)
            for title, (material, model, choices) in shown.items()
        }
        truth = images["reference"]
        found = canvas.errors({title: images[title] for title in ("isotropic", "anisotropic")}, truth)
        numbers["cells"].append({"name": name, **found})
        numbers["pictures"].append({title: passes.mean(axis=0).tolist() for title, passes in images.items()})
    return numbers


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """The truth, and both models, with what they have too much or too little.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells.draw(numbers, path)


if __name__ == "__main__":
    draw(compute(), "yamaguchi2019-01.png")
