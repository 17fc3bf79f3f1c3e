"""Bati et al. 2021, figure 5: stacks of an equivalence class, alike head-on, of other colours at grazing angles.

(a) The two dielectrics that reflect 0.04 below a coat of index 1.8; (b) two conductors that reflect 0.6 in air, at the
bounds of eta: in green the right one has the other bound; (c) the same below a coat of index 1.5, where Snell's law
leaves little of the difference. (d) Above each, Fresnel's reflectance of both over the angle in the medium above, and
the part that light from the outside cannot reach. The indices of the coats, and which colour differs, are chosen here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from velatura.figures.looks import MODEL, STYLES, Looks, Panel, interfaces
from velatura.inverse import Choice, invert_interface
from velatura.optics import fresnel
from velatura.stack import Interface, Stack

DARK, BRIGHT = 0.04, 0.6  # reflectance of the dielectrics, and of the conductors
TINTS = {"grey": (1.0, 1.0, 1.0), "green edge": (1.0, 0.0, 1.0)}  # of red, green and blue
GREEN = 1


def stacks() -> dict[str, Stack]:
    """Stacks by name, in pairs."""
    found = {}
    for side, name in ((1, "denser"), (-1, "rarer")):
        layers = invert_interface(DARK, exterior=1.8, choice=Choice(side=side), model=MODEL)
        found[f"a {name}"] = Stack([Interface(eta=1.8), *layers.written(0)])
    for part, coat in (("b", 1.0), ("c", 1.5)):
        for name, tint in TINTS.items():
            choice = Choice("conductor", tint=np.array(tint)[:, None])
            layers = invert_interface(np.full((3, 1), BRIGHT), exterior=coat, choice=choice, model=MODEL)
            found[f"{part} {name}"] = Stack([*([Interface(eta=coat)] if coat > 1 else []), *layers.written(0)])
    return found


def below(look: Mapping[str, Any]) -> tuple[float, Any]:
    """The index above a stack's last interface, and Fresnel's reflectance (91,) of that, in green, over each degree."""
    *coats, last = interfaces(look)
    above = coats[-1]["eta"] if coats else 1.0
    eta, k = (np.broadcast_to(last.get(key) or 0.0, 3)[GREEN] / above for key in ("eta", "k"))
    cosines = np.cos(np.radians(np.arange(91)))
    return above, fresnel.conductor(cosines, eta, k) if k else fresnel.dielectric(cosines, eta)


def chart(axes: Any, panel: Panel, looks: Mapping[str, Any]) -> None:
    """Draw (d)."""
    for name, label, style in zip(panel.names, panel.labels, STYLES):
        above, reflectance = below(looks[name])
        axes.plot(reflectance, f"g{style}" if label == EDGES[1] else f"k{style}", label=label)
    limit = np.degrees(np.arcsin(1 / above))
    axes.axvspan(limit, 90, color="0.9", label="not reached from air" if above > 1 else None)
    axes.set(title=f"(d) Fresnel below index {above:g}", xlabel="angle in that medium (°)", ylim=(0, 1), xlim=(0, 90))
    axes.legend(fontsize="x-small")


EDGES = ("grey edge", "green edge")
PANELS = [
    Panel("(a) dielectrics below a coat of 1.8", ("a denser", "a rarer"), ("denser", "rarer")),
    Panel("(b) conductors in air", ("b grey", "b green edge"), EDGES),
    Panel("(c) conductors below a coat of 1.5", ("c grey", "c green edge"), EDGES),
]
FIGURE = Looks(stacks, PANELS, chart=chart)
compute, draw = FIGURE.compute, FIGURE.draw
