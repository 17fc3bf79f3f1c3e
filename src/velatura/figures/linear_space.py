"""The linear space of roughness, derived anew: the fits of Belcour 2018 (appendix A) and Weier & Belcour 2020 (3.3).

Light that comes along the normal is reflected by one rough surface, or by two that are parallel. The *equivalent
roughness* of two bounces is that of the one bounce that is as wide. A roughness map f should make widths add,

    f(equivalent(a, b)) = f(a) + f(b).

Belcour (appendix A) iterates f(equivalent(a, a)) = 2 f(a), and reads a^p/(1-a^p) off the curve, with p = 1.1; Weier and
Belcour (3.3) fit the a and b of their map to the equation itself. Neither says up to which roughness, and the outcome
depends on that. Their width is the variance on the projected disc; beside it stands the median of the slopes of
half-vectors, which is what makes one lobe look like another. (`velatura.figures.both_axes` derives the other map.)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, both_axes, canvas
from velatura.figures.bounces import NORMAL, WIDTHS, Array, along, bounce, equivalent, uniform
from velatura.model.guards import MAPPED_ALPHA_MAX
from velatura.model.roughness_maps import MAPS

ALPHAS = np.concatenate([np.geomspace(1e-3, 0.1, 24)[:-1], np.linspace(0.1, 1, 31)])
PAIRS = np.linspace(0.03, 0.51, 17)  # of roughnesses whose two bounces are fitted
TOPS = (0.24, 0.3, 0.33, 0.36, 0.42, 0.51)  # the largest roughness that a fit looks at
START = 1e-3  # of the iteration, both roughness and variance (Belcour 2018, appendix A)
CHAIN = (0.01, 0.5)  # part of the iterated curve that p is read off


def compute(count: int = 2**15, progress: Progress | None = None) -> dict[str, Any]:
    """Curves for `variance` and `median` as the width, and what is fitted to them; `count` is that of directions.

    `equivalent` of two equal bounces over `alpha`; `iterated` f over roughness; `p` read off it; `fits` for growing
    `top`: a and b with standard errors, the error (root mean square) of roughness that they leave, p by the same
    criterion, and the errors of the published maps. `both_axes` is what is fitted over both axes at once.
    """
    u = uniform(count)
    steps = [(name, alpha) for name in WIDTHS for alpha in (*ALPHAS, *PAIRS)]
    numbers: dict[str, Any] = {name: {"single": [], "double": [], "pairs": []} for name in WIDTHS}
    for step, (name, alpha) in enumerate(canvas.track(steps, progress)):
        found, width, once = numbers[name], WIDTHS[name], bounce(along(NORMAL, count), alpha, alpha, *u[:2])
        if step % (len(ALPHAS) + len(PAIRS)) < len(ALPHAS):
            found["single"].append(width(once))
            found["double"].append(width(bounce(once, alpha, alpha, *u[2:])))
        else:
            found["pairs"].append([width(bounce(once, b, b, *u[2:])) for b in PAIRS if b <= alpha])
    return {**{name: _derived(found) for name, found in numbers.items()}, "both_axes": both_axes.compute(count // 4)}


# What follows from them


def _derived(found: dict[str, Any]) -> dict[str, Any]:
    double = equivalent(found["double"], found["single"], ALPHAS)
    a, f = _iterated(double)
    pairs = [(x, y) for x in PAIRS for y in PAIRS if y <= x]
    targets = equivalent(np.concatenate(found["pairs"]), found["single"], ALPHAS)
    return {
        "alpha": ALPHAS.tolist(),
        "equivalent": [float(x) if np.isfinite(x) else None for x in double],
        "iterated": {"alpha": a.tolist(), "f": f.tolist()},
        "p": _exponent(a, f),
        "fits": [_fit(np.array(pairs), targets, top) for top in TOPS],
    }


def _iterated(double: Array) -> tuple[Array, Array]:
    """f at the roughnesses that come of each other, from the smallest to where nothing is as wide any more."""
    known = np.isfinite(double)
    a = [0.0, START]
    while 1.01 * a[-2] < a[-1] < ALPHAS[known][-1]:
        a.append(float(np.exp(np.interp(np.log(a[-1]), np.log(ALPHAS[known]), np.log(double[known])))))
    return np.array(a[1:-1]), START * 2.0 ** np.arange(len(a) - 2)


def _exponent(a: Array, f: Array) -> float:
    """p of the closest c a^p/(1-a^p)."""
    from scipy.optimize import least_squares

    part = (a >= CHAIN[0]) & (a <= CHAIN[1])
    a, f = a[part], f[part]
    found = least_squares(lambda x: x[0] + np.log(a ** x[1] / (1 - a ** x[1])) - np.log(f), [0.0, 1.3])
    return float(found.x[1])


def _fit(pairs: Array, targets: Array, top: float) -> dict[str, Any]:
    """a and b of the map of Weier & Belcour 2020, and p of Belcour's, from the pairs up to `top`."""
    from scipy.optimize import least_squares

    part = (pairs[:, 0] <= top + 1e-9) & np.isfinite(targets)
    (x, y), z = pairs[part].T, targets[part]

    def misses(constants: Array) -> Array:
        a, b = constants
        s = sum(np.log(1 + b * t**a / (1 - t**a)) for t in np.minimum([x, y], MAPPED_ALPHA_MAX))
        odds = np.exp(s) - 1
        return np.asarray((odds / (odds + b)) ** (1 / a) - z)

    def misses_of_power(p: Array) -> Array:
        s = sum(t**p / (1 - t**p) for t in np.minimum([x, y], MAPPED_ALPHA_MAX))
        return np.asarray((s / (1 + s)) ** (1 / p) - z)

    found = least_squares(misses, [1.3, 1.3], bounds=([0.1, 0.01], [4, 50]))
    spread = np.linalg.inv(found.jac.T @ found.jac) * np.mean(found.fun**2)
    published = {
        name: f.roughness(f.variance(x) + f.variance(y)) - z for name, f in MAPS.items() if name in ("belcour", "weier")
    }
    return {
        "top": top,
        "a": float(found.x[0]),
        "b": float(found.x[1]),
        "a_error": float(np.sqrt(spread[0, 0])),
        "b_error": float(np.sqrt(spread[1, 1])),
        "rms": float(np.sqrt(np.mean(found.fun**2))),
        "p": float(least_squares(misses_of_power, [1.1]).x[0]),
        **{f"rms_{name}": float(np.sqrt(np.mean(miss**2))) for name, miss in published.items()},
    }


