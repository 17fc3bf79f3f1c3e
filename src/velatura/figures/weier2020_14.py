"""Weier & Belcour 2020, figure 14: failure with opposing anisotropies, which make a highlight no GGX lobe has.

Roughnesses (0.1, 0) over (0, 0.05), as printed, with the indices of figure 10. The highlight is that of light along the
normal: energies on the projected disc of all but what the first interface reflects.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from velatura import reference
from velatura.api import lobes
from velatura.figures import Progress, canvas
from velatura.figures.bounces import Array, along, bounce, uniform
from velatura.figures.weier2020 import CHOICES, stack
from velatura.reference import roughness
from velatura.reference.batches import ends

STACK = stack((0.1, 0.0), (0.0, 0.05))
EXTENT, BINS = 0.3, 60  # of the disc that is shown
UP = (0.0, 0.0, 1.0)


def compute(paths: int = 10**6, seed: int = 0, progress: Progress | None = None) -> dict[str, Any]:
    """The `alpha` of `model` and `walk` along both axes, `diagonal`, and `pictures` of the highlight around the normal.

    `diagonal` is the median of slopes of half-vectors along the diagonal, in units in which that along the axes is 1:
    it is 1 for every GGX reflection, or other distribution with elliptic contours.
    """
    modelled = lobes(STACK, 1.0, 0.0, "weier2020", **CHOICES).alpha[1][:, 0]
    walked = reference.statistics(STACK, 1.0, 0.0, paths, seed).alpha[1][:, 0]
    found = ends(STACK, np.array(UP), paths, seed, microsurface=False)
    below = (found.deepest > 0) & (found.w[2] > 0)
    lights = {
        "model": bounce(along(UP, paths), *np.maximum(modelled, 1e-3), *uniform(paths)[:2]),
        "walk": (found.w[:, below], found.weight[:, below].mean(axis=0)),
    }
    alphas = {"model": modelled, "walk": walked}
    numbers: dict[str, Any] = {**{name: {"alpha": alpha.tolist()} for name, alpha in alphas.items()}, "pictures": {}}
    for side, (w, energy) in canvas.track(list(lights.items()), progress):
        bounds = (-EXTENT, EXTENT)
        grid, _, _ = np.histogram2d(w[0], w[1], BINS, (bounds, bounds), weights=energy / energy.sum())
        numbers[side]["diagonal"] = _diagonal(w, energy)
        numbers["pictures"][side] = grid.tolist()
    return numbers


def _diagonal(w: Array, energy: Array) -> float:
    slopes = roughness.slopes(np.array(UP), w)
    u, v = slopes / roughness.medians(slopes, energy, radial=False)[0][:, None]
    return roughness.median(np.abs(u + v) / np.sqrt(2), energy)[0]


@canvas.page(9, 4.2)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """Both highlights, by the logarithm of their energy."""
    for axes, side in zip(figure.subplots(1, 2), ("walk", "model")):
        found = numbers[side]
        image = np.log10(np.maximum(np.transpose(numbers["pictures"][side]), 1e-7))
        extent = (-EXTENT, EXTENT) * 2
        axes.imshow(image, origin="lower", extent=extent, cmap="magma", vmin=-5, vmax=-2)
        u, v = found["alpha"]
        axes.set(title=f"{side}: alpha {u:.3f}, {v:.3f}; diagonal {found['diagonal']:.2f}", xlabel="x", ylabel="y")
