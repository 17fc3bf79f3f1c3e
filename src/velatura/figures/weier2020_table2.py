"""Weier & Belcour 2020, table 2: the cost of their anisotropic model, in units of the isotropic one of Belcour 2018.

The scenes are chosen here: `area light`, a sphere of an isotropic material by both models, which differ in the
formulas alone, and `teaser`, the ball, isotropic by the one model and brushed by the other. The material is that of
figure 10, of alpha 0.05 over 0.1 or (0.05, 0.2). The paper sets the roughnesses of `area light` to zero; smooth stacks
are mirrors here and cost nothing. As in table 2 of Belcour 2018 here, BSDFs are timed alone, with a textured roughness
of the coat, and in pictures, without.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from velatura import kernel
from velatura.figures import Progress, canvas, evaluation
from velatura.figures.weier2020 import CHOICES, stack
from velatura.stack import Stack

COLUMNS = {"belcour2018": "belcour", "weier2020": "weier"}  # and the map of each
SCENES = {"area light": ("sphere", (0.1, 0.1)), "teaser": ("ball", (0.05, 0.2))}  # and the metal in the second column
COAT, ISOTROPIC = (0.05, 0.05), (0.1, 0.1)
PAPER = {"area light": 15.2 / 12.1, "teaser": 6.3 / 5.6}


def compute(
    size: int = 192,
    spp: int = 16,
    repeats: int = 15,
    lanes: int = evaluation.LANES,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The `evaluation` of BSDFs alone by scene, over the isotropic one (`evaluation.costs`), and the `paper`'s ratio.

    Of pictures: `seconds` (the median of `repeats`) by model, and their `ratio` with its standard error `ratio_error`.
    """
    numbers: dict[str, Any] = {"scenes": {}, "pictures": {}}
    for name in canvas.track(list(SCENES), progress):
        shape, metal = SCENES[name]
        stacks = {model: stack(COAT, alpha) for model, alpha in zip(COLUMNS, (ISOTROPIC, metal))}
        loaded = {
            model: kernel.load_dict(canvas.staged(bsdf, shape, "studio", size))
            for model, bsdf in _bsdfs(stacks).items()
        }
        images, times = canvas.timed(loaded, spp, repeats, seed)
        seconds = {model: float(np.median(each)) for model, each in times.items()}
        ratio, error = canvas.ratio(times["weier2020"], times["belcour2018"])
        with tempfile.TemporaryDirectory() as folder:
            bsdfs = _bsdfs({model: evaluation.textured(each, Path(folder)) for model, each in stacks.items()})
        numbers["scenes"][name] = {
            "evaluation": evaluation.costs(bsdfs, {"weier2020": "belcour2018"}, repeats, seed, lanes),
            "seconds": seconds,
            "ratio": ratio,
            "ratio_error": error,
            "paper": PAPER[name],
        }
        numbers["pictures"][name] = {model: image.tolist() for model, image in images.items()}
    return numbers


def _bsdfs(stacks: dict[str, Stack]) -> dict[str, Any]:
    """The BSDFs of both models, each with its stack and its map."""
    return {model: canvas.bsdf(each, model, map=COLUMNS[model], **CHOICES) for model, each in stacks.items()}


@canvas.page(9, 6.4)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """A row for each scene: both pictures, and the cost of the second over that of the first."""
    rows = figure.subplots(2, 3, width_ratios=(1, 1, 1.2))
    for row, (name, found) in zip(rows, numbers["scenes"].items()):
        for axes, (model, picture) in zip(row, canvas.shown(numbers["pictures"][name]).items()):
            canvas.show(axes, 0.4 * picture, f"{name}, {model}")
        alone = {function: each["weier2020"] for function, each in found["evaluation"].items()}
        shown = {"paper": found["paper"], **alone, "picture,\nuntextured": found["ratio"]}
        evaluation.bars(row[-1], {"": shown}, list(shown))
        row[-1].set(title="weier2020 over belcour2018", ylim=(0, None))
        row[-1].axhline(1, color="black", linewidth=0.5)
