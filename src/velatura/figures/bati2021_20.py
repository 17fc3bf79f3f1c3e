"""Bati et al. 2021, figure 20: the colour of haze: of two lobes the upper one is green, or the lower one."""

from __future__ import annotations

from velatura.figures import looks

TARGETS = ("20 left", "20 right")
FIGURE = looks.Looks.of(TARGETS)
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-20.png")
