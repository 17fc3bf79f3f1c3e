"""Bati et al. 2021, figure 21: the profile of haze: the upper lobe is the blurred one (left), or the lower one (right).

With plain Fresnel: by directional albedos there is no stack for the left one, as 3e-5 of variance are missing.
"""

from __future__ import annotations

from velatura.figures import looks

TARGETS = ("21 left", "21 right")
FIGURE = looks.Looks.of(TARGETS, reflectance="fresnel")
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-21.png")
