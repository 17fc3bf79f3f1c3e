"""Bati et al. 2021, figure 18: one lobe of a pair of dielectrics, (a) less and more saturated, (b) smooth and rough."""

from __future__ import annotations

from velatura.figures.looks import Looks

TARGETS = {
    "18 a, less saturated": "(a) less saturated",
    "18": "initial",
    "18 a, more saturated": "(a) more saturated",
    "18 b, smooth": "(b) smooth",
    "18 b, rough": "(b) rough",
}
FIGURE = Looks.of(TARGETS)
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-18.png")
