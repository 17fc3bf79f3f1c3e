"""Yamaguchi et al. 2019, figure 8: three layers, and a medium between two, over a metal.

(a) is (d) of figure 4, on a sphere as in figures 6 and 7. (b) has a smooth dielectric of index 1.2 above, (c) a medium
between the layers with g = 0.9 and the printed coefficients. Chosen are the roughnesses, brushed in straight lines, and
the depth of the medium, 0.5. The medium is as published: it blurs all light, scattered or not.
"""

from __future__ import annotations

from velatura.figures import cells
from velatura.figures.yamaguchi2019_04 import COLUMNS
from velatura.figures.yamaguchi2019_07 import CROSSED
from velatura.stack import Interface, Medium, Stack

MEDIUM = Medium(depth=0.5, sigma_a=(0.01, 1.0, 0.01), sigma_s=(0.01, 1.0, 0.01), g=0.9)
COAT, METAL = CROSSED.interfaces
STACKS = {
    "(a)": CROSSED,
    "(b)": Stack([Interface(eta=1.2), COAT, METAL]),
    "(c)": Stack([COAT, MEDIUM, METAL]),
}

_FIGURE = cells.Cells(STACKS, COLUMNS)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "yamaguchi2019-08.png")
