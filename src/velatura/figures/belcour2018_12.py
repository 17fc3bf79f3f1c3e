"""Belcour 2018, figure 12: the white furnace, five dielectrics over a perfect mirror in uniform light.

Nothing absorbs, so that an object that keeps all energy cannot be seen. The stack is the paper's (indices 1.3 and 1 by
turns), with smooth interfaces, and once more with dielectrics of alpha 0.1, which is chosen here: the paper prints no
roughness. The object is a sphere. The model has the symmetric form, which the paper renders; the forward one stands
beside it. The reference lets light meet one facet of an interface at a time, and loses what meets a second one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.stack import preset

STACKS = {"smooth": "furnace", "rough": "furnace-rough"}
ANGLES = (0, 15, 30, 45, 60, 70, 80, 85)  # degrees


def compute(
    angles: Sequence[float] = ANGLES,
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    paths: int = 200_000,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The albedo of `smooth` and `rough` by column, over `angles` (degrees), 1 where all is kept; `pictures`."""
    cosines = np.cos(np.radians(angles))
    numbers: dict[str, Any] = {"angles": [float(angle) for angle in angles], "pictures": {}}
    numbers |= {name: {} for name in STACKS}
    for name, column in canvas.track([(name, column) for name in STACKS for column in canvas.COLUMNS], progress):
        stack, (model, switches) = preset(STACKS[name]), canvas.COLUMNS[column]
        made = canvas.bsdf(stack, model, **switches)
        numbers[name][column] = [float(canvas.sampled(made, x, paths, seed).weight.mean()) for x in cosines]
        passes = canvas.taken(made, model, "sphere", "furnace", size, spp, seed)
        numbers["pictures"].setdefault(name, {})[column] = passes.mean(axis=0).tolist()
    return numbers


@canvas.page(16, 6)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """A row for each stack: the spheres in the furnace, and the energy that is kept over the angle."""
    for row, name in zip(figure.subplots(2, 5, width_ratios=(1, 1, 1, 1, 1.4)), STACKS):
        seen = canvas.shown(numbers["pictures"][name])
        for plot, (column, style) in zip(row, canvas.STYLES.items()):
            # Half as bright, since white and brighter would look the same
            canvas.show(plot, 0.5 * seen[column], f"{column}, {name}")
            row[-1].plot(numbers["angles"], numbers[name][column], marker=".", label=column, **style)
        row[-1].axhline(1, color="0.7", linewidth=1)
        row[-1].set(title=f"energy kept, {name}", xlabel="angle of incidence (°)", ylim=(0, None))
        row[-1].legend(fontsize="small", loc="lower left")
