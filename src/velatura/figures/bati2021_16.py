"""Bati et al. 2021, figure 16: coated conductors that are alike and grey head-on; absorption gives a pink edge.

Beside the reference (a) a lower index of the coat, (b) green absorbed in it, (c) both. How much is chosen here.
"""

from __future__ import annotations

from velatura.figures import looks
from velatura.inverse import invert_stack
from velatura.inverse.figure_targets import FIGURES
from velatura.stack import Stack

CLEAR, GREEN = [0.0, 0.0, 0.0], [0.0, 0.3, 0.0]  # optical depths of the coat
CHOICES = {"reference": (1.5, CLEAR), "a": (1.2, CLEAR), "b": (1.5, GREEN), "c": (1.2, GREEN)}  # by its index


def stacks() -> dict[str, Stack]:
    """By name."""
    found = {}
    for name, (eta, tau) in CHOICES.items():
        (lobe,) = FIGURES["16"]
        fixed = {"eta": [eta, None], "tau": [None, tau]}
        found[name] = invert_stack([lobe | {"fixed": fixed}], looks.MODEL).stack
    return found


FIGURE = looks.Looks(stacks)
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-16.png")
