"""Figures of pictures of inverted stacks: spheres of one stack, or of two, a half each; their lobes over the angle."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import scenes
from velatura.figures import Progress, canvas
from velatura.figures.bati2021_targets import FIGURES
from velatura.inverse import Layers, invert_stack, on_black
from velatura.inverse.plots import CHANNELS, FILLS
from velatura.model.lobe_statistics import StackLobes
from velatura.model.registry import stack_lobes
from velatura.scenes.environments import studio
from velatura.stack import Stack

Array = NDArray[np.floating]

MODEL = "bati2021"
COSINES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1)
SIZE, SAMPLES = canvas.SIZE, 16  # of a picture: pixels along a side, and samples of each

WIDTH, HEIGHT = 3.1, 2.6  # of a panel's column, and of a row, in inches
STYLES = ("-", "--")  # of the left half, and of the right one
#: Of channels that are equal.
COLOURS: dict[tuple[int, ...], str] = {(0, 1, 2): "black", (0, 1): "#b59f00", (1, 2): "#17a2a2", (0, 2): "#a23bbd"}
COLOURS |= {(channel,): colour for channel, colour in enumerate(FILLS)}
#: Interfaces, counted from below.
LEVELS = {
    "lowest interface": "#d08a00",
    "2nd from below": "#7b3fa0",
    "3rd from below": "#2a8c8c",
    "4th from below": "#8c564b",
}
INSET = 0.22  # of the side of a picture
EQUAL = 1e-3  # difference of channels, over the largest energy, that are drawn as one

Chart = Callable[..., None]  # draws on axes for a panel, given the `looks` by name


class Panel(NamedTuple):
    """A picture of the stack of that name, or of two, the left and the right half; labels of the halves.

    `upper` names the stack of the lobes above the last one alone, which shows what each contributes.
    """

    title: str
    names: tuple[str, ...]
    labels: tuple[str, ...] = ()
    upper: str | None = None


@dataclass(frozen=True)
class Looks:
    """A figure of looks alone: what finds its stacks by name, its panels, and what else `looks.compute` is given.

    chart: draws what stands above the pictures. detail: whether energies and variances are drawn of each interface.
    inset: whether that part of the pictures is drawn larger in which panels differ most.
    """

    stacks: Callable[[], Mapping[str, Stack]]
    panels: Sequence[Panel]
    options: Mapping[str, Any] = field(default_factory=dict)
    chart: Chart | None = None
    detail: bool = False
    inset: bool = False

    @classmethod
    def of(cls, targets: Mapping[str, str], **switches: Any) -> Looks:
        """That of stacks which have the lobes of the paper's targets of these names, each with a title."""
        panels = [Panel(title, (name,)) for name, title in targets.items()]
        return cls(lambda: inverted(tuple(targets), **switches), panels, switches, detail=True)

    @classmethod
    def apart(cls, targets: Mapping[str, str], **switches: Any) -> Looks:
        """That of targets of two lobes, with what each lobe contributes, and with the part that differs most."""

        def stacks() -> dict[str, Stack]:
            found = inverted(tuple(targets), **switches)
            return found | {f"{name}, upper": topmost(stack, FIGURES[name][0]) for name, stack in found.items()}

        panels = [Panel(title, (name,), upper=f"{name}, upper") for name, title in targets.items()]
        return cls(stacks, panels, switches, detail=True, inset=True)

    def compute(
        self, size: int = SIZE, spp: int = SAMPLES, seed: int = 0, progress: Progress | None = None
    ) -> dict[str, Any]:
        """Numbers of `looks.compute`."""
        return compute(self.stacks(), size, spp, seed, progress, **self.options)

    def draw(self, numbers: Mapping[str, Any], path: str | Path) -> None:
        """The chart of each panel, its picture, what each lobe adds to it, and energies and variances over the angle.

        Raises:
            InvalidInput: the file cannot be written.
        """
        looks = {look["name"]: look for look in numbers["looks"]}
        seen = canvas.shown(dict(zip(looks, numbers["pictures"])))
        angles = np.degrees(np.arccos(numbers["cosines"]))

        # List the rows: the label of their axis, and what draws a panel
        rows: list[tuple[str, Callable[[Any, Panel], None]]] = []
        if self.chart:
            rows.append(("", partial(self.chart, looks=looks)))
        rows.append(("", lambda axes, panel: split(axes, halves(panel, seen), panel.title, panel.labels)))
        if any(panel.upper for panel in self.panels):
            rows.append(("", lambda axes, panel: canvas.show(axes, seen[str(panel.upper)], "upper lobe alone")))
            rows.append(("", lambda axes, panel: canvas.show(axes, lower(panel, seen), "lower lobe alone")))
        rows.append(("energy, all lobes", lambda axes, panel: total(axes, panel, looks, angles)))
        if self.detail:
            for key, label in (("energies", "energy by interface"), ("variances", "variance by interface")):
                rows.append((label, partial(by_interface, looks=looks, angles=angles, key=key)))

        figure = canvas.canvas(WIDTH * len(self.panels), HEIGHT * len(rows))
        grid = figure.subplots(len(rows), len(self.panels), squeeze=False, sharey="row")
        for line, (label, paint) in zip(grid, rows):
            for axes, panel in zip(line, self.panels):
                paint(axes, panel)
            if label:  # once all is plotted, since the axis is shared
                line[0].set_ylabel(label)
                line[0].set_ylim(0, None)
        for axes in grid[-1]:
            axes.set_xlabel("angle of incidence (°)")
        if self.inset:
            enlarge(grid[0 if self.chart is None else 1])
        canvas.save(figure, path)


