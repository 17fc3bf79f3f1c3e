"""Weier & Belcour 2020, figure 4: lobes of anisotropic GGX on the projected disc keep to the axes of the roughness.

The paper prints neither roughnesses nor incidences: here (0.05, 0.2) and (0.1, 0.4), from 45 and 70 degrees, along the
tangent and half-way to the bitangent. Axes are those of the spot where a lobe is at least half as high as its peak.
"""

from __future__ import annotations

from typing import Any

from velatura.figures import Progress, canvas, disc

ALPHAS = ((0.05, 0.2), (0.1, 0.4))
INCIDENCES = ((45, 0), (45, 45), (70, 0), (70, 45))  # zenith angle and azimuth, degrees
SHOWN = 100  # points along a side of what is kept of a lobe


def compute(count: int = 500, progress: Progress | None = None) -> dict[str, Any]:
    """A list of `cells` by `alpha`, `theta`, `phi`: the `turn` of a lobe's axes, in degrees, and `aspect`.

    `pictures` are the lobes on grids over the disc.
    """
    x, y = disc.grid(count)
    step = max(count // SHOWN, 1)
    numbers: dict[str, Any] = {"cells": [], "pictures": []}
    for alpha, (theta, phi) in canvas.track([(a, i) for a in ALPHAS for i in INCIDENCES], progress):
        lobe = disc.reflected(disc.incidence(theta, phi), x, y, *alpha)
        spot = disc.ellipse(x, y, lobe)
        cell = {"alpha": list(alpha), "theta": theta, "phi": phi, "turn": spot.turn, "aspect": spot.aspect}
        numbers["cells"].append(cell)
        numbers["pictures"].append(lobe[::step, ::step].tolist())
    return numbers


@canvas.page(11, 6)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """A row for each roughness, the incidence marked by a cross."""
    for axes, cell, lobe in zip(figure.subplots(2, 4).flat, numbers["cells"], numbers["pictures"]):
        u, v = cell["alpha"]
        disc.show(axes, lobe, f"alpha {u:g}, {v:g}: turned by {cell['turn']:.1f}°")
        at = disc.incidence(cell["theta"], cell["phi"])
        axes.plot([at[0]], [at[1]], "kx")
