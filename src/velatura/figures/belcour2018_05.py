"""Belcour 2018, figure 5: the mean of refracted light, and the direction that Snell's law gives to its mean.

The mean is that of random walks through one rough interface, on the projected disc. The paper prints neither indices
nor roughnesses: here they are 1.2, 1.5 and 2, and 1 below 1.5, with alpha .1 and .5.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura import reference
from velatura.figures import Progress, canvas
from velatura.stack import Interface, Stack

ALPHAS = (0.1, 0.5)
INDICES = ((1.0, 1.2), (1.0, 1.5), (1.0, 2.0), (1.5, 1.0))  # above and below
SINES = tuple(np.linspace(0, 0.95, 11).round(3).tolist())


def compute(
    alphas: Sequence[float] = ALPHAS,
    sines: Sequence[float] = SINES,
    paths: int = 100_000,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """A list of `curves` by `alpha`, `above` and `below`: over `sine`, the `mean` of what passes, and Snell's.

    None where Snell's law has no solution. `error` is the standard error of the mean.
    """
    numbers: dict[str, Any] = {"sine": list(sines), "curves": []}
    sine = np.array(sines)
    for alpha, (above, below) in canvas.track([(a, eta) for a in alphas for eta in INDICES], progress):
        stack = Stack([Interface(eta=below, alpha=alpha)], exterior=above)
        found = reference.statistics(stack, np.sqrt(1 - sine**2), 0.0, paths, seed)
        assert found.transmitted and found.standard_error and found.standard_error.transmitted
        refracted = sine * above / below
        numbers["curves"].append(
            {
                "alpha": float(alpha),
                "above": above,
                "below": below,
                "mean": (-found.transmitted.mean[0]).tolist(),
                "error": found.standard_error.transmitted.mean[0].tolist(),
                "snell": [float(x) if x < 1 else None for x in refracted],
            }
        )
    return numbers


@canvas.page()
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """A plot for each roughness, Snell's law dashed."""
    alphas = sorted({curve["alpha"] for curve in numbers["curves"]})
    figure.set_size_inches(4.5 * len(alphas), 4.2)
    for axes, alpha in zip(figure.subplots(1, len(alphas), squeeze=False)[0], alphas):
        for n, curve in enumerate(curve for curve in numbers["curves"] if curve["alpha"] == alpha):
            label = f"{curve['above']:g} to {curve['below']:g}"
            axes.plot(numbers["sine"], curve["mean"], color=f"C{n}", marker=".", label=label)
            axes.plot(numbers["sine"], np.array(curve["snell"], float), color=f"C{n}", linestyle="--")
        axes.set(title=f"alpha {alpha:g}", xlabel="sine of incidence", ylabel="mean of what is refracted", ylim=(0, 1))
        axes.legend(fontsize="small")