def inverted(names: Sequence[str], **switches: Any) -> dict[str, Stack]:
    """Stacks that have the lobes of the paper's targets of these names."""
    return {name: invert_stack(FIGURES[name], MODEL, **switches).stack for name in names}


def of_layers(layers: Sequence[Layers], exterior: float = 1.0) -> Stack:
    """The first of the stacks of these interfaces."""
    return Stack([layer for part in layers for layer in part.written(0)], exterior=exterior)


def topmost(stack: Stack, lobe: Mapping[str, Any]) -> Stack:
    """The interfaces of a stack's first lobe alone, whose lobe they are in the stack as well."""
    last = stack.interfaces[lobe["interfaces"] - 1]
    return Stack(stack.layers[: stack.layers.index(last) + 1], exterior=stack.exterior)


# Numbers -------------------------------------------------------------------------------------------------------------


def compute(
    stacks: Mapping[str, Stack],
    size: int = SIZE,
    spp: int = SAMPLES,
    seed: int = 0,
    progress: Progress | None = None,
    scene: str = "sphere",
    **switches: Any,
) -> dict[str, Any]:
    """A `look` of every stack and its `pictures`, on a base that absorbs what passes.

    Of a look: `name`, the `stack`, over `cosines` the `energy` of all reflected light (rgb), that of the `remainder`,
    which a diffuse base reflects, and, for every interface from the top, its `energies` and its `variances` in the
    plane of incidence.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    numbers: dict[str, Any] = {"cosines": list(COSINES), "looks": []}
    for name, stack in stacks.items():
        read = stack_lobes(stack, COSINES, model=MODEL, **switches)
        numbers["looks"].append({"name": name, "stack": stack.to_dict(), **_lobes(read)})
    numbers["pictures"] = list(pictures(stacks, size, spp, seed, progress, scene, **switches).values())
    return numbers


def pictures(
    stacks: Mapping[str, Stack],
    size: int,
    spp: int,
    seed: int,
    progress: Progress | None = None,
    scene: str = "sphere",
    **switches: Any,
) -> dict[str, Any]:
    """A picture of each stack by name, on a base that absorbs what passes, in light from the left and the right alike.

    Then both halves of a sphere of one material look alike, and only what materials differ by shows.
    """
    light, found = studio(), {}
    with tempfile.TemporaryDirectory() as folder:
        even = Path(folder) / "even.exr"
        scenes.write_image(np.maximum(light, light[:, ::-1]), even)
        for name, stack in canvas.track(list(stacks.items()), progress):
            passes = canvas.pictures(scene, on_black(stack), MODEL, str(even), size, spp, seed, **switches)
            found[name] = passes.mean(axis=0).tolist()
    return found


def _lobes(read: StackLobes) -> dict[str, Any]:
    return {
        "energy": (np.sum(read.energy, axis=0) + read.remainder).T.tolist(),
        "remainder": read.remainder.T.tolist(),
        "energies": [energy.T.tolist() for energy in read.energy],
        "variances": [covariance[0].tolist() for covariance in read.covariance],
    }


def energy(numbers: Mapping[str, Any], name: str, at: int = 0) -> Any:
    """Energy of all reflected light of a stack (rgb), at one of the cosines."""
    return np.array(next(look for look in numbers["looks"] if look["name"] == name)["energy"][at])


# Drawing -------------------------------------------------------------------------------------------------------------


def interfaces(look: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The interfaces of a look's stack, from the top."""
    return [layer["interface"] for layer in look["stack"]["layers"] if "interface" in layer]


def mark(axes: Any, points: Sequence[Sequence[float]], labels: Sequence[str]) -> None:
    """Draw the members of a class that the halves of a picture show: the left one bright, the right one dark."""
    for (x, y), label, colour in zip(points, labels, ("white", "0.2")):
        axes.plot(x, y, "s", color=colour, markeredgecolor="black", markersize=8, label=label, clip_on=False)
    axes.legend(fontsize="x-small")


