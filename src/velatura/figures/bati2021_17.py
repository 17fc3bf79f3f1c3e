"""Bati et al. 2021, figure 17: two coloured lobes in either order, alike head-on, of other colours at grazing angles.

A blue and a red lobe, each of a pair of rough dielectrics with absorption. Light that reaches the lower pair passes
through the absorption of both, the longer the more it grazes. The indices are those that the inverse prefers, as the
paper's are not printed; the sphere, which absorbs what enters it, and its light are chosen here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas, looks
from velatura.figures.bati2021_targets import FIGURES
from velatura.figures.looks import MODEL
from velatura.inverse import alternatives, grazing, invert_stack, plots
from velatura.model.registry import stack_lobes
from velatura.stack import Stack

ORDERS = ("17 blue over red", "17 red over blue")


def compute(
    cosines: Sequence[float] = looks.COSINES,
    size: int = looks.SIZE,
    spp: int = looks.SAMPLES,
    seed: int = 0,
    members: int = 29,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The `stack` by order, its `energy` over `cosines` (rgb), red over blue at `grazing` angles; and `pictures`.

    `least` and `most` are the bounds of that of so many `members` of the class.
    """
    numbers: dict[str, Any] = {"cosines": list(cosines)}
    stacks = {order: invert_stack(FIGURES[order], MODEL).stack for order in ORDERS}
    for order, stack in stacks.items():
        energy = np.sum(stack_lobes(stack, cosines, model=MODEL).energy, axis=0)
        drawn = [_tint(other.stack) for other in alternatives(FIGURES[order], members, MODEL, seed)]
        numbers[order] = {"stack": stack.to_dict(), "energy": energy.T.tolist(), "grazing": _tint(stack)}
        numbers[order] |= {"least": min(drawn), "most": max(drawn)}
    return numbers | {"pictures": looks.pictures(stacks, size, spp, seed, progress)}


def _tint(stack: Stack) -> float:
    """Red over blue at grazing angles."""
    red, _, blue = grazing(stack, MODEL).mean(axis=1)
    return float(red / blue)


@canvas.page(13, 8)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The sphere in the middle, a half of either order, and its energies; beside it the classes of both lobes."""
    left, (sphere, energy), right = figure.subplots(2, 3).T
    for column, order in zip((left, right), ORDERS):
        solution = invert_stack(FIGURES[order], MODEL)
        for n, (axes, members) in enumerate(zip(column, solution.classes)):
            plots.draw(axes, members, solution.layers[2 * n : 2 * n + 2])
            axes.set_title(f"{order.partition(' ')[2]}: {'lower' if n else 'upper'} lobe", fontsize="medium")
    seen = canvas.shown(numbers["pictures"])
    labels = [order.partition(" ")[2] for order in ORDERS]
    looks.split(sphere, looks.halves(looks.Panel("", ORDERS), seen), "", labels)
    angles = np.degrees(np.arccos(numbers["cosines"]))
    looks.curves(energy, angles, [np.array(numbers[order]["energy"]) for order in ORDERS], labels)
    energy.set(title="energy, both lobes", xlabel="angle of incidence (°)", ylim=(0, None))
