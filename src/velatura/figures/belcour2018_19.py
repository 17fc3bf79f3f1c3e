"""Belcour 2018, figure 19: failure at high roughness, a rough dielectric over a metal as rough.

Indices 2 and 0.01 + i, and no multiple scattering between the facets of one interface, as in the paper. It prints
neither which roughnesses it shows nor its scene: alpha here is .1, .4, .7 and 1, on a sphere in the studio. The model
is the forward one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from velatura.comparison import compare
from velatura.figures import canvas
from velatura.stack import Interface, Stack

MODEL = "belcour2018"
ALPHAS = (0.1, 0.4, 0.7, 1.0)


def compute(
    alphas: Sequence[float] = ALPHAS,
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    paths: int = 300_000,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Lists over `alpha`, for light along the normal: total variation, and for model and walk the second lobe.

    `base_alpha` and `base_energy` are those of the second lobe, `albedo` is all that is reflected (of the model, as it
    is evaluated), `noise` the part of the total variation that is the walk's own. `rmse` is that of `pictures`, freed
    of noise.

    Raises:
        InvalidInput, MissingTool: as `vt.compare`.
    """
    numbers: dict[str, Any] = {"alpha": [float(alpha) for alpha in alphas], "paths": paths}
    numbers |= {"total_variation": [], "noise": [], "rmse": []}
    quantities = ("base_alpha", "base_energy", "albedo")
    numbers |= {side: {quantity: [] for quantity in quantities} for side in ("model", "walk")}
    numbers["pictures"] = {"model": [], "reference": []}
    for alpha in canvas.track(alphas, progress):
        # What is told
        stack = Stack([Interface(eta=2.0, alpha=alpha), Interface(eta=0.01, k=1.0, alpha=alpha)])
        found = compare(stack, [MODEL], [1.0], paths, seed, microsurface=False, **canvas.CHOICES)
        numbers["total_variation"].append(float(found.total_variation[MODEL][0]))
        numbers["noise"].append(float(found.noise[0]))
        for side, told in (("model", found.models[MODEL]), ("walk", found.truth)):
            base = told.reflected[1]
            values = (base.alpha[0, 0], base.energy[:, 0].mean(), told.evaluated[:, 0].mean())
            for quantity, value in zip(quantities, values):
                numbers[side][quantity].append(float(value))
        # What is seen
        modelled, true = (canvas.spheres(stack, name, "studio", size, spp, seed) for name in (MODEL, "reference"))
        numbers["rmse"].append(canvas.rmse(modelled, true))
        numbers["pictures"]["model"].append(modelled.mean(axis=0).tolist())
        numbers["pictures"]["reference"].append(true.mean(axis=0).tolist())
    return numbers


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """A column for each roughness: model, reference, and what the model has too much (red) or too little (blue).

    Raises:
        InvalidInput: the file cannot be written.
    """
    count = len(numbers["alpha"])
    figure = canvas.canvas(2.4 * count + 0.6, 7.4)
    axes = figure.subplots(3, count, squeeze=False)
    for i, alpha in enumerate(numbers["alpha"]):
        model, true = (np.array(numbers["pictures"][side][i]) for side in ("model", "reference"))
        canvas.show(axes[0, i], model, f"{MODEL}, alpha {alpha:g}")
        canvas.show(axes[1, i], true, "reference")
        variation = numbers["total_variation"][i]
        title = f"RMSE {numbers['rmse'][i]:.3f}, variation {variation:.2f}"
        drawn = canvas.show_difference(axes[2, i], model, true, 0.2, title)
    figure.colorbar(drawn, ax=axes[2, :], shrink=0.8, label="minus the reference")
    canvas.save(figure, path)


if __name__ == "__main__":
    draw(compute(), "belcour2018-19.png")
