"""Weier & Belcour 2020, figure 8: their roughness map against that of Belcour 2018, on a rough coat over a metal.

Index 1.5 over one of 0 + i, both of alpha 0.1, as printed; an index of 0 is 0.001 here. The scene is not printed: a
sphere in the studio. Both columns are the model `weier2020` and differ in the map alone.
"""

from __future__ import annotations

from velatura.figures import cells
from velatura.stack import Interface, Stack

STACK = Stack([Interface(eta=1.5, alpha=0.1), Interface(eta=0.001, k=1.0, alpha=0.1)])
COLUMNS: cells.Columns = {
    name: ("weier2020", {"reflectance": "fresnel", "tir": "off", "map": name}) for name in ("belcour", "weier")
}

_FIGURE = cells.Cells({"alpha 0.1": STACK}, COLUMNS, exposure=0.4)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "weier2020-08.png")
