"""Belcour 2018, figure 15: plates whose roughness is textured, by the symmetric and the forward form.

(1) Index 2, smooth, over 1 + 0.5i with alpha in [0, 1]; (2) index 1.8, alpha in [0, 1], a medium of depth 1 that
absorbs (1, 0.7, 0.2), and index 1, alpha in [0, 1], as printed. The texture, rings of all roughnesses, the plate, a low
dome, and its light are chosen here. Through the second one light passes, into the hollow dome and out again.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from velatura.figures import canvas, cells
from velatura.stack import Interface, Medium, Stack

COLUMNS: cells.Columns = {
    form: ("belcour2018", {"reflectance": "fgd", "tir": "published", "form": form}) for form in ("symmetric", "forward")
}


def rings(side: int = 256, count: float = 4.0) -> Any:
    """An image (side, side) of rings around its middle, of values from 0 to 1."""
    ticks = np.linspace(-1, 1, side)
    return 0.5 - 0.5 * np.cos(2 * np.pi * count * np.hypot(*np.meshgrid(ticks, ticks)))


def stacks(folder: Path) -> dict[str, Stack]:
    """Both materials, their texture in a folder."""
    alpha = canvas.texture(folder / "rings.exr", rings())
    metal = Interface(eta=1.0, k=0.5, alpha=alpha)
    tint = Medium(depth=1.0, sigma_a=(1.0, 0.7, 0.2))
    three = Stack([Interface(eta=1.8, alpha=alpha), tint, Interface(eta=1.0, alpha=alpha)])
    return {"two layers": Stack([Interface(eta=2.0), metal]), "three layers": three}


_FIGURE = cells.Cells(stacks, COLUMNS, "lid")
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "belcour2018-15.png")
