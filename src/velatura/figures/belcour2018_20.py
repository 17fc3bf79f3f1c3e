"""Belcour 2018, figure 20: from the variances of one and two bounces to the roughness that two equal bounces have.

The variances are those of figure 3. What is fitted to the outcome is in `linear-space`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from velatura.figures import Progress, belcour2018_03, canvas
from velatura.figures.bounces import equivalent
from velatura.model.roughness_maps import MAPS

ALPHAS = np.concatenate([np.geomspace(5e-3, 0.1, 12)[:-1], np.linspace(0.1, 1, 37)])


def compute(count: int = 2**15, progress: Progress | None = None) -> dict[str, Any]:
    """Figure 3's `alpha`, `one` and `two`, and the `equivalent` roughness of two bounces, None where none is as wide.

    `belcour` is what the map of the paper says instead.
    """
    found = belcour2018_03.compute(ALPHAS.tolist(), count, progress)
    double = equivalent(found["two"], found["one"], ALPHAS)
    f = MAPS["belcour"]
    return {
        **{name: found[name] for name in ("alpha", "one", "two")},
        "equivalent": [float(x) if np.isfinite(x) else None for x in double],
        "belcour": f.roughness(2 * f.variance(ALPHAS)).tolist(),
    }


@canvas.page(9, 4)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The variances, and the roughness that follows from them."""
    left, right = figure.subplots(1, 2)
    for name, label, colour in (("one", "one bounce", "C0"), ("two", "two bounces", "C3")):
        left.plot(numbers["alpha"], numbers[name], color=colour, label=label)
    left.set(title="variance on the disc", xlabel="alpha")
    right.plot(numbers["alpha"], np.array(numbers["equivalent"], float), color="C3", label="two bounces")
    right.plot(numbers["alpha"], numbers["belcour"], color="C0", linestyle="--", label="belcour's map")
    right.set(title="equivalent roughness", xlabel="alpha of both surfaces", ylim=(0, 1))
    left.legend()
    right.legend()
