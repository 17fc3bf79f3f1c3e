"""Weier & Belcour 2020, figure 11: coats of many roughnesses, isotropic and anisotropic, over a smooth metal.

The indices are those of figure 10, the metal's alpha is 0.05, as printed; the coats' roughnesses are chosen here.
"""

from __future__ import annotations

from velatura.figures import cells
from velatura.figures.weier2020_10 import ALPHAS, COLUMNS, stack

STACKS = {f"coat {u:g}, {v:g}": stack((u, v), (0.05, 0.05)) for u, v in ALPHAS}

_FIGURE = cells.Cells(STACKS, COLUMNS, exposure=0.4)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "weier2020-11.png")
