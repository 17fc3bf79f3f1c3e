"""Bati et al. 2021, figure 21: the profile of haze: the upper lobe is the blurred one (left), or the lower one (right).

With what each lobe contributes. With plain Fresnel: by directional albedos there is no stack for the left one, as 3e-5
of variance are missing.
"""

from __future__ import annotations

from velatura.figures.looks import Looks

TARGETS = {"21 left": "upper lobe blurred", "21 right": "lower lobe blurred"}
FIGURE = Looks.apart(TARGETS, reflectance="fresnel")
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-21.png")
