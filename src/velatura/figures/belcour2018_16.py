"""Belcour 2018, figure 16: two layers of which three parameters are textured.

Index and roughness of the coat and the extinction of the smooth metal (index 1) come from images, as in the paper.
The images are chosen here: a checkerboard for the index (1.2 and 1.8), fingerprints and scratches for alpha (0 to 0.4),
and worn colours for the extinction (up to 4); so is the object, a carved urn, for the paper's robot. The forward form
stands beside the symmetric one, which the paper renders.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from velatura.figures import canvas, cells, maps
from velatura.figures.belcour2018_15 import COLUMNS
from velatura.stack import Interface, Stack


def stacks(folder: Path) -> dict[str, Stack]:
    """The material, its textures in a folder."""
    v, u = (np.arange(maps.SIDE)[index] / maps.SIDE for index in ((slice(None), None), (None, slice(None))))
    worn = maps.wear()
    images = {
        "eta": np.repeat((1.2 + 0.6 * ((np.floor(16 * u) + np.floor(12 * v)) % 2))[..., None], 3, axis=-1),
        "alpha": 0.4 * np.maximum(maps.fingerprints(), maps.scratches()),
        "k": np.stack([4 * worn, 2 * np.ones_like(worn), 4 * (1 - worn)], axis=-1),
    }
    read = {name: canvas.texture(folder / f"{name}.exr", image) for name, image in images.items()}
    coat, metal = Interface(eta=read["eta"], alpha=read["alpha"]), Interface(eta=1.0, k=read["k"], alpha=0.0)
    return {"textured": Stack([coat, metal])}


_FIGURE = cells.Cells(stacks, COLUMNS, "urn")
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "belcour2018-16.png")
