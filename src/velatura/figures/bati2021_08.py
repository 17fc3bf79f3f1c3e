"""Bati et al. 2021, figure 8: smooth pairs that reflect 0.15 head-on, by how much more they do at grazing angles.

Points of the closed curve of figure 7, each less the one interface that reflects the same; the slab, whose lower
interface totally reflects what grazes it, gains most.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.inverse import smooth_pair
from velatura.model.registry import stack_lobes
from velatura.stack import Interface, Stack

ENERGY = 0.15
RATIOS = (1.2, 1.4, 1.6, 1.85, 2.0, 2.2)  # of eta 1, on the branch of the slab and on the other one
MODEL = "bati2021"


def compute(ratios: Sequence[float] = RATIOS, count: int = 90, progress: Progress | None = None) -> dict[str, Any]:
    """Indices (eta_1, eta_2) by `point`, and its energy over `angles` (degrees) less that of one interface.

    Points lie in their order along the curve, from one interface to the slab.
    """
    points = smooth_pair.points(1.0, ENERGY)
    named = {"one interface": points["matched above"][0]}
    c = 2 / (1 - ENERGY)
    apart = {ratio: np.arccosh(c - np.cosh(np.log(ratio))) for ratio in ratios}
    named |= {f"denser below, eta 1 {ratio:g}": (ratio, float(ratio * np.exp(x))) for ratio, x in apart.items()}
    for ratio, x in reversed(apart.items()):
        if (eta_2 := float(ratio * np.exp(-x))) >= 1:
            named[f"rarer below, eta 1 {ratio:g}"] = (ratio, eta_2)
    named["slab"] = points["slab"][0]
    angles = np.linspace(0, 89, count)
    energies = {}
    for name, indices in canvas.track(list(named.items()), progress):
        stack = Stack([Interface(eta=eta) for eta in indices])
        read = stack_lobes(stack, np.cos(np.radians(angles)), model=MODEL, reflectance="fresnel")
        energies[name] = np.sum(read.energy, axis=0)[0]
    rows = [
        {"name": name, "indices": list(named[name]), "gain": (energy - energies["one interface"]).tolist()}
        for name, energy in energies.items()
    ]
    return {"angles": angles.tolist(), "points": rows}


@canvas.page(11, 4.6)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The gain of each point over the angle, and its place."""
    gains, places = figure.subplots(1, 2, width_ratios=(2, 1))
    places.plot(*np.transpose(smooth_pair.curve(1.0, ENERGY)), color="0.7")
    for point, colour in zip(numbers["points"], canvas.shades(len(numbers["points"]))):
        style = "--" if point["name"].startswith("rarer") else "-"
        gains.plot(numbers["angles"], point["gain"], style, color=colour, label=point["name"])
        places.plot(*point["indices"], "o", color=colour)
    gains.axhline(0, color="0.8", linewidth=1)
    gains.set(xlabel="angle of incidence (°)", ylabel="energy, less that of one interface")
    gains.legend(fontsize="x-small", ncols=2)
    for letter, name in (("C", "one interface"), ("E", "slab")):
        (place,) = (point["indices"] for point in numbers["points"] if point["name"] == name)
        places.annotate(letter, place, xytext=(6, -10), textcoords="offset points", fontweight="bold")
    places.set(xlabel="eta 1", ylabel="eta 2", title="places, with letters as in figure 7")
