"""Bati et al. 2021, figure 14: a material without a coat, coated, and coated with its lobes unchanged.

(a) A coloured conductor; (b) a coloured pair of dielectrics. The coat of (a) has the index 1.5 and an alpha of 0.05;
that of (b), which the paper does not print, here as well.
"""

from __future__ import annotations

from velatura.figures import looks
from velatura.inverse import coat
from velatura.stack import Stack

ETA, ALPHA = 1.5, 0.05  # of the coat


def stacks() -> dict[str, Stack]:
    """By name, in threes."""
    found = {}
    for name, bare in looks.inverted(("14 a", "14 b")).items():
        found[f"{name}, bare"] = bare
        found[f"{name}, coated"] = coat(bare, ETA, ALPHA, model=looks.MODEL).stack
        found[f"{name}, kept"] = coat(bare, ETA, ALPHA, keep_appearance=True, model=looks.MODEL).stack
    return found


FIGURE = looks.Looks(stacks)
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-14.png")
