"""Bati et al. 2021, figure 7: the smooth pairs of dielectrics without absorption that reflect the same.

Every class is a closed curve over the two indices, of which the part in [1, 4] is physical. (a) A reflectance of 0.15
in air, with the points that have a name; (b) other reflectances; (c) other media above. The curves are the closed form;
what is within bounds is what the model's own recursion finds. The values of (b) and (c) are chosen here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.inverse import Above, EquivalenceClass, smooth_pair
from velatura.model import named

#: Of both points of each name, as the paper's text uses them: A to F lie in this order around the curve.
LETTERS = {"matched above": "CF", "matched below": "DA", "slab": "EB"}
KINDS = {"A, D": "no lower interface", "C, F": "no upper interface", "B, E": "slab"}
ENERGIES, MEDIA = (0.05, 0.15, 0.3, 0.45), (1.0, 1.5, 2.0)
MODEL = named("bati2021", reflectance="fresnel")


def compute(
    energies: Sequence[float] = ENERGIES,
    media: Sequence[float] = MEDIA,
    count: int = 200,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The whole `curve` by `part`, `energy` and `eta_0`, the part of it `inside` bounds, and its named `points`.

    All are points (eta_1, eta_2). `deviation` is the largest distance of what is inside, found by the model, from the
    closed form.
    """
    cases = [("a", 0.15, 1.0), *(("b", e, 1.0) for e in energies), *(("c", 0.15, eta_0) for eta_0 in media)]
    numbers: dict[str, Any] = {"cases": [], "deviation": 0.0}
    for part, energy, eta_0 in canvas.track(cases, progress):
        members = EquivalenceClass(Above.nothing(MODEL, eta_0), np.full((1, 1), energy), 0.0, 2)
        inside = [curve.tolist() for curve in members.boundary(count)]
        for eta_1, eta_2 in (point for found in inside for point in found):
            y = np.cosh(np.log(eta_1 / eta_0)) + np.cosh(np.log(eta_2 / eta_1))
            numbers["deviation"] = max(numbers["deviation"], float(abs(y * (1 - energy) / 2 - 1)))
        case: dict[str, Any] = {"part": part, "energy": energy, "eta_0": eta_0}
        case["curve"] = [list(p) for p in smooth_pair.curve(eta_0, energy)]
        named_points = {name: [list(p) for p in points] for name, points in smooth_pair.points(eta_0, energy).items()}
        numbers["cases"].append({**case, "inside": inside, "points": named_points})
    return numbers


@canvas.page(13, 4.6)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The curves in three plots, what is physical drawn thick."""
    plots = {"a": "R = 0.15 in air", "b": "other energies", "c": "other media above"}
    for axes, (part, title) in zip(figure.subplots(1, 3), plots.items()):
        cases = [case for case in numbers["cases"] if case["part"] == part]
        for n, case in enumerate(cases):
            label = f"R {case['energy']:g}, eta 0 {case['eta_0']:g}"
            axes.plot(*np.transpose(case["curve"]), color=f"C{n}", linewidth=1, linestyle="--", label=label)
            for points in case["inside"]:
                axes.plot(*np.transpose(points), color=f"C{n}", linewidth=2.5)
        axes.plot((0, 7), (0, 7), color="0.8", linewidth=1, zorder=0)
        for at in (axes.axvline, axes.axhline):  # where the upper interface vanishes in air, and the slab
            at(1, color="0.8", linewidth=1, zorder=0)
        axes.fill_between((1, 4), 1, 4, color="0.95", zorder=-1)
        axes.set(title=f"({part}) {title}", xlabel="eta 1", ylabel="eta 2", xlim=(0, 4.5), ylim=(0, 4.5))
        axes.legend(fontsize="small", loc="lower right")
    for name, points in numbers["cases"][0]["points"].items():
        figure.axes[0].plot(*np.transpose(points), "ko", markersize=5)
        for letter, point in zip(LETTERS[name], points):
            figure.axes[0].annotate(letter, point, xytext=(6, -10), textcoords="offset points", fontweight="bold")
    key = "\n".join(f"{letters}: {kind}" for letters, kind in KINDS.items())
    figure.axes[0].text(0.03, 0.97, key, transform=figure.axes[0].transAxes, va="top", fontsize="small")
