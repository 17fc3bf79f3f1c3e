"""Figures of pictures: stacks by name, each rendered by models and by the truth, and the lobe of its last interface."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from velatura import reference
from velatura.api import lobes
from velatura.comparison.evaluated_lobes import along
from velatura.figures import Progress, canvas
from velatura.stack import Stack, Varying

COSINES = (1.0, 0.7, 0.4, 0.2)
PATHS = 200_000

Columns = Mapping[str, tuple[str, Mapping[str, str]]]  # by title: a model, and its choices


class Quality(NamedTuple):
    """Pixels along a side of a picture, samples of each, and paths of a walk."""

    size: int = canvas.SIZE
    spp: int = canvas.SAMPLES
    paths: int = PATHS


QUALITY = Quality()
TEASER = Quality(spp=16)


@dataclass(frozen=True)
class Cells:
    """A figure of cells: its stacks by name, its columns, the object, and how bright its pictures are drawn.

    Stacks with textures are given as what makes them, and writes their images into a folder.
    """

    stacks: Mapping[str, Stack] | Callable[[Path], Mapping[str, Stack]]
    columns: Columns
    scene: str = "sphere"
    exposure: float = 1.0
    quality: Quality = QUALITY

    def compute(
        self,
        names: Collection[str] | None = None,
        size: int | None = None,
        spp: int | None = None,
        paths: int | None = None,
        seed: int = 0,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """A cell for each stack, or for those named: see `cells.compute`.

        Raises:
            InvalidInput, MissingTool: as `vt.render`.
        """
        given = {"size": size, "spp": spp, "paths": paths}
        quality = self.quality._replace(**{key: value for key, value in given.items() if value is not None})
        with tempfile.TemporaryDirectory() as folder:
            stacks = self.stacks(Path(folder)) if callable(self.stacks) else self.stacks
            chosen = {name: stack for name, stack in stacks.items() if names is None or name in names}
            return compute(chosen, self.columns, quality, seed, progress, self.scene)

    def draw(self, numbers: dict[str, Any], path: str | Path) -> None:
        """The truth, each model, and what that has too much or too little.

        Raises:
            InvalidInput: the file cannot be written.
        """
        draw(numbers, path, self.exposure)


def compute(
    stacks: Mapping[str, Stack],
    columns: Columns,
    quality: Quality,
    seed: int,
    progress: Progress | None = None,
    scene: str = "sphere",
    env: str = "studio",
) -> dict[str, Any]:
    """A list of `cells` by `name`: of each column `canvas.errors` and the `mean` radiance; and their `pictures`.

    Where a stack does not vary over the surface, `alpha` is that of its last interface's
    lobe by column and by `walk`, `ratio` that of each column over the walk's, and `energy` its energy: lists over
    `cos`, alpha and ratio of pairs along the true lobe's axes.

    Raises:
        InvalidInput, MissingTool: as `vt.render`.
    """
    numbers: dict[str, Any] = {"cos": list(COSINES), "cells": [], "pictures": []}
    for name, stack in canvas.track(list(stacks.items()), progress):
        images = {"reference": canvas.pictures(scene, stack, "reference", env, quality.size, quality.spp, seed)}
        for title, (model, choices) in columns.items():
            images[title] = canvas.pictures(scene, stack, model, env, quality.size, quality.spp, seed, **choices)
        found = canvas.errors({title: images[title] for title in columns}, images["reference"])
        cell: dict[str, Any] = {"name": name, **found}
        cell["mean"] = {title: float(passes.mean()) for title, passes in images.items()}
        if not any(isinstance(value, Varying) for value in stack.flat().values()):
            cell |= _last_lobe(stack, columns, quality.paths, seed)
        numbers["cells"].append(cell)
        numbers["pictures"].append({title: passes.mean(axis=0).tolist() for title, passes in images.items()})
    return numbers


def _last_lobe(stack: Stack, columns: Columns, paths: int, seed: int) -> dict[str, Any]:
    true = _last(reference.statistics(canvas.in_channels(stack), COSINES, 0.0, paths, seed))
    modelled = {"walk": true}
    for title, (model, choices) in columns.items():
        modelled[title] = along(_last(lobes(stack, COSINES, 0.0, model, **choices)), true)
    return {
        "ratio": {title: (modelled[title].alpha / true.alpha).T.tolist() for title in columns},
        "alpha": {title: lobe.alpha.T.tolist() for title, lobe in modelled.items()},
        "energy": {title: lobe.energy.mean(axis=0).tolist() for title, lobe in modelled.items()},
    }


def _last(found: Any) -> reference.WalkedLobe:
    """The last of the reflected lobes, without what only walks know."""
    unknown = np.full(1, np.nan)
    return reference.WalkedLobe(found.energy[-1], found.alpha[-1], found.rotation[-1], unknown, unknown)


def draw(numbers: dict[str, Any], path: str | Path, exposure: float = 1.0, bound: float = 0.2) -> None:
    """The truth of each cell, and for each model its picture, and what it has too much or too little, up to a bound.

    Raises:
        InvalidInput: the file cannot be written.
    """
    cells = numbers["cells"]
    titles = [title for title in numbers["pictures"][0] if title != "reference"]
    grid = _layout(len(cells), len(titles))
    rows, columns = 1 + grid[..., 0].max(), 1 + grid[..., 1].max()
    figure = canvas.canvas(2.4 * columns + 0.6, 2.5 * rows)
    every = figure.subplots(rows, columns, squeeze=False)
    for axes in every.flat:
        axes.set_axis_off()
    for places, cell, pictures in zip(grid, cells, numbers["pictures"]):
        seen = canvas.shown(pictures)
        line = [every[tuple(place)] for place in places]
        canvas.show(line[0], exposure * seen["reference"], f"reference, {cell['name']}")
        for n, title in enumerate(titles):
            canvas.show(line[2 * n + 1], exposure * seen[title], title)
            error = canvas.error_label(cell, title)
            drawn = canvas.show_difference(line[2 * n + 2], seen[title], seen["reference"], bound, error)
    figure.colorbar(drawn, ax=every[-1, :], shrink=0.8, label="minus the reference")
    canvas.save(figure, path)


def _layout(cells: int, models: int) -> Any:
    """Rows and columns (cells, 1 + 2 models, 2) of a cell's truth, and of each model's picture and difference by turns.

    Cells are columns where they are many. Where models are many, differences stand below their pictures.
    """
    cell, part = np.indices((cells, 1 + 2 * models))
    if cells > 2 * models:
        row, column = part, cell
    elif models > 2:
        row, column = 2 * cell + (part % 2 == 0) * (part > 0), (part + 1) // 2
    else:
        row, column = cell, part
    return np.stack([row, column], axis=-1)
