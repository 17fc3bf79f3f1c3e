"""The class of a smooth pair in closed form (with y = ln eta: cosh(y1-y0) + cosh(y2-y1) = 2/(1-R))."""

from __future__ import annotations

from collections.abc import Sequence
from math import acosh, atanh, cos, cosh, exp, inf, log, pi, sqrt

Interval = tuple[float, float]


def indices_1(eta_0: float, low: float, high: float, eta_max: float) -> list[Interval]:
    """All indices between the interfaces of smooth pairs, with or without absorption, as disjoint intervals.

    Args:
        eta_0: index above the pair.
        low, high: the smallest and the largest of the channels' energies.
    """
    if not high < 1:
        return []
    c, x = 2 / (1 - high), 2 * atanh(sqrt(low))
    y_0, last = log(eta_0), log(eta_max)
    within = [(max(0.0, y_0 - x), min(last, y_0 + x))]
    w = _arccosh(c / (2 * cosh((last - y_0) / 2)))
    v = _arccosh(c / (2 * cosh(y_0 / 2)))
    middle_a, middle_b = (y_0 + last) / 2, y_0 / 2
    outside = union([(-inf, middle_a - w), (middle_a + w, inf), (-inf, middle_b - v), (middle_b + v, inf)])
    found = [(max(a, c), min(b, d)) for a, b in within for c, d in outside]
    return [(exp(a), exp(b)) for a, b in found if a <= b]


def highest(eta_0: float, eta_max: float) -> float:
    """The largest energy of a smooth pair."""
    last, y_0 = log(eta_max), log(eta_0)
    return 1 - 2 / (cosh(last) + max(cosh(y_0), cosh(last - y_0)))


def points(eta_0: float, energy: float) -> dict[str, list[tuple[float, float]]]:
    """The named smooth pairs without absorption (figure 7), in and out of bounds, as (eta_1, eta_2).

    `matched above` and `matched below`: one of the two interfaces vanishes, so that there is one; `slab`: the medium
    below is the one above.
    """
    one = [eta_0 * exp(sign * 2 * atanh(sqrt(energy))) for sign in (1, -1)]
    slab = [eta_0 * exp(sign * acosh(1 / (1 - energy))) for sign in (1, -1)]
    return {
        "matched above": [(eta_0, eta) for eta in one],
        "matched below": [(eta, eta) for eta in one],
        "slab": [(eta, eta_0) for eta in slab],
    }


def curve(eta_0: float, energy: float, count: int = 400) -> list[tuple[float, float]]:
    """All smooth pairs without absorption, in and out of bounds: a closed curve of points (eta_1, eta_2)."""
    c, y_0, reach = 2 / (1 - energy), log(eta_0), 2 * atanh(sqrt(energy))
    found = []
    for n in range(count + 1):
        angle = 2 * pi * n / count
        y_1 = reach * cos(angle)
        apart = acosh(max(c - cosh(y_1), 1.0))
        found.append((exp(y_0 + y_1), exp(y_0 + y_1 + (apart if angle < pi else -apart))))
    return found


def _arccosh(x: float) -> float:
    """Inverse hyperbolic cosine; 0 if there is no restriction."""
    return acosh(x) if x > 1 else 0.0


def union(intervals: Sequence[Interval]) -> list[Interval]:
    """The same points as disjoint intervals, in order."""
    found: list[Interval] = []
    for low, high in sorted(i for i in intervals if i[0] <= i[1]):
        if found and low <= found[-1][1]:
            found[-1] = found[-1][0], max(found[-1][1], high)
        else:
            found.append((low, high))
    return found
