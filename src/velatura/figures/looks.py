"""Figures of pictures of inverted stacks: stacks by name, their lobes over the angle, and a sphere of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from velatura.figures import canvas
from velatura.inverse import Layers, invert_stack, on_black
from velatura.inverse.figure_targets import FIGURES
from velatura.inverse.plots import FILLS
from velatura.model.lobe_statistics import StackLobes
from velatura.model.stack_lobes import stack_lobes
from velatura.stack import Stack

MODEL = "bati2021"
COSINES = (1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1)
GRAZING = COSINES.index(0.2)


@dataclass(frozen=True)
class Looks:
    """A figure of looks alone: what finds its stacks by name, and what else `looks.compute` is given."""

    stacks: Callable[[], Mapping[str, Stack]]
    options: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, targets: Sequence[str], **switches: Any) -> Looks:
        """That of stacks which have the lobes of the paper's targets of these names."""
        return cls(lambda: inverted(targets, **switches), switches)

    def compute(
        self,
        size: int = canvas.SIZE,
        spp: int = canvas.SAMPLES,
        seed: int = 0,
        progress: Callable[[int, int], None] | None = None,
    ) -> dict[str, Any]:
        """As `looks.compute`."""
        return compute(self.stacks(), size, spp, seed, progress, **self.options)

    def draw(self, numbers: Mapping[str, Any], path: str | Path) -> None:
        """As `looks.draw`.

        Raises:
            InvalidInput: the file cannot be written.
        """
        draw(numbers, path)


def inverted(names: Sequence[str], **switches: Any) -> dict[str, Stack]:
    """Stacks that have the lobes of the paper's targets of these names."""
    return {name: invert_stack(FIGURES[name], MODEL, **switches).stack for name in names}


def of_layers(layers: Sequence[Layers], exterior: float = 1.0) -> Stack:
    """The first of the stacks of these interfaces."""
    return Stack([layer for part in layers for layer in part.written(0)], exterior=exterior)


def compute(
    stacks: Mapping[str, Stack],
    size: int = canvas.SIZE,
    spp: int = canvas.SAMPLES,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    scene: str = "sphere",
    env: str = "studio",
    **switches: Any,
) -> dict[str, Any]:
    """For every stack a `look` and its `pictures`: on a base that absorbs what passes.

    Of a look: `name`, the `stack`, over `cosines` the `energy` of all lobes together (rgb) and, for every lobe from the
    top, its `energies` and its `variances` in the plane of incidence.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    numbers: dict[str, Any] = {"cosines": list(COSINES), "looks": [], "pictures": []}
    for name, stack in canvas.track(list(stacks.items()), progress):
        read = stack_lobes(stack, COSINES, model=MODEL, **switches)
        numbers["looks"].append({"name": name, "stack": stack.to_dict(), **_lobes(read)})
        passes = canvas.pictures(scene, on_black(stack), MODEL, env, size, spp, seed, **switches)
        numbers["pictures"].append(passes.mean(axis=0).tolist())
    return numbers


def _lobes(read: StackLobes) -> dict[str, Any]:
    return {
        "energy": np.sum(read.energy, axis=0).T.tolist(),
        "energies": [energy.T.tolist() for energy in read.energy],
        "variances": [covariance[0].tolist() for covariance in read.covariance],
    }


def draw(numbers: Mapping[str, Any], path: str | Path, exposure: float = 1.0) -> None:
    """For each stack its sphere, the energy of all lobes together over the angle, and that and variance of each.

    Raises:
        InvalidInput: the file cannot be written.
    """
    looks = numbers["looks"]
    figure = canvas.canvas(2.6 * len(looks), 7.5)
    rows = figure.subplots(3, len(looks), squeeze=False, sharey="row")
    angles = np.degrees(np.arccos(numbers["cosines"]))
    for (picture, energy, variance), look, seen in zip(rows.T, looks, numbers["pictures"]):
        canvas.show(picture, exposure * np.array(seen), look["name"])
        for channel, colour in enumerate(FILLS):
            energy.plot(angles, np.array(look["energy"])[:, channel], color=colour)
            for lobe in look["energies"]:
                energy.plot(angles, np.array(lobe)[:, channel], color=colour, linewidth=0.8, linestyle=":")
        for n, lobe in enumerate(look["variances"], 1):
            variance.plot(angles, lobe, label=f"lobe {n}")
        energy.set(title="energy")
        variance.set(title="variance", xlabel="angle of incidence (°)")
        variance.legend(fontsize="x-small")
    for row in rows[1:]:  # once all is plotted, since the axis is shared
        row[0].set_ylim(0, None)
    canvas.save(figure, path)


def energy(numbers: Mapping[str, Any], name: str, at: int = 0) -> Any:
    """Energy of all lobes of a stack together (rgb), at one of the cosines."""
    return np.array(next(look for look in numbers["looks"] if look["name"] == name)["energy"][at])
