"""Bati et al. 2021, figure 12: the class of a coloured pair is what the classes of its channels have in common.

Energies of 0.07, 0.12 and 0.15 below a medium of index 1.5, smooth.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.inverse import Above, EquivalenceClass, plots
from velatura.model import named

ETA_0, ENERGIES = 1.5, (0.07, 0.12, 0.15)
MODEL = named("bati2021", reflectance="fresnel")


def members() -> EquivalenceClass:
    """The class."""
    return EquivalenceClass(Above.nothing(MODEL, ETA_0), np.array(ENERGIES)[:, None], 0.0, 2)


def compute(count: int = 128, progress: Progress | None = None) -> dict[str, Any]:
    """Intervals of `eta_1` of all channels together and of each; shares of [1, 4]^2 that they cover, on a grid."""
    found, axis = members(), np.linspace(1, 4, count)
    inside = found.grid(axis, axis) >= 0
    channels = []
    for channel in canvas.track(range(3), progress):
        spans = [list(span) for span in found.indices_1(channel)]
        channels.append({"energy": ENERGIES[channel], "eta_1": spans, "share": float(inside[channel].mean())})
    spans = [list(span) for span in found.indices_1()]
    return {"eta_1": spans, "share": float(inside.all(axis=0).mean()), "channels": channels}


@canvas.page(5.5, 5)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The classes of the channels in their colours, and what they have in common in grey."""
    axes = figure.subplots()
    plots.draw(axes, members())
    for n, span in enumerate(numbers["eta_1"]):
        axes.plot(span, (1.02, 1.02), "k", linewidth=4, label=None if n else "first indices of all")
    energies = ", ".join(f"{case['energy']:g}" for case in numbers["channels"])
    axes.set_title(f"R {energies} below index {ETA_0:g}", fontsize="medium")
    axes.legend(fontsize="small")
