"""Bati et al. 2021, figure 23: two smooth pairs that reflect the same and transmit differently.

Members of the class of figure 15 (b), with little and with much absorption, marked in it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from velatura.figures import Progress, bati2021_15, canvas, looks
from velatura.figures.looks import COSINES, MODEL
from velatura.inverse import plots
from velatura.model.registry import stack_lobes

NAMES = {"15 b, low": "low absorption", "15 b, high": "high absorption"}


def compute(
    size: int = looks.SIZE, spp: int = looks.SAMPLES, seed: int = 0, progress: Progress | None = None
) -> dict[str, Any]:
    """The `indices` by name, energies `reflected` and `transmitted` (rgb) over `cosines`; and `pictures` of spheres."""
    numbers: dict[str, Any] = {"cosines": list(COSINES), "pictures": {}}
    stacks = bati2021_15.stacks()
    for found, name in canvas.track(list(NAMES.items()), progress):
        read = stack_lobes(stacks[found], COSINES, model=MODEL)
        assert read.transmitted is not None
        energies = {"reflected": np.sum(read.energy, axis=0).T, "transmitted": read.transmitted.energy.T}
        numbers[name] = {"indices": [part.eta for part in stacks[found].interfaces]}
        numbers[name] |= {key: energy.tolist() for key, energy in energies.items()}
        passes = canvas.spheres(stacks[found], MODEL, "studio", size, spp, seed)
        numbers["pictures"][name] = passes.mean(axis=0).tolist()
    return numbers


@canvas.page(17, 3.4)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The class, both spheres, which let light pass, and what they reflect and transmit over the angle."""
    members, *spheres, reflected, transmitted = figure.subplots(1, 5)
    names = tuple(NAMES.values())
    plots.draw(members, bati2021_15.members("15 b"))
    looks.mark(members, [numbers[name]["indices"] for name in names], names)
    members.set_title("(a) class", fontsize="medium")
    for axes, part, (name, picture) in zip(spheres, "bc", canvas.shown(numbers["pictures"]).items()):
        canvas.show(axes, picture, f"({part}) {name}")
    angles = np.degrees(np.arccos(numbers["cosines"]))
    for axes, key in ((reflected, "reflected"), (transmitted, "transmitted")):
        looks.curves(axes, angles, [np.array(numbers[name][key]) for name in names], names)
        axes.set(title=f"energy {key}", xlabel="angle of incidence (°)", ylim=(0, 1))
