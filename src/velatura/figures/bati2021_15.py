"""Bati et al. 2021, figure 15: pairs of one class with little and with much absorption, alike head-on.

(a) Grey and smooth, (b) coloured and smooth, (c) coloured and rough. The index between the interfaces is 1.2, that
below them the one that needs least absorption, and 4.
"""

from __future__ import annotations

from velatura.figures import looks
from velatura.inverse import invert_stack
from velatura.inverse.figure_targets import FIGURES
from velatura.stack import Stack

ETA_1, ETA_2 = 1.2, 4.0


def stacks() -> dict[str, Stack]:
    """By name, in pairs."""
    found = {}
    for name in ("15 a", "15 b", "15 c"):
        members = invert_stack(FIGURES[name], looks.MODEL).classes[0]
        found[f"{name}, low"] = looks.of_layers(members.member(ETA_1))
        found[f"{name}, high"] = looks.of_layers(members.member(ETA_1, ETA_2))
    return found


FIGURE = looks.Looks(stacks)
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-15.png")
