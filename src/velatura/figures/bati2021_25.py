"""Bati et al. 2021, figure 25: target lobes, and those of the stacks found.

The targets are those of figures 15, 16 and 17. The paper's conductors (figure 16) miss their energy a little, as its
table of directional albedos is coarse in kappa; here they are solved with the averages that read them. The random walk
stands beside: what the model itself misses.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import reference
from velatura.figures import Progress, canvas
from velatura.figures.bati2021_targets import FIGURES
from velatura.inverse import Target, invert_stack
from velatura.model import named
from velatura.model.registry import stack_lobes
from velatura.model.roughness_maps import MAPS
from velatura.stack import Stack

Array = NDArray[np.floating]

TARGETS = ("15 a", "15 b", "15 c", "16", "17 blue over red", "17 red over blue")
MODEL = "bati2021"
VISIBLE = 1e-4  # energy of an interface whose roughness shows


def compute(
    targets: Sequence[str] = TARGETS,
    paths: int = 300_000,
    seed: int = 0,
    model: str = MODEL,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """A row for every lobe of every target: energies (rgb) and alphas `expected`, `obtained`, and of the `walk`.

    The alpha of a pair is the mean of both interfaces' by their energies. `energy_error` and `variance_error` are the
    largest differences of what was obtained from what was expected. In the walk light meets one facet of an interface
    at a time, or as many as it will where the model counts these.
    """
    rows: list[dict[str, Any]] = []
    worst = np.zeros(2)
    for name in canvas.track(targets, progress):
        target = Target(FIGURES[name])
        for row, apart in compared(target, invert_stack(target, model).stack, model, paths, seed):
            rows.append({"target": name, **row})
            worst = np.maximum(worst, apart)
    return {"rows": rows, "energy_error": float(worst[0]), "variance_error": float(worst[1])}


def compared(
    target: Target, stack: Stack, model: str, paths: int, seed: int = 0
) -> Iterator[tuple[dict[str, Any], Array]]:
    """The row of `compute` of every lobe of a target, for a stack with it, and what energy and variance miss, (2,)."""
    read, first = stack_lobes(stack, 1.0, model=model), 0
    many = named(model).microsurface
    true = reference.statistics(stack, 1.0, paths=paths, seed=seed, microsurface=many)
    for n, lobe in enumerate(target.lobes, 1):
        own = slice(first, first := first + lobe.interfaces)
        row: dict[str, Any] = {"lobe": n, "energy": {}, "alpha": {}}
        row["energy"]["expected"], row["alpha"]["expected"] = list(lobe.colour), lobe.roughness
        for who, found in (("obtained", read), ("walk", true)):
            energies = np.array([energy[:, 0] for energy in found.energy[own]])
            alphas = np.array([np.mean(alpha[:, 0]) for alpha in found.alpha[own]])
            shows = energies.mean(axis=1) > VISIBLE
            row["energy"][who] = energies.sum(axis=0).tolist()
            row["alpha"][who] = float(np.average(alphas[shows], weights=energies.mean(axis=1)[shows]))
        apart = np.abs(np.subtract(row["energy"]["obtained"], lobe.colour)).max()
        variances = np.array([covariance[0, 0] for covariance in read.covariance[own]])
        yield row, np.array([apart, np.abs(variances - MAPS["belcour"].variance(lobe.roughness)).max()])


@canvas.page(12, 6.5)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """Energies above, roughnesses below: expected, obtained, and of the walk."""
    rows = numbers["rows"]
    upper, lower = figure.subplots(2, 1)
    at = np.arange(len(rows))
    for n, (who, colour) in enumerate((("expected", "0.7"), ("obtained", "C0"), ("walk", "C3"))):
        shift = at + 0.27 * (n - 1)
        for channel, hatch in enumerate(("", "//", "..")):
            energies = [row["energy"][who][channel] for row in rows]
            upper.bar(shift + 0.08 * (channel - 1), energies, 0.075, color=colour, hatch=hatch, edgecolor="white")
        lower.bar(shift, [row["alpha"][who] for row in rows], 0.25, color=colour, label=who)
    labels = [f"{row['target']}\nlobe {row['lobe']}" for row in rows]
    for axes, title in ((upper, "energy (red, green, blue)"), (lower, "alpha")):
        axes.set_xticks(at, labels, fontsize="small")
        axes.set_title(title)
    lower.legend()
