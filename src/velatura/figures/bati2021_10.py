"""Bati et al. 2021, figure 10: two stacks each that reflect 0.15 head-on, and differ at grazing angles.

(a) One smooth interface, and a slab, whose lower interface is in air; (b) a smooth pair without and with absorption;
(c) the same of variance 0.02. (d) Below, the energies and variances of the interfaces. The indices of (b) and (c) are
chosen here.
"""

from __future__ import annotations

from velatura.figures.looks import MODEL, Looks, Panel
from velatura.inverse import invert_stack, smooth_pair
from velatura.stack import Interface, Stack

ENERGY, VARIANCE = 0.15, 0.02
INDICES = {"clear": (1.2, None), "absorbing": (1.2, 4.0)}  # eta 1 and 2; None: that which needs no absorption


def stacks() -> dict[str, Stack]:
    """By name, in pairs."""
    points = smooth_pair.points(1.0, ENERGY)
    (one, _), (slab, _) = points["matched below"], points["slab"]
    found = {
        "a one interface": Stack([Interface(eta=one[1])]),
        "a slab": Stack([Interface(eta=slab[0]), Interface(eta=slab[1])]),
    }
    for part, variance in (("b", 0.0), ("c", VARIANCE)):
        for name, indices in INDICES.items():
            lobe = {"energy": ENERGY, "variance": variance, "interfaces": 2, "fixed": {"eta": list(indices)}}
            found[f"{part} {name}"] = invert_stack([lobe], MODEL).stack
    return found


PANELS = [
    Panel("(a) clear", ("a one interface", "a slab"), ("one interface", "slab")),
    Panel("(b) smooth pairs", ("b clear", "b absorbing"), tuple(INDICES)),
    Panel("(c) rough pairs", ("c clear", "c absorbing"), tuple(INDICES)),
]
FIGURE = Looks(stacks, PANELS, detail=True)
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-10.png")
