"""Belcour 2018, figure 21: the mean variance of a stack's lobes against random walks.

Above, as in the paper, light comes along the normal and the roughness of the topmost interface grows, with two and with
four interfaces. Below, for the two interfaces, the mean and the variance over the angle of incidence; the roughness of
the topmost one is chosen here. The paper leaves open in which space the variance is taken. Here it is that of the
outgoing directions on the projected disc, half its trace, and its mean over lobes weighs by their energies.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura import reference
from velatura.comparison.evaluated_lobes import account
from velatura.figures import Progress, canvas
from velatura.model import named
from velatura.stack import Interface, Stack

MODEL = "belcour2018"
ALPHAS = tuple(i / 10 for i in range(11))
ANGLES = (0, 15, 30, 45, 60, 70, 80)  # degrees
TOP = 0.1  # roughness of the topmost interface where the angle changes


def two(alpha: float) -> Stack:
    """A dielectric over a metal."""
    return Stack([Interface(eta=1.4, alpha=alpha), Interface(eta=1.0, k=1.0, alpha=0.3)])


def four(alpha: float) -> Stack:
    """Three dielectrics over a metal."""
    below = [Interface(eta=1.2, alpha=0.1), Interface(eta=1.4, alpha=0.1), Interface(eta=1.0, k=1.0, alpha=0.01)]
    return Stack([Interface(eta=1.4, alpha=alpha), *below])


def compute(
    alphas: Sequence[float] = ALPHAS,
    angles: Sequence[float] = ANGLES,
    paths: int = 300_000,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Model and walk, side by side: `two` and `four` over `alpha`, and `angle` over degrees.

    Each side has the mean x and variance of all that is reflected, and energy, variance and alpha of the deepest lobe;
    the walk also the standard error of that variance.
    """
    cases = [("two", alpha, two(alpha), 1.0) for alpha in alphas]
    cases += [("four", alpha, four(alpha), 1.0) for alpha in alphas]
    cases += [("angle", angle, two(TOP), float(np.cos(np.radians(angle)))) for angle in angles]
    numbers: dict[str, Any] = {name: {"over": [], "model": {}, "walk": {}} for name in ("two", "four", "angle")}
    for name, x, stack, cosine in canvas.track(cases, progress):
        numbers[name]["over"].append(float(x))
        sides = {"model": _modelled(stack, cosine), "walk": _walked(stack, cosine, paths, seed)}
        for side, found in sides.items():
            for quantity, value in found.items():
                numbers[name][side].setdefault(quantity, []).append(float(value))
    return {"model": MODEL, "paths": paths, "top_alpha": TOP, **numbers}


def _modelled(stack: Stack, cosine: float) -> dict[str, float]:
    lobes = account(stack, [cosine], named(MODEL, **canvas.CHOICES)).reflected
    energy, mean, covariance = (
        np.array([getattr(x, f)[:, 0] for x in lobes]) for f in ("energy", "mean", "covariance")
    )
    return _summary(energy, mean, covariance, lobes[-1].alpha[0, 0])


def _walked(stack: Stack, cosine: float, paths: int, seed: int) -> dict[str, float]:
    found = reference.statistics(stack, cosine, 0.0, paths, seed)
    energy, mean, covariance = (np.array(getattr(found, f))[..., 0] for f in ("energy", "mean", "covariance"))
    assert found.standard_error
    errors = np.nan_to_num(np.array(found.standard_error.covariance)[..., 0])
    share = energy.mean(axis=1) / energy.mean()
    error = np.sqrt(np.sum((share[:, None] * errors[:, [0, 2]] / 2 / len(share)) ** 2))
    return {**_summary(energy, mean, covariance, found.alpha[-1][0, 0]), "variance_error": float(error)}


def _summary(energy: Any, mean: Any, covariance: Any, alpha: float) -> dict[str, float]:
    """Means over lobes by their grey energies; a lobe that carries nothing has no mean of its own."""
    grey = energy.mean(axis=1)
    share = grey / grey.sum()
    variance = np.nan_to_num((covariance[:, 0] + covariance[:, 2]) / 2)
    return {
        "mean_x": float(share @ np.nan_to_num(mean[:, 0])),
        "variance": float(share @ variance),
        "base_energy": float(grey[-1]),
        "base_variance": float(variance[-1]),
        "base_alpha": float(alpha),
    }


@canvas.page(9, 7)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """Mean variances over the roughness, then mean and variance over the angle."""
    axes = figure.subplots(2, 2)
    plots = (
        (axes[0, 0], "two", "variance", "two interfaces: mean variance"),
        (axes[0, 1], "four", "variance", "four interfaces: mean variance"),
        (axes[1, 0], "angle", "mean_x", "two interfaces: mean x on the disc"),
        (axes[1, 1], "angle", "variance", "two interfaces: mean variance"),
    )
    for plot, name, quantity, title in plots:
        part = numbers[name]
        plot.plot(part["over"], part["model"][quantity], color="C0", label=numbers["model"])
        error = part["walk"]["variance_error"] if quantity == "variance" else None
        plot.errorbar(part["over"], part["walk"][quantity], error, color="C3", fmt="o", markersize=4, label="walk")
        plot.set(title=title, xlabel="angle of incidence (°)" if name == "angle" else "alpha of the topmost interface")
        if quantity == "variance":
            plot.set_ylim(0, None)
    axes[0, 0].legend()
