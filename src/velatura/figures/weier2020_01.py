"""Weier & Belcour 2020, figure 1: the teaser, anisotropic interfaces on an object with fine detail.

Its scene and materials are not printed. Here a carved urn stands for it, brushed around its axis: a smooth coat over
brushed copper, and a brushed coat over smooth silver.
"""

from __future__ import annotations

from velatura.figures import cells
from velatura.figures.belcour2018_01 import TEASER
from velatura.figures.weier2020_10 import COLUMNS
from velatura.stack import Interface, Stack

STACKS = {
    "brushed copper": Stack([Interface(eta=1.5, alpha=0.02), Interface(conductor="Cu", alpha=(0.05, 0.3))]),
    "brushed coat": Stack([Interface(eta=1.5, alpha=(0.02, 0.2)), Interface(conductor="Ag", alpha=0.05)]),
}

_FIGURE = cells.Cells(STACKS, COLUMNS, "urn", exposure=0.7, quality=TEASER)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "weier2020-01.png")
