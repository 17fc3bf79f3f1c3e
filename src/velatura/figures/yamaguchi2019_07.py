"""Yamaguchi et al. 2019, figure 7: two brushed layers whose directions are 90, 60 or 30 degrees apart.

Indices and roughnesses are those chosen for its figure 4 (d), on a sphere in the studio. The metal is brushed along
circles of latitude.
"""

from __future__ import annotations

from velatura.figures import cells
from velatura.figures.yamaguchi2019_04 import COLUMNS, SPREAD, stack

GAPS = (90, 60, 30)  # degrees
STACKS = {f"{gap:g}°": stack(SPREAD, float(gap), SPREAD, 0.0) for gap in GAPS}
CROSSED = STACKS["90°"]  # also (d) of figure 6 and (a) of figure 8

_FIGURE = cells.Cells(STACKS, COLUMNS)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "yamaguchi2019-07.png")
