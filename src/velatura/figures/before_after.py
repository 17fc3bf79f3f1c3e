"""Presets by the first paper's model, by ours, and by random walks, with maps of the differences.

Not a figure of a paper. Facets are met once in all three, as renderers do it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from velatura.figures import Progress, canvas
from velatura.stack import preset

MODELS = ("belcour2018", "velatura")
PRESETS = (
    "frosted-metal",
    "coated-rough-metal",
    "coated-gold",
    "three-dielectrics-over-metal",
    "crossed-brushing",
    "pearl-lacquer",
    "red-enamel",
    "frosted-glass",
    "coated-brushed-aluminium",
)
SCALE = 0.25  # difference in radiance that is drawn in full colour


def compute(
    presets: Sequence[str] = PRESETS,
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The `canvas.errors` of every model and `mean` radiances of each preset, by `name`; and `pictures`."""
    rows, pictures = [], []
    for name in canvas.track(presets, progress):
        stack = preset(name)
        true = canvas.spheres(stack, "reference", "studio", size, spp, seed)
        images = {model: canvas.spheres(stack, model, "studio", size, spp, seed) for model in MODELS}
        means = {who: float(each.mean()) for who, each in [("reference", true), *images.items()]}
        rows.append({"name": name, **canvas.errors(images, true), "mean": means})
        seen = {**images, "reference": true}
        pictures.append({who: passes.mean(axis=0).tolist() for who, passes in seen.items()})
    return {"presets": rows, "pictures": pictures}


@canvas.page()
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """A row for each preset: the models, the reference, and where models are too bright (red) or too dark (blue)."""
    figure.set_size_inches(10, 2.1 * len(numbers["presets"]))
    axes = figure.subplots(len(numbers["presets"]), 5, squeeze=False)
    for row, modelled, pictures in zip(axes, numbers["presets"], numbers["pictures"]):
        seen = canvas.shown(pictures)
        for axis, model in zip(row, MODELS):
            canvas.show(axis, seen[model], "")
            axis.set_title(f"{modelled['name']}\n{model}", fontsize=8)
        canvas.show(row[2], seen["reference"], "")
        row[2].set_title("reference", fontsize=8)
        for axis, model in zip(row[3:], MODELS):
            canvas.show_difference(axis, seen[model], seen["reference"], SCALE, "")
            axis.set_title(f"{model} - reference\n{canvas.error_label(modelled, model)}", fontsize=8)
