"""Bati et al. 2021, figure 19: haze, as the variance of a conductor under a smooth coat grows from (a) to (c).

With plain Fresnel the conductor keeps its indices, as the paper says; with directional albedos they change a little.
"""

from __future__ import annotations

from velatura.figures import looks

TARGETS = ("19 a", "19 b", "19 c")
FIGURE = looks.Looks.of(TARGETS, reflectance="fresnel")
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-19.png")
