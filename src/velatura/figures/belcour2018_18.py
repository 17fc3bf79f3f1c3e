"""Belcour 2018, figure 18: the variant for real time on an asset, a beetle in a commercial engine.

Neither the asset nor its paint are printed: here it is a carved urn of worn car paint, a coat of index 1.5 that is
scratched (alpha from 0.01 to 0.25) over a metal of index 1 + (0.5, 0.9, 2)i, whose alpha varies from 0.1 to 0.4. Both
models are rendered offline; `benchmarks/engines.py` counts what they cost in real time.
"""

from __future__ import annotations

from pathlib import Path

from velatura.figures import canvas, cells, maps
from velatura.figures.belcour2018_01 import TEASER
from velatura.figures.belcour2018_17 import COLUMNS
from velatura.stack import Interface, Stack


def stacks(folder: Path) -> dict[str, Stack]:
    """The material, its textures in a folder."""
    scratched = canvas.texture(folder / "scratches.exr", 0.01 + 0.24 * maps.scratches())
    worn = canvas.texture(folder / "worn.exr", 0.1 + 0.3 * maps.wear())
    return {"worn paint": Stack([Interface(eta=1.5, alpha=scratched), Interface(eta=1.0, k=(0.5, 0.9, 2), alpha=worn)])}


_FIGURE = cells.Cells(stacks, COLUMNS, "urn", quality=TEASER)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "belcour2018-18.png")
