"""Bati et al. 2021, figure 16: coated conductors that are alike and grey head-on; absorption gives a pink edge.

Beside the reference (a) a lower index of the coat, (b) green absorbed in it, (c) both. How much is chosen here.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from velatura.figures import canvas, looks
from velatura.inverse import invert_stack
from velatura.inverse.targets import FIGURES
from velatura.stack import Stack

CLEAR, GREEN = [0.0, 0.0, 0.0], [0.0, 0.3, 0.0]  # optical depths of the coat
CHOICES = {"reference": (1.5, CLEAR), "a": (1.2, CLEAR), "b": (1.5, GREEN), "c": (1.2, GREEN)}  # by its index


def stacks() -> dict[str, Stack]:
    """By name."""
    found = {}
    for name, (eta, tau) in CHOICES.items():
        (lobe,) = FIGURES["16"]
        fixed = {"eta": [eta, None], "tau": [None, tau]}
        found[name] = invert_stack([lobe | {"fixed": fixed}], looks.MODEL).stack
    return found


def compute(
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """As `looks.compute`."""
    return looks.compute(stacks(), size, spp, seed, progress)


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """As `looks.draw`.

    Raises:
        InvalidInput: the file cannot be written.
    """
    looks.draw(numbers, path)


if __name__ == "__main__":
    draw(compute(), "bati2021-16.png")
