"""Belcour 2018, figure 3: the plane that statistics are taken in, and the variance of GGX after one and two bounces.

Light comes along the normal; the second surface faces the first, and is as rough. The lobe on the left, whose
parameters are chosen here (alpha 0.3, incidence of 45 degrees), shows the projection.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.figures.bounces import NORMAL, along, bounce, uniform, variance

ALPHAS = (0.01, 0.02, 0.05, *np.linspace(0.1, 1, 19).round(2).tolist())
LOBE, ANGLE, BINS = 0.3, 45, 80


def compute(alphas: Sequence[float] = ALPHAS, count: int = 2**15, progress: Progress | None = None) -> dict[str, Any]:
    """Variances along an axis of the disc, over `alpha`, after `one` and `two` bounces of `count` directions.

    `pictures` hold the energy of the `lobe` on a grid over the disc, from -1 to 1, in rows of x.
    """
    u = uniform(count)
    numbers: dict[str, Any] = {"alpha": list(alphas), "one": [], "two": []}
    for alpha in canvas.track(alphas, progress):
        once = bounce(along(NORMAL, count), alpha, alpha, *u[:2])
        numbers["one"].append(variance(once))
        numbers["two"].append(variance(bounce(once, alpha, alpha, *u[2:])))

    tilted = np.sin(np.radians(ANGLE)), 0.0, np.cos(np.radians(ANGLE))
    directions, energy = bounce(along(tilted, count), LOBE, LOBE, *u[:2])
    grid, _, _ = np.histogram2d(directions[0], directions[1], BINS, ((-1, 1), (-1, 1)), weights=energy / count)
    return {**numbers, "pictures": {"lobe": grid.tolist()}}


@canvas.page(9, 4)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The lobe on the disc, and the variances over roughness."""
    left, right = figure.subplots(1, 2)
    left.imshow(np.transpose(numbers["pictures"]["lobe"]), origin="lower", extent=(-1, 1, -1, 1), cmap="Blues")
    left.plot(*np.array([np.cos(t := np.linspace(0, 2 * np.pi, 200)), np.sin(t)]), color="0.5", linewidth=1)
    left.plot([np.sin(np.radians(ANGLE))], [0], "kx")
    left.set(title=f"alpha {LOBE:g}, incidence {ANGLE}° (cross)", xlabel="x", ylabel="y", aspect="equal")
    for name, label, colour in (("one", "one bounce", "C0"), ("two", "two bounces", "C3")):
        right.plot(numbers["alpha"], numbers[name], color=colour, marker=".", label=label)
    right.set(title="variance on the disc", xlabel="alpha", ylim=(0, None))
    right.legend()
