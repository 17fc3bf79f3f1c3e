"""Belcour 2018, figure 22: two layers, one dielectric and one metal, in many combinations, with the RMSE of each.

The paper prints neither parameters nor scene, but that the frosted metal of figure 13 is among them. Here a coat of
index 1.5 grows rougher down the grid, over three metals, on a sphere in the studio. As in the paper, the model is the
symmetric one; the RMSE of the forward one is given as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from velatura import reference
from velatura.api import lobes
from velatura.figures import Progress, canvas
from velatura.stack import Interface, Stack

MODEL = "belcour2018"
FORMS = ("symmetric", "forward")
ETA = 1.5
COATS = (0.01, 0.1, 0.3)
METALS = {
    "frosted metal": Interface(eta=1.0, k=(1.0, 0.1, 0.1), alpha=0.01),
    "gold": Interface(conductor="Au", alpha=0.1),
    "rough copper": Interface(conductor="Cu", alpha=0.3),
}


def compute(
    coats: Sequence[float] = COATS,
    metals: Sequence[str] = tuple(METALS),
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    paths: int = 200_000,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """A list of `cells`, coat by coat: `coat` (its alpha), `metal`, `canvas.errors` of each form; and `pictures`.

    For light along the normal, and for `model` and `walk`: the `base_alpha` and `base_energy` (by colour) of the second
    lobe. `mean` is the mean radiance of the pictures.
    """
    cells = []
    pictures: list[dict[str, Any]] = []
    for coat, metal in canvas.track([(coat, metal) for coat in coats for metal in metals], progress):
        stack = Stack([Interface(eta=ETA, alpha=coat), METALS[metal]])
        true = canvas.spheres(stack, "reference", "studio", size, spp, seed)
        images = {form: canvas.spheres(stack, MODEL, "studio", size, spp, seed, form=form) for form in FORMS}
        modelled: dict[str, Any] = {
            "model": lobes(stack, 1.0, model=MODEL, **canvas.CHOICES),
            "walk": reference.statistics(canvas.in_channels(stack), 1.0, 0.0, paths, seed),
        }
        cell: dict[str, Any] = {"name": f"{metal}, coat {coat:g}", "coat": float(coat), "metal": metal}
        cell["mean"] = {name: float(each.mean()) for name, each in [("reference", true), *images.items()]}
        cell |= canvas.errors(images, true)
        cell["base_alpha"] = {side: float(found.alpha[1][0, 0]) for side, found in modelled.items()}
        cell["base_energy"] = {side: found.energy[1][:, 0].tolist() for side, found in modelled.items()}
        cells.append(cell)
        seen = {"reference": true, "model": images[FORMS[0]]}
        pictures.append({name: passes.mean(axis=0).tolist() for name, passes in seen.items()})
    return {"eta": ETA, "cells": cells, "pictures": pictures}


@canvas.page()
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """A row for each coat, and for each metal the model beside the reference."""
    rows = len({cell["coat"] for cell in numbers["cells"]})
    columns = len(numbers["cells"]) // rows
    figure.set_size_inches(4 * columns, 2.5 * rows)
    pairs = figure.subplots(rows, 2 * columns, squeeze=False).reshape(-1, 2)
    for (left, right), cell, pictures in zip(pairs, numbers["cells"], numbers["pictures"]):
        seen = canvas.shown(pictures)
        canvas.show(left, seen["model"], cell["name"].replace(", ", "\n"))
        canvas.show(right, seen["reference"], f"reference\n{canvas.error_label(cell, FORMS[0])}")
