"""Bati et al. 2021, figure 19: haze, as the variance of a conductor under a smooth coat grows from (a) to (c).

With plain Fresnel the conductor keeps its indices, as the paper says; with directional albedos they change a little.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from velatura.figures import canvas, looks

TARGETS = ("19 a", "19 b", "19 c")
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
    draw(compute(), "bati2021-19.png")
