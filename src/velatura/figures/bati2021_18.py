"""Bati et al. 2021, figure 18: one lobe of a pair of dielectrics, (a) less and more saturated, (b) smooth and rough."""

from __future__ import annotations

from velatura.figures import looks

TARGETS = ("18 a, less saturated", "18", "18 a, more saturated", "18 b, smooth", "18 b, rough")
FIGURE = looks.Looks.of(TARGETS)
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-18.png")
