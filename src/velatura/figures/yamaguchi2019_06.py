"""Yamaguchi et al. 2019, figure 6: three layered materials against the truth, with the RMSE of each.

The materials are (a), (b) and (d) of its figure 4, as chosen there, on a sphere, the fields being straight: the metal
is brushed along circles of latitude, the coat of (d) across them, as in figure 7 at 90 degrees.
"""

from __future__ import annotations

from velatura.figures import cells
from velatura.figures.yamaguchi2019_04 import COLUMNS, SPREAD, stack
from velatura.figures.yamaguchi2019_07 import CROSSED

STACKS = {
    "(a)": stack(0.1, 0.0, 0.1, 0.0),
    "(b)": stack(0.05, 0.0, SPREAD, 0.0),
    "(d)": CROSSED,
}

_FIGURE = cells.Cells(STACKS, COLUMNS)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "yamaguchi2019-06.png")
