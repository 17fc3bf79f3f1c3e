"""Bati et al. 2021, figure 21: the profile of haze: the upper lobe is the blurred one (left), or the lower one (right).

With plain Fresnel: by directional albedos there is no stack for the left one, as 3e-5 of variance are missing.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from velatura.figures import canvas, looks

TARGETS = ("21 left", "21 right")
PLAIN = {"reflectance": "fresnel"}


def compute(
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """As `looks.compute`."""
    return looks.compute(looks.inverted(TARGETS, **PLAIN), size, spp, seed, progress, **PLAIN)


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """As `looks.draw`.

    Raises:
        InvalidInput: the file cannot be written.
    """
    looks.draw(numbers, path)


if __name__ == "__main__":
    draw(compute(), "bati2021-21.png")
