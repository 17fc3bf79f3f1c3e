"""Belcour 2018, figure 4: the equivalent roughness of two bounces of light, and the map that makes them add.

Light comes along the normal. Equivalent is the roughness of the one bounce that is as wide, by its variance on the
projected disc, as the papers have it, and by the median of its half-vectors' slopes. The fits are those of
`linear-space`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.figures.bounces import NORMAL, WIDTHS, along, bounce, equivalent, uniform
from velatura.model.guards import MAPPED_ALPHA_MAX
from velatura.model.roughness_maps import MAPS

FIRST = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)
SECOND = tuple(np.linspace(0, 1, 41).round(3).tolist())
LOW = 0.4  # of both, up to which the paper says that its map does well
NAMES = ("belcour", "weier")
_SMOOTH = 1e-3  # what 0 is evaluated as


def compute(
    first: Sequence[float] = FIRST,
    second: Sequence[float] = SECOND,
    count: int = 2**14,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The equivalent roughness by width for each `first` one, in lists over `second`, and what each map predicts.

    None where no single bounce is as wide. `error` is the root mean square of what a map misses, by width and map,
    where both roughnesses are at most `LOW`, in `error_above` elsewhere.
    """
    u, start = uniform(count), along(NORMAL, count)
    known = np.geomspace(_SMOOTH, 1, 60)
    single = {name: [width(bounce(start, a, a, *u[:2])) for a in known] for name, width in WIDTHS.items()}
    curves: list[dict[str, Any]] = []
    for a in canvas.track(first, progress):
        once = bounce(start, max(a, _SMOOTH), max(a, _SMOOTH), *u[:2])
        twice = [bounce(once, max(b, _SMOOTH), max(b, _SMOOTH), *u[2:]) for b in second]
        curve: dict[str, Any] = {"first": float(a)}
        for name, width in WIDTHS.items():
            found = equivalent([width(light) for light in twice], single[name], known)
            curve[name] = [float(x) if np.isfinite(x) else None for x in found]
        for name in NAMES:
            curve[name] = [float(MAPS[name].roughness(_sum(name, a, b))) for b in second]
        curves.append(curve)
    numbers: dict[str, Any] = {"second": list(second), "curves": curves}
    numbers["error"] = {width: {name: _error(numbers, width, name, True) for name in NAMES} for width in WIDTHS}
    numbers["error_above"] = {width: {name: _error(numbers, width, name, False) for name in NAMES} for width in WIDTHS}
    return numbers


def _sum(name: str, a: float, b: float) -> Any:
    f = MAPS[name].variance
    return f(np.float64(min(a, MAPPED_ALPHA_MAX))) + f(np.float64(min(b, MAPPED_ALPHA_MAX)))


def _error(numbers: dict[str, Any], width: str, name: str, low: bool) -> float:
    misses = [
        predicted - found
        for curve in numbers["curves"]
        for b, found, predicted in zip(numbers["second"], curve[width], curve[name])
        if found is not None and (max(curve["first"], b) <= LOW) == low
    ]
    return float(np.sqrt(np.mean(np.square(misses))))


@canvas.page(9, 4.2)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The single bounce equivalent to two by variance, the prediction of the map dashed, and the map itself."""
    left, right = figure.subplots(1, 2)
    draw_curves(left, numbers, "variance", "belcour")
    draw_key(figure, left)
    alpha = np.linspace(0, 0.95, 200)
    right.plot(alpha, MAPS["belcour"].variance(alpha), color="C0")
    right.set(title="the map of Belcour 2018", xlabel="alpha", ylabel="f", ylim=(0, 10))


def draw_curves(axes: Any, numbers: dict[str, Any], width: str, name: str, top: float = 1.0) -> None:
    """Equivalent roughness over the second one, from red for a smooth first surface to blue, and a map's dashed."""
    for curve in numbers["curves"]:
        colour = (1 - curve["first"], 0, curve["first"])
        axes.plot(numbers["second"], np.array(curve[width], float), color=colour)
        axes.plot(numbers["second"], curve[name], color=colour, linestyle="--", linewidth=1)
    title = f"by {width} (dashed: {name}'s map)"
    axes.set(title=title, xlabel="alpha of the second surface", ylabel="equivalent alpha", xlim=(0, top), ylim=(0, top))


def draw_key(figure: Any, axes: Any) -> None:
    """Which colour of `draw_curves` is which first surface."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap

    colours = ScalarMappable(cmap=LinearSegmentedColormap.from_list("first", ("red", "blue")))
    figure.colorbar(colours, ax=axes, label="alpha of the first surface")
