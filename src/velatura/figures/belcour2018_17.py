"""Belcour 2018, figure 17: the variant for real time, the forward model, and the truth, on a coated metal.

Index 1.4 and alpha 0.01 over 1 + i of alpha 0.1, as printed, on a sphere in the studio. The variant for real time takes
Schlick's Fresnel from a split sum, and no correction for total internal reflection.
"""

from __future__ import annotations

from velatura.figures import cells
from velatura.stack import Interface, Stack

STACKS = {"coated metal": Stack([Interface(eta=1.4, alpha=0.01), Interface(eta=1.0, k=1.0, alpha=0.1)])}
COLUMNS: cells.Columns = {
    "forward": ("belcour2018", {"reflectance": "fgd", "tir": "published"}),
    "realtime": ("realtime", {"reflectance": "split-sum", "tir": "off", "lobes": "two"}),
}

_FIGURE = cells.Cells(STACKS, COLUMNS)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "belcour2018-17.png")
