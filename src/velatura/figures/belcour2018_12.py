"""Belcour 2018, figure 12: the white furnace, five dielectrics over a perfect mirror in uniform light.

Nothing absorbs, so that an object that keeps all energy cannot be seen. The stack is the paper's (indices 1.3 and 1 by
turns), with smooth interfaces, and once more with dielectrics of alpha 0.1, which is chosen here: the paper prints no
roughness. The object is a sphere. The model is the forward one; the reference lets light meet one facet of an interface
at a time, and loses what meets a second one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from velatura.figures import canvas
from velatura.stack import preset

MODELS = ("belcour2018", "weidlich_wilkie", "reference")
STACKS = {"smooth": "furnace", "rough": "furnace-rough"}
ANGLES = (0, 15, 30, 45, 60, 70, 80, 85)  # degrees


def compute(
    angles: Sequence[float] = ANGLES,
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    paths: int = 200_000,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """For `smooth` and `rough`, by model: the `albedo` over `angles` (degrees), 1 where all is kept; and `pictures`.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    cosines = np.cos(np.radians(angles))
    numbers: dict[str, Any] = {"angles": [float(angle) for angle in angles], "pictures": {}}
    numbers |= {name: {} for name in STACKS}
    for name, model in canvas.track([(name, model) for name in STACKS for model in MODELS], progress):
        stack = preset(STACKS[name])
        kept = [float(canvas.sampled(stack, model, cosine, paths, seed).weight.mean()) for cosine in cosines]
        numbers[name][model] = kept
        halves = canvas.spheres(stack, model, "furnace", size, spp, seed)
        numbers["pictures"].setdefault(name, {})[model] = halves.mean(axis=0).tolist()
    return numbers


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """A row for each stack: the spheres in the furnace, and the energy that is kept over the angle.

    Raises:
        InvalidInput: the file cannot be written.
    """
    figure = canvas.canvas(13, 6)
    for row, name in zip(figure.subplots(2, 4, width_ratios=(1, 1, 1, 1.4)), STACKS):
        for plot, model in zip(row, MODELS):
            # Half as bright, since white would not be told from brighter
            canvas.show(plot, 0.5 * np.array(numbers["pictures"][name][model]), f"{model}, {name}")
            row[-1].plot(numbers["angles"], numbers[name][model], color=canvas.COLOURS[model], marker=".", label=model)
        row[-1].axhline(1, color="0.7", linewidth=1)
        row[-1].set(title=f"energy kept, {name}", xlabel="angle of incidence (°)", ylim=(0, 1.3))
        row[-1].legend(fontsize="small", loc="lower left")
    canvas.save(figure, path)


if __name__ == "__main__":
    draw(compute(), "belcour2018-12.png")
