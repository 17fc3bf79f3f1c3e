"""Bati et al. 2021, figure 17: two coloured lobes in either order, alike head-on, of other colours at grazing angles.

A blue and a red lobe, each of a pair of rough dielectrics with absorption. Light that reaches the lower pair passes
through the absorption of both, the longer the more it grazes. The indices between the interfaces are chosen here, as
the paper's are not printed; so are the sphere, which absorbs
what enters it, and its light.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from velatura.figures import canvas
from velatura.inverse import grazing, invert_stack, on_black, plots
from velatura.inverse.figure_targets import FIGURES
from velatura.model.stack_lobes import stack_lobes

ORDERS = ("17 blue over red", "17 red over blue")
COSINES = (1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1)
MODEL = "bati2021"


def compute(
    cosines: Sequence[float] = COSINES,
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """By order: the `stack`, its `energy` over `cosines` (rgb), red over blue at `grazing` angles; and `pictures`.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    numbers: dict[str, Any] = {"cosines": list(cosines), "pictures": {}}
    for order in canvas.track(ORDERS, progress):
        stack = invert_stack(FIGURES[order], MODEL).stack
        energy = np.sum(stack_lobes(stack, cosines, model=MODEL).energy, axis=0)
        red, _, blue = grazing(stack, MODEL).mean(axis=1)
        numbers[order] = {"stack": stack.to_dict(), "energy": energy.T.tolist(), "grazing": float(red / blue)}
        numbers["pictures"][order] = (
            canvas.spheres(on_black(stack), MODEL, "studio", size, spp, seed).mean(axis=0).tolist()
        )
    return numbers


def draw(numbers: dict[str, Any], path: str | Path) -> None:
    """A row for each order: the classes of both lobes, the sphere, and the energy over the angle.

    Raises:
        InvalidInput: the file cannot be written.
    """
    figure = canvas.canvas(15, 7)
    for row, order in zip(figure.subplots(2, 4), ORDERS):
        solution = invert_stack(FIGURES[order], MODEL)
        for n, (axes, members) in enumerate(zip(row, solution.classes)):
            plots.draw(axes, members, solution.layers[2 * n : 2 * n + 2])
            axes.set_title(f"lobe {n + 1}")
        canvas.show(row[2], np.array(numbers["pictures"][order]), order.partition(" ")[2])
        angles = np.degrees(np.arccos(numbers["cosines"]))
        for colour, energy in zip(plots.FILLS, np.transpose(numbers[order]["energy"])):
            row[3].plot(angles, energy, color=colour, marker=".")
        row[3].set(title="energy", xlabel="angle of incidence (°)", ylim=(0, None))
    canvas.save(figure, path)


if __name__ == "__main__":
    draw(compute(), "bati2021-17.png")
