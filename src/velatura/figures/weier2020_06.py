"""Weier & Belcour 2020, figure 6: variances of anisotropic reflections, and the roughness of two in a row.

Light comes along the normal. (a) The variances along both axes of the projected disc after one bounce; (b) the
roughness along an axis that has such variances, where any has; (c) the roughness that two equal bounces are equivalent
to, and what the maps of the paper make of it: the one that treats each axis by itself, and the fit over both axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.figures.bounces import NORMAL, Array, along, bounce, equivalent_along, uniform, variances
from velatura.model.roughness_maps import MAPS

ALPHAS = (0.02, 0.05, *np.linspace(0.1, 1, 19).round(2).tolist())
LOW = 0.3
NAMES = ("weier", "weier-2d")
SIDE = 40  # of the plot of (b)


def compute(alphas: Sequence[float] = ALPHAS, count: int = 2**13, progress: Progress | None = None) -> dict[str, Any]:
    """The `variance` along x after one bounce, and `equivalent` along x of two, over `alpha` along x (rows) and y.

    `inverse` is (b) over `variances` along x and y; None where there is none. `error` is by map the root mean square of
    what it misses in the equivalent roughness, where both roughnesses are at most `LOW`, and elsewhere (`error_above`).
    """
    u, start = uniform(count), along(NORMAL, count)
    once, twice = np.zeros((2, len(alphas), len(alphas), 2))
    for i, a in enumerate(canvas.track(alphas, progress)):
        for j, b in enumerate(alphas):
            light = bounce(start, a, b, *u[:2])
            once[i, j], twice[i, j] = variances(light), variances(bounce(light, a, b, *u[2:]))
    x, y = np.meshgrid(alphas, alphas, indexing="ij")
    equivalent = equivalent_along(once, x, twice)
    known, low = np.isfinite(equivalent), np.maximum(x, y) <= LOW
    predicted = {name: _predicted(name, x, y) for name in NAMES}
    ticks = np.linspace(0, once.max(), SIDE)
    return {
        "alpha": list(alphas),
        "variance": once[..., 0].tolist(),
        "variances": ticks.tolist(),
        "inverse": _plain(equivalent_along(once, x, np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1))),
        "equivalent": _plain(equivalent),
        "predicted": {name: values.tolist() for name, values in predicted.items()},
        "error": {name: _rms((p - equivalent)[known & low]) for name, p in predicted.items()},
        "error_above": {name: _rms((p - equivalent)[known & ~low]) for name, p in predicted.items()},
    }


def _predicted(name: str, x: Array, y: Array) -> Array:
    f = MAPS[name]
    return np.asarray(f.roughness(2 * f.variance(x, y), 2 * f.variance(y, x)))


def _rms(misses: Array) -> float:
    return float(np.sqrt(np.mean(misses**2)))


def _plain(values: Array) -> list[list[float | None]]:
    return [[float(v) if np.isfinite(v) else None for v in row] for row in values]


@canvas.page(13, 7.4)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """Variance, inverse and equivalent roughness, along x, below what the maps give for the last; grey is unknown."""
    rows = figure.subplots(2, 3)
    top = numbers["variances"][-1]
    plots = (
        (rows[0, 0], numbers["variance"], 1.0, "(a) variance along x"),
        (rows[0, 1], numbers["inverse"], top, "(b) alpha along x by variances"),
        (rows[0, 2], numbers["equivalent"], 1.0, "(c) equivalent alpha along x"),
        *(
            (axes, numbers["predicted"][n], 1.0, f"(c) by {n}, rms {numbers['error'][n]:.4f} up to {LOW:g}")
            for axes, n in zip(rows[1], NAMES)
        ),
    )
    for axes, values, bound, title in plots:
        image = np.array(values, float).T
        axes.set_facecolor("0.8")
        drawn = axes.pcolormesh(*[np.linspace(0, bound, len(image))] * 2, image, cmap="viridis", vmin=0)
        axes.set(title=title, xlabel="along x", ylabel="along y", aspect="equal")
        figure.colorbar(drawn, ax=axes)
    # The influence of the other axis
    alphas = numbers["alpha"]
    for alpha, variance in list(zip(alphas, numbers["variance"]))[:: max(len(alphas) // 4, 1)]:
        rows[1, 2].plot(alphas, variance, label=f"alpha {alpha:g} along x")
    rows[1, 2].set(title="variance along x", xlabel="alpha along y", ylim=(0, None))
    rows[1, 2].legend(fontsize="small")
