"""Yamaguchi et al. 2019, figure 4: two layers, each brushed in its own way, over the whole of a surface.

A dielectric of index 1.49 over (1 + i, 1, 1) for (a) to (d), as printed, and over the metal of its (e). Which layers
are brushed, in which fields and how roughly is not legible in the paper, and chosen here: (a) neither, (b) the metal,
(c) the coat, (d) both, across each other, (e) both, along diagonals that cross. The surface is a low dome.
"""

from __future__ import annotations

from typing import Any

from velatura.figures import cells
from velatura.stack import Brushing, Interface, Stack

RADIAL, CONCENTRIC = Brushing(brushing="radial"), Brushing(brushing="concentric")
SPREAD = (0.03, 0.3)


def stack(coat: float | tuple[float, float], turn: Any, metal: float | tuple[float, float], below: Any) -> Stack:
    """The two layers, with the roughness of each and the field or angle that turns it."""
    eta, k = 1.0, (1.0, 0.0, 0.0)
    return Stack([Interface(eta=1.49, alpha=coat, rotation=turn), Interface(eta=eta, k=k, alpha=metal, rotation=below)])


_GOLD = Interface(eta=(0.143, 0.373, 1.444), k=(3.983, 2.387, 1.602), alpha=SPREAD, rotation=-45.0)
STACKS = {
    "(a)": stack(0.1, 0.0, 0.1, 0.0),
    "(b)": stack(0.05, 0.0, SPREAD, CONCENTRIC),
    "(c)": stack(SPREAD, RADIAL, 0.05, 0.0),
    "(d)": stack(SPREAD, RADIAL, SPREAD, CONCENTRIC),
    "(e)": Stack([Interface(eta=1.49, alpha=SPREAD, rotation=45.0), _GOLD]),
}
COLUMNS: cells.Columns = {"yamaguchi2019": ("yamaguchi2019", {"reflectance": "fresnel", "tir": "off"})}

_FIGURE = cells.Cells(STACKS, COLUMNS, "lid")
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "yamaguchi2019-04.png")
