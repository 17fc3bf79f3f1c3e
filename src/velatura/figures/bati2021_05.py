"""Bati et al. 2021, figure 5: stacks of an equivalence class, alike head-on, of other colours at grazing angles.

(a) The two dielectrics that reflect 0.04 below a coat of index 1.8; (b) two conductors that reflect 0.6 in air, at the
bounds of eta: in green the right one has the other bound; (c) the same below a coat of index 1.5, where Snell's law
leaves little of the difference. The indices of the coats, and which colour differs, are chosen here.
"""

from __future__ import annotations

import numpy as np

from velatura.figures import looks
from velatura.inverse import Choice, invert_interface
from velatura.stack import Interface, Stack

DARK, BRIGHT = 0.04, 0.6  # reflectance of the dielectrics, and of the conductors
TINTS = {"grey": (1.0, 1.0, 1.0), "green edge": (1.0, 0.0, 1.0)}  # of red, green and blue


def stacks() -> dict[str, Stack]:
    """By name, in pairs."""
    found = {}
    for side, name in ((1, "denser"), (-1, "rarer")):
        layers = invert_interface(DARK, exterior=1.8, choice=Choice(side=side))
        found[f"a {name}"] = Stack([Interface(eta=1.8), *layers.written(0)])
    for part, coat in (("b", 1.0), ("c", 1.5)):
        for name, tint in TINTS.items():
            choice = Choice("conductor", tint=np.array(tint)[:, None])
            layers = invert_interface(np.full((3, 1), BRIGHT), exterior=coat, choice=choice)
            found[f"{part} {name}"] = Stack([*([Interface(eta=coat)] if coat > 1 else []), *layers.written(0)])
    return found


FIGURE = looks.Looks(stacks)
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-05.png")
