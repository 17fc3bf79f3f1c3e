"""Pictures of equivalence classes."""

from __future__ import annotations

import dataclasses
import io
from typing import Any

import numpy as np

from velatura.inverse.above import Layers
from velatura.inverse.equivalence import EquivalenceClass

RESOLUTION = 256
SIZE, DPI = (4.2, 4.2), 90  # of a picture: inches, and pixels in one
FILLS = ("#d62728", "#2ca02c", "#1f77b4")  # of red, green and blue


def png(members: EquivalenceClass) -> bytes:
    """A class as a picture, with the member that is preferred."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE if members.free != 1 else (SIZE[0], SIZE[1] / 3), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure.add_subplot(), members, members.chosen)
    picture = io.BytesIO()
    figure.savefig(picture)
    return picture.getvalue()


def draw(axes: Any, members: EquivalenceClass, chosen: tuple[Layers, ...] | None = None) -> None:
    """A class on matplotlib's axes, per channel and intersected, and the member that was chosen.

    Of a pair of dielectrics over (eta_1, eta_2), channels filled in their colours, with the curves without absorption,
    and all of them together in grey; else the values of eta_1; of a conductor its bounds over tint.
    """
    eta_max = members.choice.eta_max
    colours = FILLS if np.ptp(members.energy) > 0 else ("0.4",)
    if members.free == 2:
        axis = np.linspace(1, eta_max, RESOLUTION)
        depths = members.grid(axis, axis)
        for channel, colour in enumerate(colours):
            inside = depths[channel] >= 0
            axes.contourf(axis, axis, inside.T, levels=(0.5, 1.5), colors=[colour], alpha=0.2)
            for curve in members.boundary(channel=channel):
                axes.plot(*curve.T, color=colour, linewidth=1)
        inside = np.all(depths >= 0, axis=0)
        axes.contourf(axis, axis, inside.T, levels=(0.5, 1.5), colors=["0.7"])
        axes.contour(axis, axis, inside.T, levels=(0.5,), colors="black", linewidths=1)
        axes.set(xlabel="eta 1", ylabel="eta 2", xlim=(1, eta_max), ylim=(1, eta_max))
    elif members.free == 1:
        rows = [(colour, members.indices_1(channel)) for channel, colour in enumerate(colours)]
        for y, (colour, spans) in enumerate([("black", members.indices_1()), *rows]):
            for span in spans:
                axes.plot(span, (y, y), color=colour, linewidth=6, solid_capstyle="butt", marker="|")
        axes.set(xlabel="eta 1", xlim=(1, eta_max), yticks=[], ylim=(-1, len(rows) + 1))
    else:
        tint = np.linspace(0, 1, 33)
        for channel, colour in enumerate(colours):
            eta, kappa = np.transpose([_conductor(members, float(t), channel) for t in tint])
            axes.plot(eta, kappa, color=colour)
        axes.set(xlabel="eta", ylabel="k")
    if chosen is not None and members.free:
        point = [float(np.ravel(part.eta)[0]) for part in chosen[: members.free]]
        axes.plot(point[0], point[1] if len(point) > 1 else 0, "k*", markersize=10)


def _conductor(members: EquivalenceClass, tint: float, channel: int) -> tuple[float, float]:
    one = dataclasses.replace(members, choice=dataclasses.replace(members.choice, tint=tint))
    (layers,) = one.member()
    assert layers.kappa is not None
    eta, kappa = (float(np.broadcast_to(x, (3, 1))[channel, 0]) for x in (layers.eta, layers.kappa))
    return eta, kappa
