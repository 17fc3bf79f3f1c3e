"""Bati et al. 2021, figure 22: a smooth coat over a yellowish lobe (top), over a blueish one (middle), over both."""

from __future__ import annotations

from velatura.figures.looks import Looks

TARGETS = {
    "22 top": "coat over yellowish",
    "22 middle": "coat over blueish",
    "22 bottom": "coat over blueish over yellowish",
}
FIGURE = Looks.of(TARGETS)
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-22.png")
