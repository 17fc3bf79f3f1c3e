"""Bati et al. 2021, figure 11: rough pairs that reflect 0.2, and where they end, as the lower interface gets smooth.

The roughnesses are chosen here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.inverse import Above, EquivalenceClass, smooth_pair
from velatura.model import named
from velatura.model.roughness_maps import MAPS

ENERGY, ALPHAS = 0.2, (0.01, 0.1, 0.2, 0.4)
MODEL = named("bati2021")


def compute(alphas: Sequence[float] = ALPHAS, count: int = 160, progress: Progress | None = None) -> dict[str, Any]:
    """The `curves` by `alpha` without absorption, (eta_1, eta_2), and `ends`, the intervals that bound eta_1."""
    rows = []
    for alpha in canvas.track(alphas, progress):
        variance = float(MAPS["belcour"].variance(alpha))
        members = EquivalenceClass(Above.nothing(MODEL), np.full((1, 1), ENERGY), variance, 2)
        curves = [curve.tolist() for curve in members.boundary(count)]
        rows.append({"alpha": alpha, "curves": curves, "ends": [list(span) for span in members.indices_blur()]})
    return {"energy": ENERGY, "classes": rows}


@canvas.page(6, 5)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """All curves in one plot, with the smooth one and the ends."""
    axes = figure.subplots()
    axes.plot(*np.transpose(smooth_pair.curve(1.0, numbers["energy"])), "k:", label="smooth")
    for n, row in enumerate(numbers["classes"]):
        for m, curve in enumerate(row["curves"]):
            label = f"alpha {row['alpha']:g}" if m == 0 else None
            axes.plot(*np.transpose(curve), color=f"C{n}", label=label)
        axes.axvline(row["ends"][-1][1], color=f"C{n}", linestyle="--", linewidth=0.8, label=None if n else "ends")
    axes.set(xlabel="eta 1", ylabel="eta 2", xlim=(1, 3), ylim=(1, 4.2))
    axes.legend(fontsize="small")
