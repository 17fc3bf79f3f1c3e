"""Bati et al. 2021, figure 22: a smooth coat over a yellowish lobe (top), over a blueish one (middle), over both."""

from __future__ import annotations

from velatura.figures import looks

TARGETS = ("22 top", "22 middle", "22 bottom")
FIGURE = looks.Looks.of(TARGETS)
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-22.png")
