"""Belcour 2018: the figures that are pictures of layers by the model, beside the truth.

Where columns are the symmetric and the forward form, the former is the one that the paper renders.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from velatura.figures import canvas, maps
from velatura.figures.cells import TEASER, Cells, Columns
from velatura.stack import Interface, Medium, Stack

CHOICES = {"reflectance": "fgd", "tir": "published"}
FORMS: Columns = {form: ("belcour2018", CHOICES | {"form": form}) for form in ("symmetric", "forward")}
#: The medium as published, and the one that scatters many times.
MEDIA: Columns = {
    title: ("belcour2018", CHOICES | {"medium": medium, "form": form})
    for medium in ("shipped", "doubled")
    for title, form in ((medium, "symmetric"), (f"{medium}, forward", "forward"))
}
#: The variant for real time takes Schlick's Fresnel from a split sum, and no correction for total internal reflection.
VARIANTS: Columns = {
    "forward": ("belcour2018", CHOICES),
    "realtime": ("realtime", {"reflectance": "split-sum", "tir": "off", "lobes": "two"}),
}
DEPTHS = (0.1, 0.5, 1.0)
COATED_METAL = Stack([Interface(eta=1.4, alpha=0.01), Interface(eta=1.0, k=1.0, alpha=0.1)])
LACQUER = (0.3, 1.0, 2.5)  # optical depth where it is whole


def lacquered(folder: Path) -> dict[str, Stack]:
    """The material of figure 1, its textures in a folder."""
    prints = canvas.texture(folder / "prints.exr", 0.02 + 0.28 * maps.fingerprints())
    lacquer = canvas.texture(folder / "lacquer.exr", maps.wear()[..., None] * LACQUER)
    scratched = canvas.texture(folder / "scratches.exr", 0.05 + 0.3 * maps.scratches())
    coat, gold = Interface(eta=1.5, alpha=prints), Interface(conductor="Au", alpha=scratched)
    return {"lacquered gold": Stack([coat, Medium(depth=1.0, sigma_a=lacquer), gold])}


def under_medium(depth: float) -> Stack:
    """Gold under a medium."""
    return Stack([Medium(depth=depth, sigma_s=1.0, g=0.7), Interface(conductor="Au", alpha=0.01)])


def rings(side: int = 256, count: float = 4.0) -> Any:
    """An image (side, side) of rings around its middle, of values from 0 to 1."""
    ticks = np.linspace(-1, 1, side)
    return 0.5 - 0.5 * np.cos(2 * np.pi * count * np.hypot(*np.meshgrid(ticks, ticks)))


def plates(folder: Path) -> dict[str, Stack]:
    """Both materials of figure 15, their texture in a folder."""
    alpha = canvas.texture(folder / "rings.exr", rings())
    metal = Interface(eta=1.0, k=0.5, alpha=alpha)
    tint = Medium(depth=1.0, sigma_a=(1.0, 0.7, 0.2))
    three = Stack([Interface(eta=1.8, alpha=alpha), tint, Interface(eta=1.0, alpha=alpha)])
    return {"two layers": Stack([Interface(eta=2.0), metal]), "three layers": three}


def textured(folder: Path) -> dict[str, Stack]:
    """The material of figure 16, its textures in a folder."""
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


def worn_paint(folder: Path) -> dict[str, Stack]:
    """The material of figure 18, its textures in a folder."""
    scratched = canvas.texture(folder / "scratches.exr", 0.01 + 0.24 * maps.scratches())
    worn = canvas.texture(folder / "worn.exr", 0.1 + 0.3 * maps.wear())
    return {"worn paint": Stack([Interface(eta=1.5, alpha=scratched), Interface(eta=1.0, k=(0.5, 0.9, 2), alpha=worn)])}


FIGURES = {
    # The teaser, layers of which each has a texture, on an object with fine detail. Its scene and materials are not
    # printed. Here a carved urn stands for it, of lacquered gold: a coat of index 1.5 with fingerprints (alpha from
    # 0.02 to 0.3), a brown lacquer that has worn unevenly, and scratched gold (alpha from 0.05 to 0.35).
    "belcour2018-01": Cells(lacquered, FORMS, "urn", quality=TEASER),
    # Gold under a scattering medium that grows deeper: g = 0.7, no absorption and a scattering coefficient of 1, as
    # printed; the depths, the gold's alpha of 0.01 and the object, a carved urn for the paper's dragon, are chosen
    # here
    "belcour2018-14": Cells({f"depth {depth:g}": under_medium(depth) for depth in DEPTHS}, MEDIA, "urn"),
    # Plates whose roughness is textured. (1) Index 2, smooth, over 1 + 0.5i with alpha in [0, 1]; (2) index 1.8, alpha
    # in [0, 1], a medium of depth 1 that absorbs (1, 0.7, 0.2), and index 1, alpha in [0, 1], as printed. The texture,
    # rings of all roughnesses, the plate, a low dome, and its light are chosen here. Through the second one light
    # passes, into the hollow dome and out again.
    "belcour2018-15": Cells(plates, FORMS, "lid"),
    # Two layers of which three parameters are textured: index and roughness of the coat and the extinction of the
    # smooth metal (index 1) come from images, as in the paper. The images are chosen here: a checkerboard for the index
    # (1.2 and 1.8), fingerprints and scratches for alpha (0 to 0.4), and worn colours for the extinction (up to 4); so
    # is the object, a carved urn, for the paper's robot.
    "belcour2018-16": Cells(textured, FORMS, "urn"),
    # The variant for real time, the forward model, and the truth, on a coated metal: index 1.4 and alpha 0.01 over
    # 1 + i of alpha 0.1, as printed, on a sphere in the studio
    "belcour2018-17": Cells({"coated metal": COATED_METAL}, VARIANTS),
    # The variant for real time on an asset, a beetle in a commercial engine. Neither the asset nor its paint are
    # printed: here it is a carved urn of worn car paint, a coat of index 1.5 that is scratched (alpha from 0.01 to
    # 0.25) over a metal of index 1 + (0.5, 0.9, 2)i, whose alpha varies from 0.1 to 0.4. Both models are rendered
    # offline; `benchmarks/engines.py` counts what they cost in real time.
    "belcour2018-18": Cells(worn_paint, VARIANTS, "urn", quality=TEASER),
}
