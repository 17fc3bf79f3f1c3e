"""Bati et al. 2021, figure 9: smooth pairs with absorption between their interfaces, in air.

(a) Those that reflect 0.15, as a surface over both indices; (b) its lines of equal optical depth, which all span the
same first indices, with the pairs of figure 10 (b); (c) optical depths for one first index, for more reflectances.
Below them the classes of other reflectances, and the first indices that these leave.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from velatura.figures import Progress, canvas
from velatura.inverse import Above, EquivalenceClass
from velatura.model import named
from velatura.optics import fresnel

ENERGIES = (0.15, 0.3, 0.45)
SLICES, ETA_1 = (0.05, 0.1, 0.15, 0.2, 0.25), 1.2  # energies of (c), and its first index
DEPTHS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
MODEL = named("bati2021", reflectance="fresnel")
ETA_MAX = 4.0


def compute(energies: Sequence[float] = ENERGIES, count: int = 160, progress: Progress | None = None) -> dict[str, Any]:
    """The `depth` by energy at (eta_1, eta_2), over `eta`, negative or null out of the class; intervals of `eta_1`.

    `deepest` is the largest depth; it has no bound where the lower interface vanishes. `slices` has by energy the
    `depth` over eta_2 below ETA_1, and `deepest`.
    """
    axis = np.linspace(1, ETA_MAX, count)
    numbers: dict[str, Any] = {"eta": axis.tolist(), "classes": [], "slices": []}
    for energy in canvas.track(energies, progress):
        (depth,) = _members(energy).grid(axis, axis)
        case = {"energy": energy, "depth": [_plain(row) for row in depth], "deepest": float(np.nanmax(depth))}
        numbers["classes"].append(case | {"eta_1": [list(span) for span in _members(energy).indices_1()]})
    for energy in SLICES:
        depth = _members(energy).grid(np.array([ETA_1]), axis)[0, 0]
        numbers["slices"].append({"energy": energy, "depth": _plain(depth), "deepest": float(np.nanmax(depth))})
    return numbers


def _members(energy: float) -> EquivalenceClass:
    return EquivalenceClass(Above.nothing(MODEL), np.full((1, 1), energy), 0.0, 2)


def _plain(depth: Any) -> list[float | None]:
    return [None if np.isnan(x) else float(x) for x in depth]


@canvas.page(14, 8.5)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """The surface, its lines, and slices; below them the lines of other classes."""
    first, *others = numbers["classes"]
    _surface(figure.add_subplot(2, 3, 1, projection="3d"), first)
    lines = figure.add_subplot(2, 3, 2)
    _lines(figure, lines, numbers["eta"], first, "(b) ")
    slices = figure.add_subplot(2, 3, 3)
    for case, colour in zip(numbers["slices"], canvas.shades(len(numbers["slices"]))):
        slices.plot(numbers["eta"], np.array(case["depth"], float), color=colour, label=f"R {case['energy']:g}")
        if case["energy"] == first["energy"]:
            _crosses(numbers["eta"], case["depth"], lines, slices)
    slices.fill_between((1, ETA_MAX), -1, 0, facecolor="none", edgecolor="0.8", hatch="//")
    slices.set(title=f"(c) eta 1 {ETA_1:g}", xlabel="eta 2", ylabel="optical depth", xlim=(1, ETA_MAX), ylim=(-0.5, 1))
    slices.legend(fontsize="small")
    for n, case in enumerate(others):
        _lines(figure, figure.add_subplot(2, 3, 4 + n), numbers["eta"], case, "")


def _surface(axes: Any, case: dict[str, Any]) -> None:
    """Draw both sheets of a class as surfaces, their lines of equal depth, and in black the slice of (c)."""
    for side, bound in ((1, ETA_MAX), (-1, 1.0)):
        for low, high in case["eta_1"]:
            eta_1 = np.linspace(low, high, 200)[1:-1]
            clear = _attenuated(case["energy"], eta_1)
            # Up to where the lower index leaves its bounds
            last = 0.5 * np.log(fresnel.normal_incidence(bound / eta_1) / clear)
            inside = (last > 0) & (side * (bound - eta_1) > 0)
            if not inside.any():
                continue
            eta_1, clear, last = eta_1[inside], clear[inside], np.minimum(last, DEPTHS[-1])[inside]
            depth = np.linspace(0, 1, 30)[:, None] * last
            eta_2 = _lower(eta_1, clear, depth, side)
            axes.plot_surface(np.broadcast_to(eta_1, depth.shape), eta_2, depth, color="0.85", alpha=0.5, linewidth=0)
            for level, colour in zip(DEPTHS, canvas.shades(len(DEPTHS), "viridis")):
                eta_2 = np.where(level <= last, _lower(eta_1, clear, np.array(level), side), np.nan)
                axes.plot(eta_1, eta_2, np.full(len(eta_1), level), color=colour)
            if eta_1[0] < ETA_1 < eta_1[-1]:
                at = int(np.argmin(np.abs(eta_1 - ETA_1)))
                line = np.linspace(0, last[at], 30)
                axes.plot(
                    np.full(30, ETA_1), _lower(eta_1[at], clear[at], line, side), line, color="black", linewidth=2
                )
    axes.set(title=f"(a) R {case['energy']:g}", xlabel="eta 1", ylabel="eta 2", zlabel="optical depth")
    axes.set(xlim=(1, 2.5), ylim=(1, ETA_MAX), zlim=(0, DEPTHS[-1]))
    axes.view_init(25, -60)


def _attenuated(energy: float, eta_1: Any) -> Any:
    """Reflectance that the lower interface must have, its medium included (Bati et al. 2021, Eq. 11)."""
    upper = fresnel.normal_incidence(eta_1)
    return (energy - upper) / (1 + (energy - 2) * upper)


def _lower(eta_1: Any, clear: Any, depth: Any, side: int) -> Any:
    """The lower index, denser or rarer, that makes up for an optical depth."""
    root = np.sqrt(np.minimum(clear * np.exp(2 * depth), 1 - 1e-9))
    return eta_1 * ((1 + root) / (1 - root)) ** side


def _lines(figure: Any, axes: Any, eta: Sequence[float], case: dict[str, Any], letter: str) -> None:
    """Draw the optical depth over both indices, and the first indices of the class."""
    depth = np.array(case["depth"], float).T
    drawn = axes.contourf(eta, eta, depth, levels=np.linspace(0, DEPTHS[-1], 13), extend="max")
    axes.contour(eta, eta, depth, levels=DEPTHS, colors="white", linewidths=0.7)
    for span in case["eta_1"]:
        axes.plot(span, (1.02, 1.02), "k", linewidth=4)
    axes.set(title=f"{letter}R {case['energy']:g}: optical depth", xlabel="eta 1", ylabel="eta 2")
    axes.set(xlim=(1, ETA_MAX), ylim=(1, ETA_MAX), facecolor="0.92")
    figure.colorbar(drawn, ax=axes, ticks=DEPTHS)


def _crosses(eta: Sequence[float], depth: Sequence[float | None], lines: Any, slices: Any) -> None:
    """Mark the pairs of figure 10 (b): the clear one, and the one with the largest lower index."""
    depths = np.array(depth, float)
    clear = float(np.interp(0, depths[depths > -0.5], np.array(eta)[depths > -0.5]))
    for eta_2, tau in ((clear, 0.0), (ETA_MAX, depths[-1])):
        lines.plot(ETA_1, eta_2, "rX", markersize=8, markeredgecolor="white", clip_on=False, zorder=5)
        slices.plot(eta_2, tau, "rX", markersize=8, markeredgecolor="white", clip_on=False, zorder=5)
