"""Bati et al. 2021, figure 14: a material without a coat, coated, and coated with its lobes unchanged.

(a) A coloured conductor; (b) a coloured pair of dielectrics. The coat of (a) has the index 1.5 and an alpha of 0.05;
that of (b), which the paper does not print, here as well. Above each the layers of the coated stack, in red those that
the inverse found.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.figures.looks import MODEL, Looks, Panel, inverted
from velatura.inverse import coat
from velatura.stack import Stack

ETA, ALPHA = 1.5, 0.05  # of the coat


def stacks() -> dict[str, Stack]:
    """Stacks by name, in threes."""
    found = {}
    for name, bare in inverted(("14 a", "14 b")).items():
        found[f"{name}, bare"] = bare
        found[f"{name}, coated"] = coat(bare, ETA, ALPHA, model=MODEL).stack
        found[f"{name}, kept"] = coat(bare, ETA, ALPHA, keep_appearance=True, model=MODEL).stack
    return found


def chart(axes: Any, panel: Panel, looks: Mapping[str, Any]) -> None:
    """Write the layers of a panel's coated stack."""
    axes.set_axis_off()
    axes.set_title("layers, from the top", fontsize="medium")
    _, name = panel.names
    for n, layer in enumerate(looks[name]["stack"]["layers"]):
        ((kind, values),) = layer.items()
        colour = "tab:red" if "kept" in name and n else "black"
        text = described(kind, values)
        axes.text(0, 0.9 - 0.22 * n, text, color=colour, fontsize="medium", va="top", transform=axes.transAxes)


def described(kind: str, values: Mapping[str, Any]) -> str:
    """A layer in one or two lines."""
    if kind == "medium":
        return f"optical depth {_written(np.multiply(values['sigma_a'], values.get('depth', 1.0)))}"
    index = f"eta {_written(values['eta'])}" + (f"\nk {_written(values['k'])}" if "k" in values else "")
    return f"{index}, alpha {values.get('alpha', 0.0):.3g}"


def _written(value: Any) -> str:
    return ", ".join(f"{x:.3g}" for x in np.atleast_1d(value))


PANELS = [
    Panel(f"({part}) {title}", (f"14 {part}, bare", f"14 {part}, {kind}"), ("bare", kind))
    for part in "ab"
    for kind, title in (("coated", "naively coated"), ("kept", "coated, lobes kept"))
]
FIGURE = Looks(stacks, PANELS, chart=chart, detail=True)
compute, draw = FIGURE.compute, FIGURE.draw
