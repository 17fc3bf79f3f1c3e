"""Weier & Belcour 2020, figure 13: failure at grazing angles, a brushed metal below a coat.

Roughnesses (0.05, 0.05) over (0.1, 0), as printed; the indices are those of figure 10, the sphere is chosen here.
"""

from __future__ import annotations

from velatura.figures import cells
from velatura.figures.weier2020_10 import COLUMNS, stack

STACKS = {"brushed": stack((0.05, 0.05), (0.1, 0.0))}

_FIGURE = cells.Cells(STACKS, COLUMNS, exposure=0.4)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "weier2020-13.png")
