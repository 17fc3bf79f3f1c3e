"""Bati et al. 2021, figure 4: the interfaces that reflect the same, over the index of the medium above.

(a) Dielectrics: both roots, of which the lower one lies within bounds once the medium above is dense enough; (b)
conductors in air, eta and k between the bounds of eta; (c) one of these below other media. What is drawn is inverted;
`deviation` is by how much Fresnel's reflectance misses what was asked for. The reflectances of (b) are chosen here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.inverse import Choice, invert_interface
from velatura.model import named
from velatura.optics import fresnel

DIELECTRICS, CONDUCTORS, MEDIA = (0.04, 0.1, 0.2, 0.3), (0.3, 0.45, 0.6, 0.8), (1.0, 1.5, 2.0)
KEPT = (1.0, 1.5)  # of these media the conductors in figure 5
ETA_MAX, MODEL = 4.0, named("bati2021", reflectance="fresnel")


def compute(
    dielectrics: Sequence[float] = DIELECTRICS,
    conductors: Sequence[float] = CONDUCTORS,
    media: Sequence[float] = MEDIA,
    count: int = 100,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """(a) by reflectance the indices over `eta_0`, null out of bounds; (b, c) by reflectance and eta_0 eta and k."""
    eta_0, tint = np.linspace(1, ETA_MAX, count), np.linspace(0, 1, count)
    numbers: dict[str, Any] = {"eta_0": eta_0.tolist(), "dielectrics": [], "conductors": [], "deviation": 0.0}

    def check(reflectance: float, eta: Any, kappa: Any = 0.0) -> None:
        off = np.abs(fresnel.normal_incidence(eta, kappa) - reflectance)
        numbers["deviation"] = max(numbers["deviation"], float(off.max(initial=0.0)))

    for reflectance in canvas.track(dielectrics, progress):
        roots = []
        for side in (1, -1):
            found = invert_interface(np.full(count, reflectance), exterior=eta_0, choice=Choice(side=side), model=MODEL)
            ok = found.feasible
            check(reflectance, (found.eta[0] / eta_0)[ok])
            roots.append([float(eta) if within else None for eta, within in zip(found.eta[0], ok)])
        numbers["dielectrics"].append({"reflectance": reflectance, "denser": roots[0], "rarer": roots[1]})
    cases = [(reflectance, 1.0) for reflectance in conductors] + [(conductors[-2], medium) for medium in media]
    for reflectance, medium in cases:
        choice = Choice("conductor", tint=tint)
        found = invert_interface(np.full(count, reflectance), exterior=medium, choice=choice, model=MODEL)
        check(reflectance, found.eta / medium, found.kappa / medium)
        case = {"reflectance": reflectance, "eta_0": medium, "eta": found.eta[0].tolist(), "k": found.kappa[0].tolist()}
        numbers["conductors"].append(case)
    return numbers


@canvas.page(13, 4.4)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The three plots: conductors thick within bounds, else dashed from dielectric to dielectric (dots).

    Where k < eta it is hatched; crosses are the conductors of figure 5.
    """
    first, *others = figure.subplots(1, 3)
    for n, case in enumerate(numbers["dielectrics"]):
        for root, style in (("denser", "-"), ("rarer", "--")):
            label = f"R {case['reflectance']:g}" if root == "denser" else None
            first.plot(numbers["eta_0"], np.array(case[root], float), style, color=f"C{n}", label=label)
    first.set(title="(a) dielectrics: both roots", xlabel="eta 0", ylabel="eta 1", xlim=(1, ETA_MAX), ylim=(1, ETA_MAX))
    count = len({case["reflectance"] for case in numbers["conductors"]})
    parts = (numbers["conductors"][:count], numbers["conductors"][count:])
    titles = ("(b) conductors in air", "(c) below other media")
    for axes, part, title in zip(others, parts, titles):
        for n, case in enumerate(part):
            label = f"R {case['reflectance']:g}, eta 0 {case['eta_0']:g}"
            axes.plot(case["eta"], case["k"], color=f"C{n}", linewidth=2.5, label=label)
            eta, kappa = _whole(case["reflectance"], case["eta_0"])
            axes.plot(eta, kappa, "--", color=f"C{n}", linewidth=1)
            axes.plot(eta[[0, -1]], [0, 0], "o", color=f"C{n}")
        limit = 1.1 * max(max(case["eta"] + case["k"]) for case in part)
        axes.fill_between((0, limit), (0, limit), facecolor="none", edgecolor="0.85", hatch="//", zorder=0)
        axes.set(title=title, xlabel="eta 1", ylabel="k 1", xlim=(0, limit), ylim=(0, limit))
    for case in numbers["conductors"][count:]:
        if case["eta_0"] in KEPT:  # in figure 5: at both bounds
            others[1].plot(np.array(case["eta"])[[0, -1]], np.array(case["k"])[[0, -1]], "kx", zorder=3)
    for axes in figure.axes:
        axes.legend(fontsize="small")


def _whole(reflectance: float, eta_0: float) -> tuple[Any, Any]:
    """All eta and k of that reflectance, out of bounds too: from one dielectric to the other one."""
    root = np.sqrt(reflectance)
    ends = (1 - root) / (1 + root), (1 + root) / (1 - root)
    eta = sum(ends) / 2 - (ends[1] - ends[0]) / 2 * np.cos(np.linspace(0, np.pi, 200))
    return eta_0 * eta, eta_0 * np.sqrt(np.maximum((eta - ends[0]) * (ends[1] - eta), 0))
