"""Stacks with the lobes of a target, found by a model in closed form."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from velatura.inverse.lobes import sampling
from velatura.inverse.lobes.equivalence import VANISHED, EquivalenceClass
from velatura.inverse.lobes.partial_stack import Layers
from velatura.inverse.lobes.stacks import Partial, class_of, follow, is_open, start
from velatura.inverse.lobes.target import Target
from velatura.inverse.local.dragged import seen
from velatura.model import Model
from velatura.ops import Value
from velatura.results import Result, Table, cell
from velatura.stack import Stack

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EFFORTS = ((12, 32), (24, 128), (64, 512))  # indices tried between the interfaces of a pair, and partial stacks kept
ALIKE = 1e-4  # by which the values of two stacks differ at least


@dataclass(frozen=True, repr=False)
class Solution(Result):
    """A stack with the lobes of a target, and the classes that its parts are chosen from.

    reached: the lobes of the stack, where these miss the target by more than rounding since so much is fixed.
    """

    target: Target
    model: Model
    layers: tuple[Layers, ...]
    reached: Target | None = None

    @cached_property
    def stack(self) -> Stack:
        """The material."""
        axes = [lobe.axes.rotation for lobe in self.target.lobes for _ in range(lobe.interfaces)]
        written = [layer for layers, axis in zip(self.layers, axes) for layer in layers.written(0, axis)]
        return Stack(written, name=self.target.name, exterior=self.target.exterior)

    def as_tables(self) -> list[Table]:
        """A row per interface: its lobe, the medium above it, and its parameters."""
        brushed = any(lobe.brushed for lobe in self.target.lobes)
        right = ("tau above", "eta", "k", "alpha", *(["rotation"] if brushed else []))
        rows: list[tuple[str, ...] | None] = []
        layers = iter(zip(self.layers, self.stack.interfaces))
        for n, lobe in enumerate(self.target.lobes, 1):
            for k in range(lobe.interfaces):
                part, written = next(layers)
                eta = None if part.kind == "mirror" else part.eta
                values = part.tau, eta, part.kappa, written.alpha, *([written.rotation] if brushed else [])
                rows.append((str(n) if k == 0 else "", part.kind, *map(cell, values)))
            rows.append(None)
        return [Table(f"{self.target.name or 'stack'} ({self.model.name})", ("lobe", "", *right), rows, right)]

    def plot(self, title: str = "", figure: Figure | None = None) -> Figure:
        """The class of every lobe, with what is chosen of it.

        Args:
            figure: one of Matplotlib's to draw on, a new one by default.

        Raises:
            MissingTool: the extra `plots` is not installed.
        """
        from velatura.inverse import plots

        figure = figure or plots.new_figure(5 * len(self.classes), 4.8)
        plots.draw_classes(figure, self, title or self.target.name or "stack")
        return figure

    def alike(self, other: Solution) -> bool:
        """Whether another stack of the same form has almost the same values."""

        def values(layers: Iterable[Layers]) -> list[Value]:
            return [x for part in layers for x in (part.eta, part.kappa, part.tau, *part.roughness[:2])]

        each = zip(values(self.layers), values(other.layers))
        return all(a is None or np.allclose(a, b, rtol=ALIKE, atol=ALIKE) for a, b in each)

    @cached_property
    def in_closed_form(self) -> Solution:
        """The same stack, and its lobes as the nearest model in closed form reads them."""
        if exact(self.target, self.model):
            return self
        return Solution(
            seen(self.stack, self.target, self.model.surrogate, quick=True), self.model.surrogate, self.layers
        )

    @cached_property
    def classes(self) -> tuple[EquivalenceClass, ...]:
        """The equivalence class of every lobe, below the layers chosen above it, by that model in closed form; of three
        interfaces that of the last two, below the first."""
        target, layers, found = self.in_closed_form.target, iter(self.layers), []
        above = start(target, self.model)
        for n, lobe in enumerate(target.lobes):
            left = np.array(lobe.colour)
            for k in range(lobe.interfaces):
                if k == max(lobe.interfaces - 2, 0):
                    found.append(class_of(above, lobe.below(k, left.tolist()), target, first=n == 0))
                above, read = above.below(next(layers))
                left = left - np.broadcast_to(read.energy, (3, 1))[:, 0]
        return tuple(found)


def exact(target: Target, model: Model) -> bool:
    """Whether the closed form reads lobes as the model itself does: films it knows roughly."""
    return model.closed_form and not target.has_films


def in_closed_form(target: Target, model: Model, efforts: Sequence[tuple[int, int]] = EFFORTS) -> Solution | None:
    """The preferred stack of a model in closed form, films on it known roughly."""
    if target.brightness > 1:
        return None
    paths = closed_form_paths(target, model, efforts)
    return next(solutions(target, model, paths, [int(np.argmin(paths.cost))]), None) if paths else None


def closed_form_paths(target: Target, model: Model, efforts: Sequence[tuple[int, int]] = EFFORTS) -> Partial | None:
    """The stacks of a model in closed form that are found at the lowest effort that finds any.

    If all efforts find none, or only stacks with an interface that vanishes, the indices between theirs are tried.
    """
    paths = None
    for spread, keep in efforts:
        for paths in follow(target, model, spread, keep):
            if not len(paths.cost):
                break
        if paths is not None and len(paths.cost):
            break
        if not any(is_open(lobe) for lobe in target.lobes):
            return None
    some = paths if paths is not None and len(paths.cost) else None
    if len(efforts) == len(EFFORTS) and (some is None or some.cost.min() >= VANISHED):
        return sampling.closer(target, model, some)
    return some


def solutions(target: Target, model: Model, paths: Partial, which: Iterable[int]) -> Iterator[Solution]:
    """Some of the stacks of a target."""
    return (Solution(target, model, paths.take(np.array([n])).layers) for n in which)
