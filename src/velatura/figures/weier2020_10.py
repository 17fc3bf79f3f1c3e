"""Weier & Belcour 2020, figure 10: a smooth coat over metals of many roughnesses, isotropic and brushed.

The coat has index 1.5 and alpha 0.05, the metal 0 + i, as printed; an index of 0 is 0.001 here. The roughnesses of the
metal are not legible in the paper and chosen here, as are the sphere, brushed around its axis, and the studio.
"""

from __future__ import annotations

from velatura.figures import cells
from velatura.stack import Interface, Stack

ALPHAS = ((0.01, 0.01), (0.01, 0.1), (0.1, 0.1), (0.1, 0.3), (0.3, 0.3), (0.05, 0.5))
COLUMNS: cells.Columns = {"weier2020": ("weier2020", {"reflectance": "fresnel", "tir": "off"})}


def stack(coat: tuple[float, float], metal: tuple[float, float]) -> Stack:
    """The dielectric over the metal, of these roughnesses."""
    return Stack([Interface(eta=1.5, alpha=coat), Interface(eta=0.001, k=1.0, alpha=metal)])


STACKS = {f"metal {u:g}, {v:g}": stack((0.05, 0.05), (u, v)) for u, v in ALPHAS}

_FIGURE = cells.Cells(STACKS, COLUMNS, exposure=0.4)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "weier2020-10.png")
