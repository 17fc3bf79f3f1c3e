"""Weier & Belcour 2020, figure 12: a textured asset, which the paper renders in a real-time engine.

The asset is not printed: here it is a carved urn, its coat with fingerprints (index 1.5, alpha from 0.03 to 0.3) over
aluminium that is brushed in waves (alpha 0.05 along the strokes, and 0.1 to 0.4 across them, as it is worn). It is
rendered offline; `benchmarks/engines.py` counts what the model costs in real time.
"""

from __future__ import annotations

from pathlib import Path

from velatura.figures import canvas, cells, maps
from velatura.figures.belcour2018_01 import TEASER
from velatura.figures.weier2020_10 import COLUMNS
from velatura.stack import Interface, Stack


def stacks(folder: Path) -> dict[str, Stack]:
    """The material, its textures in a folder."""
    prints = canvas.texture(folder / "prints.exr", 0.03 + 0.27 * maps.fingerprints())
    across = canvas.texture(folder / "across.exr", 0.1 + 0.3 * maps.wear())
    strokes = canvas.texture(folder / "strokes.exr", maps.strokes())
    metal = Interface(conductor="Al", alpha=(0.05, across), rotation=strokes)
    return {"brushed in waves": Stack([Interface(eta=1.5, alpha=prints), metal])}


_FIGURE = cells.Cells(stacks, COLUMNS, "urn", exposure=0.7, quality=TEASER)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "weier2020-12.png")
