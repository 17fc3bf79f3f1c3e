"""Bati et al. 2021, figure 16: coated conductors that are alike and grey head-on; absorption gives a pink edge.

Beside the reference (a) a lower index of the coat, (b) green absorbed in it, (c) both, in the class over the index of
the coat and the effective index below, that of a dielectric that reflects as much. How much is chosen here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.figures.bati2021_targets import FIGURES
from velatura.figures.looks import MODEL, Looks, Panel, interfaces, mark
from velatura.inverse import invert_stack
from velatura.optics import fresnel
from velatura.stack import Stack

CLEAR, GREEN = [0.0, 0.0, 0.0], [0.0, 0.3, 0.0]  # optical depths of the coat
CHOICES = {"reference": (1.5, CLEAR), "a": (1.2, CLEAR), "b": (1.5, GREEN), "c": (1.2, GREEN)}  # by its index
GREENS = 1
SHOWN = 30.0  # the largest effective index that is drawn: the class has no bound


def stacks() -> dict[str, Stack]:
    """Stacks by name."""
    found = {}
    for name, (eta, tau) in CHOICES.items():
        (lobe,) = FIGURES["16"]
        fixed = {"eta": [eta, None], "tau": [None, tau]}
        found[name] = invert_stack([lobe | {"fixed": fixed}], MODEL).stack
    return found


def effective(eta_1: Any, eta_2: Any, kappa_2: Any) -> Any:
    """The index of the dielectric that reflects, smooth and head-on, as much as a conductor below eta_1."""
    root = np.sqrt(fresnel.normal_incidence(eta_2 / eta_1, kappa_2 / eta_1))
    return eta_1 * (1 + root) / (1 - root)


def chart(axes: Any, panel: Panel, looks: Mapping[str, Any]) -> None:
    """Draw the class, clear along its lower edge, and a panel's stacks in it, by what they do in green."""
    members = invert_stack(FIGURES["16"], MODEL).classes[0]
    (span,) = members.indices_1()
    eta_1 = np.linspace(*span, 200)
    _, lower = members.member(eta_1)
    clear = effective(eta_1, lower.eta[GREENS], lower.kappa[GREENS])
    axes.fill_between(eta_1, clear, SHOWN, color="0.7", label="class")
    axes.plot(eta_1, clear, color="black", label="without absorption")
    points = []
    for name in panel.names:
        coat, metal = interfaces(looks[name])
        eta, k = (np.broadcast_to(metal[key], 3)[GREENS] for key in ("eta", "k"))
        points.append((coat["eta"], effective(coat["eta"], eta, k)))
    mark(axes, points, panel.labels)
    axes.set(xlabel="eta of the coat", ylabel="effective eta below", xlim=(1, None), ylim=(1, SHOWN))


PANELS = [
    Panel("(a) lower eta", ("reference", "a"), ("reference", "lower eta")),
    Panel("(b) green absorbed", ("reference", "b"), ("reference", "green absorbed")),
    Panel("(c) both", ("reference", "c"), ("reference", "both")),
]
FIGURE = Looks(stacks, PANELS, chart=chart)
compute, draw = FIGURE.compute, FIGURE.draw
