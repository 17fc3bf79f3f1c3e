"""Belcour 2018, figure 6: a rough interface refracts into a narrower lobe than it reflects into.

Lobes are energies per area of the projected disc, in the plane of incidence, without Fresnel, scaled to 1 at their
highest. Incidence is at 30 degrees, as printed; index (1.5) and alpha (0.1) are chosen here.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from velatura.figures import Progress, canvas, disc
from velatura.figures.disc import Array

ETA, ALPHA, ANGLE = 1.5, 0.1, 30.0


def width(x: Array, lobe: Array) -> float:
    """Where the lobe is higher than half of its height, on the disc; it ends at the horizon."""
    x, lobe = np.pad(x, 1, mode="edge"), np.pad(lobe, 1)
    inside = np.flatnonzero(lobe >= 0.5)
    ends = []
    for i, j in ((inside[0], inside[0] - 1), (inside[-1], inside[-1] + 1)):
        share = (lobe[i] - 0.5) / (lobe[i] - lobe[j])
        ends.append(x[i] + share * (x[j] - x[i]))
    return float(ends[1] - ends[0])


def compute(
    eta: float = ETA, alpha: float = ALPHA, angle: float = ANGLE, count: int = 1001, progress: Progress | None = None
) -> dict[str, Any]:
    """Both lobes over `sine`, the outgoing one, and the `width` of each at half its height."""
    x, wi = np.linspace(-1, 1, count + 2)[1:-1], disc.incidence(angle, 180)
    zero = np.zeros_like(x)
    lobes = {
        "reflected": disc.reflected(wi, x, zero, alpha, alpha),
        "refracted": disc.refracted(wi, x, zero, alpha, alpha, eta),
    }
    if progress:
        progress(1, 1)
    return {
        "sine": x.tolist(),
        **{name: lobe.tolist() for name, lobe in lobes.items()},
        "width": {name: width(x, lobe) for name, lobe in lobes.items()},
    }


@canvas.page(6, 4)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """Both lobes over the sine of the outgoing angle."""
    axes = figure.subplots()
    for name, colour in (("reflected", "C3"), ("refracted", "C0")):
        axes.plot(numbers["sine"], numbers[name], color=colour, label=f"{name}, width {numbers['width'][name]:.3f}")
    axes.set(xlabel="sine of the outgoing angle", ylabel="energy per area of the disc, over its highest")
    axes.set_title(f"index {ETA:g}, alpha {ALPHA:g}, incidence {ANGLE:g}°")
    axes.legend()
