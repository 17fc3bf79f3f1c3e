"""Yamaguchi et al. 2019, figure 3: reflected and refracted lobes on the projected disc, over the angle of incidence.

The roughness is that chosen for figure 2, the index 1.5. Sizes and aspects are those of the spots that are at least
half as high as the peak, and stand beside what the Jacobians (Yamaguchi et al. 2019, Eqs. 4-5) make of the distribution
of normals.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas, disc
from velatura.figures.yamaguchi2019_02 import ALPHA, SHOWN, TURN
from velatura.optics import fresnel

ANGLES = (0, 15, 30, 45, 60, 75)  # degrees
ETA = 1.5


def compute(angles: Sequence[float] = ANGLES, count: int = 1500, progress: Progress | None = None) -> dict[str, Any]:
    """The `aspect`, `turn` (degrees), and `size` over that of the normals, of `reflected` and `refracted` over `angle`.

    `jacobian` is that ratio by Yamaguchi et al. 2019, Eqs. 4-5; `pictures` are the lobes on grids over the disc.
    """
    x, y = disc.grid(count)
    step = max(count // SHOWN, 1)
    normals = disc.ellipse(x, y, disc.normals(x, y, *ALPHA))
    names = ("reflected", "refracted")
    numbers: dict[str, Any] = {"angle": list(angles), "normals": {"aspect": normals.aspect, "size": normals.size}}
    numbers |= {name: {key: [] for key in ("aspect", "turn", "size", "jacobian")} for name in names}
    numbers["pictures"] = {name: [] for name in names}
    for angle in canvas.track(angles, progress):
        wi = disc.incidence(angle, -TURN)
        lobes = disc.reflected(wi, x, y, *ALPHA), disc.refracted(wi, x, y, *ALPHA, ETA)
        jacobians = 2 * wi[2], fresnel.cos_transmitted(wi[2], ETA) - wi[2] / ETA
        for name, lobe, jacobian in zip(names, lobes, jacobians):
            spot = disc.ellipse(x, y, lobe)
            found = numbers[name]
            found["aspect"].append(spot.aspect)
            found["turn"].append(spot.turn)
            found["size"].append(spot.size / normals.size)
            found["jacobian"].append(float(jacobian))
            numbers["pictures"][name].append(lobe[::step, ::step].tolist())
    return numbers


@canvas.page()
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """A row for reflection and one for refraction, a column for each angle."""
    figure.set_size_inches(2.4 * len(numbers["angle"]), 5.2)
    rows = figure.subplots(2, len(numbers["angle"]), squeeze=False)
    for row, name in zip(rows, ("reflected", "refracted")):
        found = numbers[name]
        for axes, angle, lobe, aspect in zip(row, numbers["angle"], numbers["pictures"][name], found["aspect"]):
            disc.show(axes, np.array(lobe), f"{name}, {angle:g}°: {aspect:.2f}")
