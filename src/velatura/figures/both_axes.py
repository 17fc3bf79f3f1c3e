"""The roughness map over both axes at once, derived anew (Weier & Belcour 2020, 3.3 and Appendix B).

Light along the normal is reflected twice, by surfaces that share their axes. The equivalent roughnesses along x and y
are those of the one bounce with the same variances. Nine constants, of the map and of a fit of its inverse, are chosen
so that sums of variances give them. Many sets of constants do that about as well: where a is small only b/a counts, and
where c of the inverse is large only log(c)/d and d do.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from velatura.figures.bounces import NORMAL, Array, along, bounce, equivalent_along, uniform, variances
from velatura.model.roughness_maps import MAPS, WEIER_2D, weier_2d

ALPHAS = np.array([0.003, 0.01, 0.02, 0.04, 0.07, *np.linspace(0.1, 1, 19)])
SIDES = (0.06, 0.12, 0.24, 0.3, 0.36, 0.51)  # roughnesses of the surfaces along either axis
TOPS = (0.24, 0.3, 0.36, 0.51)  # the largest roughness that a fit looks at
PROFILED = 0.36  # the top where constants are held one by one
NAMES = ("a", "b", "c", "d", "inverse a", "inverse b", "inverse c", "inverse d", "inverse e")
_PUBLISHED = np.log([*WEIER_2D[0], *WEIER_2D[1]])
_LOW = np.log([1e-2, 1e-3, 1e-3, 1e-3, 1e-2, 1e-3, 1e-2, 1.0, 1e-5])
_HIGH = np.log([1e1, 1e2, 1e1, 1e1, 1e1, 1e2, 1e6, 1e4, 1.0])
_STEPS = 20  # of a fit, which ends in a long valley


def compute(count: int) -> dict[str, Any]:
    """The data of the fit: variances of `count` directions.

    `fits` for growing `top`: the `constants`, their standard errors as factors (`factor`; None where they may have any
    value), the error (root mean square) of roughness that is left (`rms`), and that of the published maps. `profile` is
    by constant the error where it is as published, and all others are fitted, over that of the best fit.
    """
    pairs, targets = _bounces(count)
    fits, profile = [], {}
    for top in TOPS:
        part = (pairs.max(axis=1) <= top + 1e-9) & np.isfinite(targets).all(axis=1)
        best, fit = _fit(pairs[part], targets[part], top)
        fits.append(fit)
        if top == PROFILED:
            held = [_least(pairs[part], targets[part], best, k)[1] for k in range(len(NAMES))]
            profile = {name: _rms(misses) / fit["rms"] for name, misses in zip(NAMES, held)}
    return {"fits": fits, "profile": profile}


def _bounces(count: int) -> tuple[Array, Array]:
    """Roughnesses (n, 4) along x and y of the first and the second bounce, and equivalent ones (n, 2) of both."""
    u, start = uniform(count), along(NORMAL, count)
    once = np.array([[variances(bounce(start, a, b, *u[:2])) for b in ALPHAS] for a in ALPHAS])
    x = np.meshgrid(ALPHAS, ALPHAS, indexing="ij")[0]
    pairs, twice = [], []
    for first in product(SIDES, SIDES):
        light = bounce(start, *first, *u[:2])
        for second in product(SIDES, SIDES):
            if second <= first:
                pairs.append([*first, *second])
                twice.append(variances(bounce(light, *second, *u[2:])))
    both = np.array(twice)
    targets = [np.exp(equivalent_along(np.log(once), np.log(x), np.log(at))) for at in (both, both[:, ::-1])]
    return np.array(pairs), np.stack(targets, axis=1)


def _fit(pairs: Array, targets: Array, top: float) -> tuple[Array, dict[str, Any]]:
    """The logarithms of the best constants, and the report of `compute` on them."""
    best, misses, slope = _least(pairs, targets, _PUBLISHED)
    spread = np.sqrt(np.diag(np.linalg.pinv(slope.T @ slope)) * np.mean(misses**2))
    free = spread > 2
    return best, {
        "top": top,
        "constants": dict(zip(NAMES, np.exp(best).tolist())),
        "factor": {name: None if f else float(np.exp(s)) for name, s, f in zip(NAMES, spread, free)},
        "rms": _rms(misses),
        **{f"rms_{name}": _rms(_misses(MAPS[name], pairs, targets)) for name in ("weier", "weier-2d")},
    }


def _least(pairs: Array, targets: Array, start: Array, held: int | None = None) -> tuple[Array, Array, Array]:
    """The constants that leave least, one `held` as published or none; what they leave, and its slopes."""
    from scipy.optimize import least_squares

    free = np.arange(len(NAMES)) != held

    def all_of(some: Array) -> Array:
        constants = _PUBLISHED.copy()
        constants[free] = some
        return constants

    def misses(some: Array) -> Array:
        constants = np.exp(all_of(some)).tolist()
        return _misses(weier_2d(constants[:4], constants[4:]), pairs, targets)

    low, high = _LOW[free], _HIGH[free]
    found = least_squares(misses, np.clip(start[free], low + 1e-9, high - 1e-9), bounds=(low, high), max_nfev=_STEPS)
    return all_of(found.x), found.fun, found.jac


def _misses(f: Any, pairs: Array, targets: Array) -> Array:
    a, b, c, d = pairs.T
    s, t = f.variance(a, b) + f.variance(c, d), f.variance(b, a) + f.variance(d, c)
    return np.asarray(np.concatenate([f.roughness(s, t) - targets[:, 0], f.roughness(t, s) - targets[:, 1]]))


def _rms(misses: Array) -> float:
    return float(np.sqrt(np.mean(np.square(misses))))
