"""Bati et al. 2021, figure 19: haze, as the variance of a conductor under a smooth coat grows from (a) to (c).

With plain Fresnel the conductor keeps its indices, as the paper says; with directional albedos they change a little.
"""

from __future__ import annotations

from velatura.figures.looks import Looks

TARGETS = {"19 a": "(a) subtle haze", "19 b": "(b) initial haze", "19 c": "(c) strong haze"}
FIGURE = Looks.of(TARGETS, reflectance="fresnel")
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-19.png")
