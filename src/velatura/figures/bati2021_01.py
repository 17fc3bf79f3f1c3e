"""Bati et al. 2021, figure 1: a gallery of materials found from given lobes.

(a) Colour and sharpness of a pair of dielectrics; (b) the edge of a coated conductor; (c) a coat on a pair that keeps
its appearance; (d) extent and colour of haze. The object, its light, and the choice of materials are ours.
"""

from __future__ import annotations

from velatura.figures import bati2021_14, bati2021_16
from velatura.figures.looks import Looks, Panel, inverted
from velatura.stack import Stack

TARGETS = {"18": "a", "18 b, rough": "a, rough", "19 a": "d", "19 c": "d, more haze"}


def stacks() -> dict[str, Stack]:
    """By name."""
    found = {TARGETS[name]: stack for name, stack in inverted(tuple(TARGETS)).items()}
    metals, coats = bati2021_16.stacks(), bati2021_14.stacks()
    found |= {"b": metals["reference"], "b, pink edge": metals["c"]}
    found |= {"c": coats["14 b, bare"], "c, coated": coats["14 b, kept"]}
    return dict(sorted(found.items()))


PANELS = [
    Panel("(a) sharpness", ("a", "a, rough"), ("initial", "rough")),
    Panel("(b) edge", ("b", "b, pink edge"), ("grey edge", "pink edge")),
    Panel("(c) coat", ("c", "c, coated"), ("bare", "coated")),
    Panel("(d) haze", ("d", "d, more haze"), ("subtle", "strong")),
]
FIGURE = Looks(stacks, PANELS, {"scene": "ball"})
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-01.png")
