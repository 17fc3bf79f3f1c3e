"""Bati et al. 2021, figure 6: the directional albedo of a rough dielectric head-on, over its relative index.

Against Fresnel's reflectance, which is a good approximation for indices above 1 and low roughness.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.inverse import Above, Layers
from velatura.model import named
from velatura.model.variance import Roughness
from velatura.optics import fresnel

ALPHAS = (0.01, 0.1, 0.2, 0.4)
NEAR_1 = 0.05  # by which an index differs from 1 at least where albedos are compared: there both vanish


def compute(alphas: Sequence[float] = ALPHAS, count: int = 200, progress: Progress | None = None) -> dict[str, Any]:
    """Reflectances over the relative index `eta`: of a smooth interface, `fresnel`, and of `rough` ones by `alpha`.

    `denser` and `rarer` are the largest differences relative to Fresnel on either side of an index of 1.
    """
    eta = np.geomspace(0.25, 4, count)
    smooth = fresnel.normal_incidence(eta)
    numbers: dict[str, Any] = {"eta": eta.tolist(), "fresnel": smooth.tolist(), "rough": []}
    above = Above.nothing(named("bati2021"))
    for alpha in canvas.track(alphas, progress):
        roughness = Roughness(np.full(count, alpha), np.full(count, alpha), 0.0)
        albedo = np.ravel(above.reflectance(Layers("dielectric", eta[None], None, roughness, 0.0)))
        off = np.abs(albedo / np.maximum(smooth, 1e-12) - 1)
        sides = {"denser": eta > 1 + NEAR_1, "rarer": eta < 1 / (1 + NEAR_1)}
        worst = {side: float(off[where].max()) for side, where in sides.items()}
        numbers["rough"].append({"alpha": alpha, "albedo": albedo.tolist(), **worst})
    return numbers


@canvas.page(6, 4.4)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The curves in one plot."""
    axes = figure.subplots()
    for row in numbers["rough"]:
        axes.plot(numbers["eta"], row["albedo"], label=f"alpha {row['alpha']:g}")
    axes.plot(numbers["eta"], numbers["fresnel"], "k:", label="Fresnel")
    axes.set(xlabel="relative index", ylabel="directional albedo head-on", ylim=(0, None))
    axes.legend(fontsize="small")
