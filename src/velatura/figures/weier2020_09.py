"""Weier & Belcour 2020, figure 9: the map that treats each axis by itself, and the fit over both axes at once.

The material is not printed: here it is that of figure 10 with a metal of roughness 0.05 along the sphere's circles of
latitude and 0.4 across them. Both columns are the model `weier2020` and differ in the map alone.
"""

from __future__ import annotations

from velatura.figures import cells
from velatura.figures.weier2020_10 import stack

STACKS = {"metal 0.05, 0.4": stack((0.05, 0.05), (0.05, 0.4))}
COLUMNS: cells.Columns = {
    name: ("weier2020", {"reflectance": "fresnel", "tir": "off", "map": name}) for name in ("weier-2d", "weier")
}

_FIGURE = cells.Cells(STACKS, COLUMNS, exposure=0.4)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "weier2020-09.png")
