"""Weier & Belcour 2020, table 2: the cost of their anisotropic model, in units of the isotropic one of Belcour 2018.

The scenes are chosen here: `area light`, a sphere of an isotropic material by both models, which differ in the
formulas alone, and `teaser`, the ball, isotropic by the one model and brushed by the other. The material is that of
figure 10, of alpha 0.05 over 0.1 or (0.05, 0.2); smooth stacks are mirrors here and cost nothing. Seconds are the
processor's, of this machine.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from velatura import kernel, scenes
from velatura.figures import canvas
from velatura.figures.weier2020_10 import stack

CHOICES = {"reflectance": "fresnel", "tir": "off"}
COLUMNS = {"belcour2018": "belcour", "weier2020": "weier"}  # and the map of each
SCENES = {"area light": ("sphere", (0.1, 0.1)), "teaser": ("ball", (0.05, 0.2))}  # and the metal in the second column
ISOTROPIC = (0.1, 0.1)
PAPER = {"area light": 15.2 / 12.1, "teaser": 6.3 / 5.6}


def compute(
    size: int = 192,
    spp: int = 16,
    repeats: int = 15,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """By scene: `seconds` of a picture (the median of `repeats`), their `ratio`, and that of the `paper`; `pictures`.

    `ratio_error` is the standard error of the ratio.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    numbers: dict[str, Any] = {"scenes": {}, "pictures": {}}
    for name in canvas.track(list(SCENES), progress):
        shape, metal = SCENES[name]
        loaded = {}
        for model, alpha in zip(COLUMNS, (ISOTROPIC, metal)):
            bsdf = canvas.bsdf(stack((0.05, 0.05), alpha), model, map=COLUMNS[model], **CHOICES)
            loaded[model] = kernel.load_dict(scenes.scene_dict(shape, "studio", bsdf, (size, size)))
        images, times = canvas.timed(loaded, spp, repeats, seed)
        seconds = {model: float(np.median(each)) for model, each in times.items()}
        ratio, error = canvas.ratio(times["weier2020"], times["belcour2018"])
        numbers["scenes"][name] = {"seconds": seconds, "ratio": ratio, "ratio_error": error, "paper": PAPER[name]}
        numbers["pictures"][name] = {model: image.tolist() for model, image in images.items()}
    return numbers


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """A row for each scene: both pictures with their seconds.

    Raises:
        InvalidInput: the file cannot be written.
    """
    figure = canvas.canvas(6, 6.4)
    for row, (name, found) in zip(figure.subplots(2, 2), numbers["scenes"].items()):
        for axes, (model, image) in zip(row, numbers["pictures"][name].items()):
            canvas.show(axes, 0.4 * np.array(image), f"{name}, {model}: {found['seconds'][model]:.2f} s")
    canvas.save(figure, path)


if __name__ == "__main__":
    draw(compute(), "weier2020-table2.png")
