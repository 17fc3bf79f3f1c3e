"""Belcour 2018, figure 8: the equivalent roughness of a medium, by absorption and by scattering.

Light along the normal is scattered once by the phase function of Henyey and Greenstein, forwards, and then (a) absorbed
along its way through a slab. Equivalent is the roughness of the GGX reflection that is as wide, by the variance on the
projected disc or the median of the slopes of half-vectors. (b) is what the model takes for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.api import lobes
from velatura.figures import Progress, canvas
from velatura.figures.bounces import NORMAL, WIDTHS, Light, along, bounce, equivalent, uniform
from velatura.optics import phase
from velatura.stack import Interface, Medium, Stack

DEPTHS = (0.0, 0.25, 0.5, 0.75, 1.0)
ASYMMETRIES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95, 0.98)


def compute(
    depths: Sequence[float] = DEPTHS,
    asymmetries: Sequence[float] = ASYMMETRIES,
    count: int = 2**15,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The equivalent roughness over `g` by `variance` and `median`, a list for each of `depth`, and of the `model`."""
    u = uniform(count)
    known = np.geomspace(1e-3, 1, 80)
    single = [bounce(along(NORMAL, count), a, a, *u[:2]) for a in known]
    numbers: dict[str, Any] = {"g": list(asymmetries), "depth": list(depths), "model": []}
    for g in asymmetries:
        stack = Stack([Medium(sigma_s=1.0, g=g), Interface(eta=1.0)])
        modelled = lobes(stack, 1.0, model="belcour2018", reflectance="fgd", medium="shipped").transmitted
        assert modelled is not None
        numbers["model"].append(float(modelled.alpha[0, 0]))
    for name in canvas.track(list(WIDTHS), progress):
        width = WIDTHS[name]
        scattered = [[width(_scattered(g, depth, *u[:2])) for g in asymmetries] for depth in depths]
        found = equivalent(scattered, [width(light) for light in single], known)
        numbers[name] = [[float(x) if np.isfinite(x) else None for x in row] for row in found]
    return numbers


def _scattered(g: float, depth: float, u1: Any, u2: Any) -> Light:
    """Light that is scattered forwards, after so deep a slab; up and down are as one."""
    cosine, azimuth = phase.sample_henyey_greenstein(g, u2), 2 * np.pi * u1
    sine = np.sqrt(np.maximum(1 - cosine**2, 0))
    energy = np.where(cosine > 0, np.exp(-depth * (1 / np.maximum(cosine, 1e-3) - 1)), 0.0)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.maximum(cosine, 0)]), energy


@canvas.page(9, 4)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """Curves by variance for every depth, from red for none to blue, and by both widths beside the model."""
    left, right = figure.subplots(1, 2, sharey=True)
    for depth, row in zip(numbers["depth"], numbers["variance"]):
        left.plot(numbers["g"], np.array(row, float), color=(1 - depth, 0, depth), label=f"depth {depth:g}")
    left.set(title="(a) absorption", xlabel="g", ylabel="equivalent alpha", ylim=(0, 1))
    for name, colour in (("variance", "C0"), ("median", "black")):
        right.plot(numbers["g"], np.array(numbers[name][0], float), color=colour, label=name)
    right.plot(numbers["g"], numbers["model"], color="C3", linestyle="--", label="model")
    right.set(title="(b) scattering", xlabel="g")
    left.legend(fontsize="small")
    right.legend(fontsize="small")
