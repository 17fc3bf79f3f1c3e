"""Belcour 2018, figure 13: frosted metal, a rough coat over a smooth metal, by three models.

The object, light and sizes of the paper's scene are not printed: here it is a sphere in the studio. The model has the
symmetric form, which the paper renders; the forward one stands beside it. `blur` says as a number what the picture
shows: half of the light leaves within this distance of the mirror direction, on the projected disc.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from velatura import reference
from velatura.api import lobes
from velatura.figures import Progress, canvas
from velatura.stack import preset

COSINES = (1.0, 0.7, 0.4)


def compute(
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    paths: int = 200_000,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The `canvas.errors` by column against the reference, `blur` and `albedo` over `cos`; `pictures`.

    Also the roughness of the base's lobe, by the model and by random walks.
    """
    stack = preset("frosted-metal")
    numbers: dict[str, Any] = {"cos": list(COSINES), "blur": {}, "albedo": {}}
    images = {}
    for name in canvas.track(list(canvas.COLUMNS), progress):
        model, switches = canvas.COLUMNS[name]
        made = canvas.bsdf(stack, model, **switches)
        each = [canvas.sampled(made, cosine, paths, seed) for cosine in COSINES]
        numbers["albedo"][name] = [s.weight.mean(axis=0).tolist() for s in each]
        numbers["blur"][name] = [_blur(s.wo, s.weight.mean(axis=1), cosine) for s, cosine in zip(each, COSINES)]
        images[name] = canvas.taken(made, model, "sphere", "studio", size, spp, seed)

    numbers["pictures"] = {name: passes.mean(axis=0).tolist() for name, passes in images.items()}
    true = images.pop("reference")
    numbers |= canvas.errors(images, true)
    numbers["base_alpha"] = {
        "belcour2018": lobes(stack, COSINES, model="belcour2018", **canvas.CHOICES).alpha[1][0].tolist(),
        "walk": reference.statistics(stack, COSINES, 0.0, paths, seed).alpha[1][0].tolist(),
    }
    return numbers


def _blur(wo: Any, grey: Any, cosine: float) -> float:
    """The median distance of light from the mirror direction, on the projected disc."""
    away = np.hypot(wo[:, 0] + np.sqrt(1 - cosine**2), wo[:, 1])
    order = np.argsort(away)
    below = np.cumsum(grey[order])
    return float(away[order][np.searchsorted(below, below[-1] / 2)])


@canvas.page(12, 6.2)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The spheres in a row, and what each model has too much (red) or too little (blue)."""
    axes = figure.subplots(2, 4)
    seen = canvas.shown(numbers["pictures"])
    for column, name in zip(axes.T, canvas.COLUMNS):
        canvas.show(column[0], seen[name], name)
        if name != "reference":
            error = canvas.error_label(numbers, name)
            drawn = canvas.show_difference(column[1], seen[name], seen["reference"], 0.1, error)
    axes[1, -1].set_axis_off()
    figure.colorbar(drawn, ax=axes, shrink=0.5, label="minus the reference")
