"""Bati et al. 2021, figure 20: the colour of haze: of two lobes the upper one is green, or the lower one.

With what each lobe contributes.
"""

from __future__ import annotations

from velatura.figures.looks import Looks

TARGETS = {"20 left": "green highlight", "20 right": "green haze"}
FIGURE = Looks.apart(TARGETS)
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-20.png")