@canvas.page(15, 4.5)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The map that is iterated, and the equivalent roughness of two bounces, beside those of the published maps."""
    left, right, axes = figure.subplots(1, 3)
    colours = {"variance": "C3", "median": "black"}
    for name, colour in colours.items():
        found = numbers[name]
        a, f = (np.array(found["iterated"][key]) for key in ("alpha", "f"))
        scale = MAPS["weier"].variance(0.1) / np.exp(np.interp(np.log(0.1), np.log(a), np.log(f)))
        left.plot(a, f * scale, "o", color=colour, markersize=3, label=f"iterated, {name}")
        equivalent = np.array(found["equivalent"], float)
        right.plot(found["alpha"], equivalent, "o", color=colour, markersize=3, label=f"two bounces, {name}")
    alpha = np.geomspace(1e-3, 0.99, 200)
    for (name, f), colour in zip(_published(), ("C0", "C1", "C2")):
        s = f.variance(alpha)
        left.plot(alpha, s * MAPS["weier"].variance(0.1) / f.variance(0.1), color=colour, label=name)
        right.plot(alpha, f.roughness(2 * s), color=colour, label=name)
    left.set(xscale="log", yscale="log", xlabel="alpha", ylabel="f, scaled to agree at .1", ylim=(1e-4, 1e2))
    right.set(xlim=(0, 0.6), ylim=(0, 1), xlabel="alpha of both surfaces", ylabel="equivalent alpha")
    fits = numbers["both_axes"]["fits"]
    for key, label in (("rms_weier", "weier"), ("rms_weier-2d", "weier-2d"), ("rms", "its constants fitted anew")):
        axes.plot([fit["top"] for fit in fits], [fit[key] for fit in fits], "o-", label=label)
    axes.set(xlabel="largest alpha, of either axis", ylabel="error of the equivalent alpha, both axes", ylim=(0, None))
    for plot in (left, right, axes):
        plot.legend()


def _published() -> Sequence[tuple[str, Any]]:
    return [(name, MAPS[name]) for name in ("belcour", "weier", "weier-2d")]