def halves(panel: Panel, seen: Mapping[str, Array]) -> Array:
    """The picture of a panel: that of its stack, or the left half of one beside the right half of the other."""
    first, last = seen[panel.names[0]], seen[panel.names[-1]]
    middle = first.shape[1] // 2
    return np.concatenate([first[:, :middle], last[:, middle:]], axis=1)


def split(axes: Any, picture: Array, title: str, labels: Sequence[str] = ()) -> None:
    """Draw a picture, with labels of its halves."""
    canvas.show(axes, picture, title)
    size = len(picture)
    for label, x, side in zip(labels, (0.02, 0.98), ("left", "right")):
        axes.text(x, 0.03, label, transform=axes.transAxes, ha=side, color="white", fontsize="small")
    if labels:
        for ends in ((0, 0.05), (0.9, 1)):  # show where the halves meet, and leave the sphere free
            axes.plot([size / 2 - 0.5] * 2, [size * (1 - end) - 0.5 for end in ends], color="white", linewidth=0.8)


def curves(axes: Any, angles: Array, each: Sequence[Array], labels: Sequence[str] = ()) -> None:
    """Energies (angles, rgb) of each half, channels in their colours, and in one where they are equal."""
    groups = {}
    for values, style in zip(each, STYLES):
        for channels in _equal(values):
            axes.plot(angles, values[:, channels[0]], style, color=COLOURS[channels])
            groups[channels] = "grey" if len(channels) == 3 else ", ".join(CHANNELS[channel] for channel in channels)
    for channels, label in groups.items():
        axes.plot([], [], color=COLOURS[channels], label=label)
    for label, style in zip(labels, STYLES):
        axes.plot([], [], style, color="0.6", label=label)
    axes.legend(fontsize="x-small")


def total(axes: Any, panel: Panel, looks: Mapping[str, Any], angles: Array) -> None:
    """Draw the energy of all reflected light of a panel's stacks over the angle, and dotted that of diffuse bases."""
    each = [np.array(looks[name]["energy"]) for name in panel.names]
    curves(axes, angles, each, panel.labels)
    for name in panel.names:
        diffuse = np.array(looks[name]["remainder"])
        if diffuse.any():
            for channels in _equal(diffuse):
                axes.plot(angles, diffuse[:, channels[0]], ":", color=COLOURS[channels])
            axes.plot([], [], ":", color="0.5", label="diffuse")
            axes.legend(fontsize="x-small")


def by_interface(axes: Any, panel: Panel, looks: Mapping[str, Any], angles: Array, key: str) -> None:
    """Energies, the mean of the channels, or variances of interfaces, counted from below, over the angle."""
    count = 0
    for name, style in zip(panel.names, STYLES):
        for n, values in enumerate(reversed(looks[name][key])):
            mean = np.mean(values, axis=1) if key == "energies" else values
            label, colour = list(LEVELS.items())[n]
            axes.plot(angles, mean, style, color=colour, label=label if n >= count else None)
        count = len(looks[name][key])
    if not any(np.any(looks[name]["variances"]) for name in panel.names) and key == "variances":
        axes.text(0.5, 0.5, "smooth", transform=axes.transAxes, ha="center", color="0.5")
    axes.legend(fontsize="x-small")


def _equal(values: Array) -> list[tuple[int, ...]]:
    """The channels of energies (..., 3), together those that are equal."""
    same = EQUAL * np.max(values)
    found: list[tuple[int, ...]] = []
    for channel in range(3):
        for n, channels in enumerate(found):
            if np.max(np.abs(values[:, channel] - values[:, channels[0]])) < same:
                found[n] = (*channels, channel)
                break
        else:
            found.append((channel,))
    return found


def lower(panel: Panel, seen: Mapping[str, Array]) -> Array:
    """The part of a picture that the last lobe contributes: lobes add up."""
    return np.maximum(seen[panel.names[0]] - seen[str(panel.upper)], 0)


def enlarge(row: Sequence[Any]) -> None:
    """Draw, in each picture, that part of it larger in which they differ most."""
    shown = [axes.images[0].get_array() for axes in row]
    size = len(shown[0])
    width = max(round(INSET * size), 2)
    apart = np.ptp(shown, axis=0).mean(axis=-1)
    total = np.pad(apart.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    sums = total[width:, width:] - total[:-width, width:] - total[width:, :-width] + total[:-width, :-width]
    y, x = np.unravel_index(np.argmax(sums), sums.shape)
    for axes, picture in zip(row, shown):
        larger = axes.inset_axes((0.62, 0.0, 0.38, 0.38))
        larger.imshow(picture[y : y + width, x : x + width], extent=(x, x + width, y + width, y))
        larger.set(xticks=(), yticks=())
        axes.indicate_inset_zoom(larger, edgecolor="white", alpha=1.0, linewidth=1.2)
