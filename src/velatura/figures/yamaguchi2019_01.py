"""Yamaguchi et al. 2019, figure 1: layers brushed in fields of their own, which a model of isotropic ones cannot show.

The brushed materials of figure 4, as chosen there, and a carved urn whose coat and metal are brushed in waves, across
each other. In truth, by Yamaguchi's model, and by the isotropic one of Belcour 2018, given for every layer the one
roughness that is the geometric mean of its two.
"""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas, maps
from velatura.figures.cells import draw as draw
from velatura.figures.yamaguchi2019 import CHOICES, SPREAD, STACKS, stack
from velatura.stack import Interface, Stack

NAMES = ("(b)", "(c)", "(d)", "(e)", "urn")


def waves(folder: Path) -> Stack:
    """The material of the urn, its textures in a folder."""
    angles = maps.strokes()
    along, across = (
        canvas.texture(folder / f"{name}.exr", angles + turn) for name, turn in (("along", 0), ("across", 90))
    )
    return stack(SPREAD, along, SPREAD, across)


def isotropic(layers: Stack) -> Stack:
    """The stack with the geometric mean of each interface's roughnesses, and no brushing."""
    return Stack([Interface(eta=i.eta, k=i.k, alpha=_mean(i.alpha)) for i in layers.interfaces])


def _mean(alpha: Any) -> float:
    return float(np.sqrt(np.prod(np.broadcast_to(alpha, 2))))


def compute(
    names: Collection[str] = NAMES,
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """A list of `cells` by `name`, with `canvas.errors` of both models; and their `pictures`."""
    numbers: dict[str, Any] = {"cells": [], "pictures": []}
    for name in canvas.track(list(names), progress):
        with tempfile.TemporaryDirectory() as folder:
            brushed = waves(Path(folder)) if name == "urn" else STACKS["yamaguchi2019-04"][name]
            shown: dict[str, tuple[Stack, str, Mapping[str, Any]]] = {
                "reference": (brushed, "reference", {}),
                "isotropic": (isotropic(brushed), "belcour2018", CHOICES),
                "anisotropic": (brushed, "yamaguchi2019", CHOICES),
            }
            scene = "urn" if name == "urn" else "lid"
            images = {
                title: canvas.pictures(scene, material, model, "studio", size, spp, seed, **choices)
                for title, (material, model, choices) in shown.items()
            }
        truth = images["reference"]
        found = canvas.errors({title: images[title] for title in ("isotropic", "anisotropic")}, truth)
        numbers["cells"].append({"name": name, **found})
        numbers["pictures"].append({title: passes.mean(axis=0).tolist() for title, passes in images.items()})
    return numbers
