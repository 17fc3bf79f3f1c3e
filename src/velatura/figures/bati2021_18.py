"""Bati et al. 2021, figure 18: one lobe of a pair of dielectrics, (a) less and more saturated, (b) smooth and rough."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from velatura.figures import canvas, looks

TARGETS = ("18 a, less saturated", "18", "18 a, more saturated", "18 b, smooth", "18 b, rough")


def compute(
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """As `looks.compute`."""
    return looks.compute(looks.inverted(TARGETS), size, spp, seed, progress)


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """As `looks.draw`.

    Raises:
        InvalidInput: the file cannot be written.
    """
    looks.draw(numbers, path)


if __name__ == "__main__":
    draw(compute(), "bati2021-18.png")
