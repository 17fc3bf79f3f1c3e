"""Bati et al. 2021, figure 24: a pair of dielectrics on a diffuse base: black, grey, orange."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from velatura.figures import canvas, looks
from velatura.stack import RGB, Diffuse, Stack

ALBEDOS: dict[str, float | RGB] = {"black": 0.0, "grey": 0.5, "orange": (0.5, 0.3, 0.1)}


def stacks() -> dict[str, Stack]:
    """By the colour of the base."""
    (pair,) = looks.inverted(("24",)).values()
    return {name: Stack([*pair.layers, Diffuse(albedo=albedo)]) for name, albedo in ALBEDOS.items()}


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
    draw(compute(), "bati2021-24.png")
