"""Weier & Belcour 2020, figure 7: the equivalent roughness of two bounces, by their map and by that of Belcour 2018.

The curves are those of figure 4 of Belcour 2018.
"""

from __future__ import annotations

from typing import Any

from velatura.figures import canvas
from velatura.figures.belcour2018_04 import NAMES, compute, draw_curves, draw_key

__all__ = ["compute", "draw"]

LOW = 0.5  # of the enlarged part


@canvas.page(15, 8)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """A row for each width; by column both maps, and each enlarged where roughness is low."""
    rows = figure.subplots(2, 4)
    for row, width in zip(rows, ("variance", "median")):
        for n, (top, name) in enumerate((top, name) for top in (1.0, LOW) for name in NAMES):
            draw_curves(row[n], numbers, width, name, top)
    draw_key(figure, rows)
