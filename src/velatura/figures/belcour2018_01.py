"""Belcour 2018, figure 1: the teaser, layers of which each has a texture, on an object with fine detail.

Its scene and materials are not printed. Here a carved urn stands for it, of lacquered gold: a coat of index 1.5 with
fingerprints (alpha from 0.02 to 0.3), a brown lacquer that has worn unevenly, and scratched gold (alpha from 0.05 to
0.35). The forward form stands beside the symmetric one, which the paper renders.
"""

from __future__ import annotations

from pathlib import Path

from velatura.figures import canvas, cells, maps
from velatura.figures.belcour2018_15 import COLUMNS
from velatura.stack import Interface, Medium, Stack

LACQUER = (0.3, 1.0, 2.5)  # optical depth where it is whole
TEASER = cells.Quality(256, 64)


def stacks(folder: Path) -> dict[str, Stack]:
    """The material, its textures in a folder."""
    prints = canvas.texture(folder / "prints.exr", 0.02 + 0.28 * maps.fingerprints())
    lacquer = canvas.texture(folder / "lacquer.exr", maps.wear()[..., None] * LACQUER)
    scratched = canvas.texture(folder / "scratches.exr", 0.05 + 0.3 * maps.scratches())
    coat, gold = Interface(eta=1.5, alpha=prints), Interface(conductor="Au", alpha=scratched)
    return {"lacquered gold": Stack([coat, Medium(depth=1.0, sigma_a=lacquer), gold])}


_FIGURE = cells.Cells(stacks, COLUMNS, "urn", quality=TEASER)
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "belcour2018-01.png")
