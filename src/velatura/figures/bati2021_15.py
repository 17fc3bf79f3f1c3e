"""Bati et al. 2021, figure 15: pairs of one class with little and with much absorption, alike head-on.

(a) Grey and smooth, (b) coloured and smooth, (c) coloured and rough, marked in their classes. The index between the
interfaces is 1.2, that below them the one that needs least absorption, and 4.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from velatura.figures.bati2021_targets import FIGURES
from velatura.figures.looks import MODEL, Looks, Panel, interfaces, mark, of_layers
from velatura.inverse import EquivalenceClass, invert_stack, plots
from velatura.stack import Stack

ETA_1, ETA_2 = 1.2, 4.0
TITLES = {"15 a": "(a) grey, smooth", "15 b": "(b) coloured, smooth", "15 c": "(c) coloured, rough"}


def members(name: str) -> EquivalenceClass:
    """The class of a target's lobe."""
    return invert_stack(FIGURES[name], MODEL).classes[0]


def stacks() -> dict[str, Stack]:
    """Stacks by name, in pairs."""
    found = {}
    for name in TITLES:
        found[f"{name}, low"] = of_layers(members(name).member(ETA_1))
        found[f"{name}, high"] = of_layers(members(name).member(ETA_1, ETA_2))
    return found


def chart(axes: Any, panel: Panel, looks: Mapping[str, Any]) -> None:
    """Draw the class of a panel's stacks, and these in it."""
    plots.draw(axes, members(panel.names[0].partition(",")[0]))
    mark(axes, [[part["eta"] for part in interfaces(looks[name])] for name in panel.names], panel.labels)


LABELS = ("low absorption", "high absorption")
PANELS = [Panel(title, (f"{name}, low", f"{name}, high"), LABELS) for name, title in TITLES.items()]
FIGURE = Looks(stacks, PANELS, chart=chart)
compute, draw = FIGURE.compute, FIGURE.draw
