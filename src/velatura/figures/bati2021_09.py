"""Bati et al. 2021, figure 9: smooth pairs with absorption between their interfaces, in air.

(a, b) Of those that reflect 0.15 the optical depth over both indices, whose lines all span the same first indices; (c)
the first indices that other reflectances leave.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from velatura.figures import canvas
from velatura.inverse import Above, EquivalenceClass
from velatura.model import named

ENERGIES = (0.15, 0.3, 0.45)
DEPTHS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
MODEL = named("bati2021", reflectance="fresnel")
ETA_MAX = 4.0


def compute(
    energies: Sequence[float] = ENERGIES, count: int = 160, progress: Callable[[int, int], None] | None = None
) -> dict[str, Any]:
    """Over `eta`, by energy: the `depth` at (eta_1, eta_2), null out of the class; the intervals of `eta_1`.

    `deepest` is the largest depth; it has no bound where the lower interface vanishes.
    """
    axis = np.linspace(1, ETA_MAX, count)
    numbers: dict[str, Any] = {"eta": axis.tolist(), "classes": []}
    for energy in canvas.track(energies, progress):
        members = EquivalenceClass(Above.nothing(MODEL), np.full((1, 1), energy), 0.0, 2)
        (depth,) = members.grid(axis, axis)
        inside = depth >= 0
        rows = [[float(x) if ok else None for x, ok in zip(row, good)] for row, good in zip(depth, inside)]
        spans = [list(span) for span in members.indices_1()]
        case = {"energy": energy, "depth": rows, "eta_1": spans, "deepest": float(depth[inside].max())}
        numbers["classes"].append(case)
    return numbers


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """The depth over both indices, a plot for each energy.

    Raises:
        InvalidInput: the file cannot be written.
    """
    classes = numbers["classes"]
    figure = canvas.canvas(4.6 * len(classes), 4.2)
    for axes, case in zip(figure.subplots(1, len(classes), squeeze=False)[0], classes):
        depth, bound = np.array(case["depth"], float).T, min(case["deepest"], DEPTHS[-1])
        drawn = axes.contourf(numbers["eta"], numbers["eta"], depth, levels=np.linspace(0, bound, 13), extend="max")
        axes.contour(numbers["eta"], numbers["eta"], depth, levels=DEPTHS, colors="white", linewidths=0.7)
        axes.set(title=f"R {case['energy']:g}: optical depth", xlabel="eta 1", ylabel="eta 2")
        axes.set(xlim=(1, ETA_MAX), ylim=(1, ETA_MAX), facecolor="0.92")
        figure.colorbar(drawn, ax=axes)
    canvas.save(figure, path)


if __name__ == "__main__":
    draw(compute(), "bati2021-09.png")
