"""Pictures of equivalence classes, and of fits."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from velatura.errors import needs
from velatura.inverse.fitting.angles import ReflectanceTable, evenly, grouped, table_of

if TYPE_CHECKING:  # they draw themselves
    from matplotlib.figure import Figure

    from velatura.inverse.fitting.descent import Fit
    from velatura.inverse.lobes.equivalence import Coordinate, EquivalenceClass
    from velatura.inverse.lobes.partial_stack import Layers
    from velatura.inverse.solution import Solution

RESOLUTION = 256
PANELS, PAIRS = 6, 12  # angles of incidence, and correlations, that are drawn of a fit
SIZE, DPI = (4.2, 4.2), 90  # of a picture: inches, and pixels in one
FILLS = ("#d62728", "#2ca02c", "#1f77b4")  # of red, green and blue
DASHED = {"linewidth": 1, "linestyle": "--"}
CHANNELS = ("red", "green", "blue")
STAR: dict[str, Any] = {
    "color": "white",
    "marker": "*",
    "markersize": 12,
    "markeredgecolor": "black",
    "linestyle": "",
    "clip_on": False,
}


def new_figure(width: float, height: float) -> Figure:
    """A figure of so many inches, of no window. Raises MissingTool without the extra `plots`."""
    with needs("plots"):
        from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def png(members: EquivalenceClass) -> bytes:
    """A class as a picture, with its preferred member. Raises MissingTool without the extra `plots`."""
    figure = new_figure(*SIZE)
    draw(figure.add_subplot(), members, members.chosen)
    picture = io.BytesIO()
    figure.savefig(picture, dpi=DPI, format="png")
    return picture.getvalue()


def draw_classes(figure: Figure, solution: Solution, title: str) -> None:
    """The class of every lobe, side by side, with what is chosen of each."""
    figure.suptitle(f"{title}: what gives each lobe, by {solution.model.name}", wrap=True)
    layers = iter(solution.layers)
    for n, (members, lobe) in enumerate(zip(solution.classes, solution.target.lobes), 1):
        made_of = {
            1: f"one {lobe.base}",
            2: f"a pair that ends in a {lobe.base}",
            3: f"the last two of three, a {lobe.base} below",
        }[lobe.interfaces]
        axes = figure.add_subplot(1, len(solution.classes), n, title=f"lobe {n}: {made_of}")
        own = tuple(next(layers) for _ in range(lobe.interfaces))
        draw(axes, members, own[-members.interfaces :])


def draw(axes: Any, members: EquivalenceClass, chosen: tuple[Layers, ...] | None = None) -> None:
    """A class on matplotlib's axes, per channel and intersected, and the member that was chosen.

    Of a pair of dielectrics over (eta_1, eta_2), channels filled in their colours, with the curves without absorption,
    and all of them together in grey; of a pair over a conductor over eta_1 and what the coat absorbs, of one dielectric
    over its index and what absorbs above it; of a conductor its eta and k over tint. Beside a chosen member, dashed is
    what is left below a medium that absorbs half of what one above may, and the other coordinates have their ranges.
    """
    if members.choice.kind == "mirror" and not members.free:
        axes.text(0.5, 0.5, "nothing is free of a mirror but its roughness", ha="center", va="center")
        axes.set_axis_off()
        return
    coordinates = {one.name: one for one in members.coordinates} if chosen else {}
    half = {name: np.array(one.high) / 2 for name, one in coordinates.items() if name == "tau_0"}
    drawn = {"eta_1", "eta_2", "tau_1"} if members.free else {"tint"}
    colours = FILLS if np.ptp(members.energy) > 0 else ("0.4",)
    below = members.held(**half) if half else None
    (_draw_conductor, _draw_line, _draw_pair)[members.free](axes, members, below, colours)
    if chosen is not None:
        x, y = _place(members, chosen)
        numbers = [f"{np.ravel(part.eta)[0]:.2f}" for part in chosen[: members.free]]
        axes.plot(x, y, label=" ".join(["chosen", *(["eta", ", ".join(numbers)] if numbers else [])]), **STAR)
    if half:
        axes.plot([], [], **DASHED, color="black", label=f"below tau_0 {_numbers(half['tau_0'])}")
    if chosen is not None:
        axes.legend(fontsize="small")
    others = [f"{name} {_range(one)}" for name, one in coordinates.items() if name not in drawn]
    if others:
        axes.set_xlabel(f"{axes.get_xlabel()}\nalso free: {'; '.join(others)}")


def _draw_pair(axes: Any, members: EquivalenceClass, below: EquivalenceClass | None, colours: Sequence[str]) -> None:
    """Index against index, and dashed what is left `below` a medium that absorbs."""
    axis = np.linspace(1, members.choice.eta_max, RESOLUTION)
    depths = members.grid(axis, axis)
    for channel, colour in enumerate(colours):
        axes.contourf(axis, axis, depths[channel].T, levels=(0, np.inf), colors=[colour], alpha=0.2)
        for curve in members.boundary(channel=channel):
            axes.plot(*curve.T, color=colour, linewidth=1)
    least = np.min(depths, axis=0)
    axes.contourf(axis, axis, least.T, levels=(0, np.inf), colors=["0.7"])
    axes.contour(axis, axis, np.where(np.isnan(least), -1, least).T, levels=(0,), colors="black", linewidths=1)
    if below:
        rest = np.nan_to_num(np.min(below.grid(axis, axis), axis=0), nan=-1)
        axes.contour(axis, axis, rest.T, levels=(0,), colors="black", linewidths=1, linestyles="--")
    axes.set(xlabel="eta of the upper interface", ylabel="eta of the lower one")
    axes.set(xlim=(1, members.choice.eta_max), ylim=(1, members.choice.eta_max))
    _name_fills(axes, colours)


def _draw_line(axes: Any, members: EquivalenceClass, below: EquivalenceClass | None, colours: Sequence[str]) -> None:
    """The first index against what absorbs above the last interface."""
    for channel, colour in enumerate(colours):
        name = CHANNELS[channel] if len(colours) > 1 else "all channels"
        for span in members.indices_1():
            axis = np.linspace(*span, 65)
            least, most = (depth[channel] for depth in members.depths_1(axis))
            axes.fill_between(axis, least, most, color=colour, alpha=0.25)
            axes.plot(axis, least, color=colour, linewidth=1.5, label=name)
            name = "_"
    if below:
        for span in below.indices_1():
            axis = np.linspace(*span, 65)
            for most, colour in zip(below.depths_1(axis)[1], colours):
                axes.plot(axis, most, **DASHED, color=colour)
    index, medium = ("eta of the coat", "coat") if members.interfaces == 2 else ("eta", "medium above")
    axes.set(xlabel=index, xlim=(1, members.choice.eta_max), ylabel=f"optical depth of the {medium}")
    axes.set_ylim(bottom=0)


def _draw_conductor(
    axes: Any, members: EquivalenceClass, below: EquivalenceClass | None, colours: Sequence[str]
) -> None:
    """eta and k over the tint."""
    tint = np.linspace(0, 1, 129)
    for channel, colour in enumerate(colours):
        eta, kappa = _conductor(members, tint, channel)
        axes.plot(eta, kappa, color=colour, label=CHANNELS[channel] if len(colours) > 1 else "all channels")
        if channel == 0:  # where no other curve is: below and beyond the ends
            for end, label, offset, side in ((0, "tint 0", (0, -6), "top"), (-1, "tint 1", (6, 0), "center")):
                align = "left" if end else "center"
                place = {"xytext": offset, "textcoords": "offset points", "ha": align, "va": side}
                axes.annotate(label, (eta[end], kappa[end]), fontsize="small", **place)
        if below:
            axes.plot(*_conductor(below, tint, channel), **DASHED, color=colour)
    axes.margins(0.12)
    axes.set(xlabel="eta", ylabel="k")


def _range(one: Coordinate) -> str:
    return f"{_numbers(one.low)} to {_numbers(one.high)}"


def _numbers(value: Any) -> str:
    """A number, or those of channels where they differ."""
    numbers = [f"{x:.2g}" for x in np.ravel(value)]
    return numbers[0] if len(set(numbers)) == 1 else "[" + " ".join(numbers) + "]"


def _name_fills(axes: Any, colours: Sequence[str]) -> None:
    """Add the filled regions to the legend."""
    names = zip(colours, CHANNELS) if len(colours) > 1 else ()
    for colour, alpha, name in [*((colour, 0.2, name) for colour, name in names), ("0.7", 1.0, "all channels")]:
        axes.fill([], [], color=colour, alpha=alpha, label=name)


def _place(members: EquivalenceClass, chosen: tuple[Layers, ...]) -> tuple[Any, Any]:
    """Position of the chosen member on the axes of `draw`; for a conductor, a point for each channel."""
    if members.free == 0:
        return np.ravel(chosen[-1].eta), np.ravel(chosen[-1].kappa)
    point = [float(np.ravel(part.eta)[0]) for part in chosen[: members.free]]
    return point[0], point[1] if len(point) > 1 else float(np.mean(chosen[-1].tau))


def _conductor(members: EquivalenceClass, tint: np.ndarray, channel: int) -> tuple[np.ndarray, np.ndarray]:
    """eta and k of a channel over the tint."""
    (layers,) = members.member(tint=tint)
    eta, kappa = (np.broadcast_to(x, (len(members.energy), len(tint))) for x in (layers.eta, layers.kappa))
    return eta[channel], kappa[channel]


# Fits ----------------------------------------------------------------------------------------------------------------


def draw_fit(figure: Any, table: ReflectanceTable, found: Fit, title: str) -> None:
    """A table and its fit, a panel for each of up to six angles of incidence; below the intervals and correlations, or
    energies before and after.

    Over the tilt of the half-vector, f cos theta_o: of the table as points, of the stack as crosses.
    """
    figure.suptitle(f"{title}: the closest stack, by {found.model.name}, error {found.error:.2g}")
    names = ("before", "after") if found.energies else ("table", "fit")
    theta_i, cosine = grouped(table.directions.theta_i), table.directions.wo[2]
    fitted = table_of(found.stack, table.directions, found.model).value * cosine
    tilt = table.directions.tilt
    different = np.unique(theta_i)
    shown = different[evenly(len(different), PANELS)]
    above, below = figure.subfigures(2, 1, height_ratios=(3, 2))
    for n, angle in enumerate(shown):
        own = theta_i == angle
        across = 2 if len(shown) == 4 else 3
        axes = above.add_subplot(-(-len(shown) // across), min(len(shown), across), n + 1)
        axes.set_title(f"incidence at {angle:g}°")
        for c, colour in enumerate(FILLS):
            points = table.value[c, own] * cosine[own]
            one, other = (f"{CHANNELS[c]}, {name}" for name in names)
            axes.plot(tilt[own], points, "o", color=colour, markersize=6, mfc="none", mew=0.7, label=one)
            axes.plot(tilt[own], fitted[c, own], "x", color=colour, markersize=3, mew=0.7, label=other)
        least = np.quantile(np.abs(table.value[:, own] * cosine[own]), 0.05) + 1e-6
        axes.set_yscale("symlog", linthresh=float(least))
        axes.set(xlabel="tilt of the half-vector (degrees)", ylabel="f cos theta_o (1/sr)")
        if n == 0:
            axes.legend(fontsize="x-small", ncols=2)
    if found.energies:
        _draw_energies(below.subplots(), found)
    else:
        _draw_estimates(below, found)


def _draw_energies(axes: Any, found: Fit) -> None:
    """All that is reflected, over the angle of incidence, before and after."""
    theta_i = [row["theta_i"] for row in found.energies]
    for c, colour in enumerate(FILLS):
        for key, style in (("before", {"marker": "o", "mfc": "none"}), ("after", {"marker": "x", "linestyle": "--"})):
            label = f"{CHANNELS[c]}, {key}"
            axes.plot(theta_i, [row[key][c] for row in found.energies], color=colour, linewidth=1, label=label, **style)
    axes.set(xlabel="angle of incidence (degrees)", ylabel="energy", title="energy that is reflected")
    axes.set_ylim(bottom=0)
    axes.legend(fontsize="x-small", ncols=3)


def _draw_estimates(figure: Any, found: Fit) -> None:
    """The interval of each parameter as a share of its value, and the pairs of them that are most correlated."""
    left, right = figure.subplots(1, 2)
    for y, one in enumerate(found.estimates):
        size = max(abs(one.value), 1e-12)
        low, high = max((one.low - one.value) / size, -1.0), min((one.high - one.value) / size, 1.0)
        left.plot([low, high], [y, y], color="0.3", marker="|", markersize=8)
        left.plot(0, y, "o", color="black", markersize=4)
    left.set_yticks(
        range(len(found.estimates)), [f"{one.name} = {one.value:.3g}" for one in found.estimates], fontsize="small"
    )
    left.axvline(0, color="0.8", linewidth=1, zorder=0)
    left.set(xlim=(-1.05, 1.05), xlabel="interval (95 %), as a share of the value, cut off at 1", title="parameters")
    left.invert_yaxis()
    pairs = found.trades[:PAIRS]
    right.set_title("parameters that trade places" if pairs else "no parameters trade places")
    if not pairs:
        right.set_axis_off()
        return
    right.barh(range(len(pairs)), [r for *_, r in pairs], color="0.5", height=0.5)
    right.set_yticks(range(len(pairs)), [f"{a}, {b}" for a, b, _ in pairs], fontsize="small")
    right.set(xlim=(-1, 1), ylim=(PAIRS, -1), xlabel="correlation")
