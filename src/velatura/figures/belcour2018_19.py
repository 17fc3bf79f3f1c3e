"""Belcour 2018, figure 19: failure at high roughness, a rough dielectric over a metal as rough.

Indices 2 and 0.01 + i, and no multiple scattering between the facets of one interface, as in the paper. It prints
neither which roughnesses it shows nor its scene: alpha here is .1, .4, .7 and 1, on a sphere in the studio. The model
has the symmetric form, which the paper renders; the forward one stands beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from velatura.comparison import compare
from velatura.figures import Progress, canvas
from velatura.model import named
from velatura.stack import Interface, Stack

MODEL = "belcour2018"
ALPHAS = (0.1, 0.4, 0.7, 1.0)


def compute(
    alphas: Sequence[float] = ALPHAS,
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    paths: int = 300_000,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """A list of `cells`, one for each `alpha`, for light along the normal; and `pictures`.

    By form, `canvas.errors` and the `total_variation`, of which `noise` is the walk's own part; by form and `walk` the
    `albedo`, all that is reflected (of the model, as it is evaluated), and of the second lobe `base_alpha`
    and `base_energy`.
    """
    cells: list[dict[str, Any]] = []
    pictures: list[dict[str, Any]] = []
    models = [named(MODEL, form=form, **canvas.CHOICES).replaced(name=form) for form in canvas.FORMS]
    for alpha in canvas.track(alphas, progress):
        # As numbers
        stack = Stack([Interface(eta=2.0, alpha=alpha), Interface(eta=0.01, k=1.0, alpha=alpha)])
        found = compare(stack, models, [1.0], paths, seed, microsurface=False)
        cell: dict[str, Any] = {"name": f"alpha {alpha:g}", "alpha": float(alpha), "noise": float(found.noise[0])}
        cell["total_variation"] = {form: float(found.total_variation[form][0]) for form in canvas.FORMS}
        cell |= {quantity: {} for quantity in ("base_alpha", "base_energy", "albedo")}
        for side, account in {"walk": found.truth, **found.models}.items():
            base = account.reflected[1]
            cell["base_alpha"][side] = float(base.alpha[0, 0])
            cell["base_energy"][side] = float(base.energy[:, 0].mean())
            cell["albedo"][side] = float(account.evaluated[:, 0].mean())
        # As pictures
        images = {form: canvas.spheres(stack, MODEL, "studio", size, spp, seed, form=form) for form in canvas.FORMS}
        true = canvas.spheres(stack, "reference", "studio", size, spp, seed)
        cells.append(cell | canvas.errors(images, true))
        seen = {**images, "reference": true}
        pictures.append({name: passes.mean(axis=0).tolist() for name, passes in seen.items()})
    return {"paths": paths, "cells": cells, "pictures": pictures}


@canvas.page()
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """A column for each roughness: reference, and of both forms what each has too much (red) or too little (blue)."""
    count = len(numbers["cells"])
    figure.set_size_inches(2.6 * count + 0.6, 12.3)
    axes = figure.subplots(5, count, squeeze=False)
    for column, cell, pictures in zip(axes.T, numbers["cells"], numbers["pictures"]):
        seen = canvas.shown(pictures)
        canvas.show(column[0], seen["reference"], f"reference, {cell['name']}")
        for n, form in enumerate(canvas.FORMS):
            canvas.show(column[2 * n + 1], seen[form], f"{form}, variation {cell['total_variation'][form]:.2f}")
            error = canvas.error_label(cell, form)
            drawn = canvas.show_difference(column[2 * n + 2], seen[form], seen["reference"], 0.2, error)
    figure.colorbar(drawn, ax=axes, shrink=0.3, label="minus the reference")
