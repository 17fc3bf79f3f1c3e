"""Pictures of equivalence classes."""

from __future__ import annotations

import dataclasses
import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.errors import needs
from velatura.inverse.equivalence import EquivalenceClass
from velatura.inverse.partial_stack import Layers

RESOLUTION = 256
SIZE, DPI = (4.2, 4.2), 90  # of a picture: inches, and pixels in one
FILLS = ("#d62728", "#2ca02c", "#1f77b4")  # of red, green and blue
CHANNELS = ("red", "green", "blue")
STAR: dict[str, Any] = {"color": "white", "marker": "*", "markersize": 12, "markeredgecolor": "black", "linestyle": ""}


def png(members: EquivalenceClass) -> bytes:
    """A class as a picture, with its preferred member. Raises MissingTool without the extra `plots`."""
    with needs("plots"):
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
    and all of them together in grey; else the values of eta_1, a row for each channel and one for all; of a conductor
    its eta and k over tint.
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
        axes.set(xlabel="eta of the upper interface", ylabel="eta of the lower one")
        axes.set(xlim=(1, eta_max), ylim=(1, eta_max))
        _name_fills(axes, colours)
    elif members.free == 1:
        rows = {"all": ("black", members.indices_1())}
        if len(colours) > 1:
            own = ((colour, members.indices_1(channel)) for channel, colour in enumerate(colours))
            rows |= dict(zip(CHANNELS, own))
        for y, (colour, spans) in enumerate(rows.values()):
            for span in spans:
                axes.plot(span, (y, y), color=colour, linewidth=6, solid_capstyle="butt", marker="|", markersize=14)
        axes.set(xlabel="eta", xlim=(1, eta_max), ylabel="channel", ylim=(-1, len(rows)))
        axes.set_yticks(range(len(rows)), rows)
    else:
        tint = np.linspace(0, 1, 33)
        for channel, colour in enumerate(colours):
            eta, kappa = np.transpose([_conductor(members, float(t), channel) for t in tint])
            axes.plot(eta, kappa, color=colour, label=CHANNELS[channel] if len(colours) > 1 else "all channels")
            if channel == 0:
                axes.text(eta[0], kappa[0], "tint 0", fontsize="small", ha="right", va="bottom")
                axes.text(eta[-1], kappa[-1], "tint 1", fontsize="small", ha="right", va="bottom")
        axes.margins(0.12)
        axes.set(xlabel="eta", ylabel="k")
    if chosen is not None:
        x, y = _place(members, chosen)
        numbers = [f"{np.ravel(part.eta)[0]:.2f}" for part in chosen[: members.free]]
        axes.plot(x, y, label=" ".join(["chosen", *(["eta", ", ".join(numbers)] if numbers else [])]), **STAR)
        axes.legend(fontsize="small")


def _name_fills(axes: Any, colours: Sequence[str]) -> None:
    """Add the filled regions to the legend."""
    names = zip(colours, CHANNELS) if len(colours) > 1 else ()
    for colour, alpha, name in [*((colour, 0.2, name) for colour, name in names), ("0.7", 1.0, "all channels")]:
        axes.fill([], [], color=colour, alpha=alpha, label=name)


def _place(members: EquivalenceClass, chosen: tuple[Layers, ...]) -> tuple[Any, Any]:
    """Position of the chosen member on the axes of `draw`; for a conductor, a point for each channel."""
    if members.free == 0:
        return np.ravel(chosen[-1].eta), np.ravel(chosen[-1].kappa)
    point = [float(np.ravel(part.eta)[0]) for part in chosen[: members.free]]
    return point[0], point[1] if len(point) > 1 else 0


def _conductor(members: EquivalenceClass, tint: float, channel: int) -> tuple[float, float]:
    one = dataclasses.replace(members, choice=dataclasses.replace(members.choice, tint=tint))
    (layers,) = one.member()
    assert layers.kappa is not None
    eta, kappa = (float(np.broadcast_to(x, (3, 1))[channel, 0]) for x in (layers.eta, layers.kappa))
    return eta, kappa
