"""Scores as one picture: total variation by candidate and kind of stack."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from velatura import files
from velatura.benchmark.scores import Scores
from velatura.benchmark.stacks import EDITIONS
from velatura.comparison import check_figure

DARK = 0.12  # from here on numbers are white
WORST = 0.4  # end of the scale of colours


def save_figure(scores: Sequence[Scores], path: str | Path) -> None:
    """Draw scores into a PNG, PDF or SVG, written whole or not at all.

    A row for each candidate, those that express most first, a column for each kind, and the mean of all its records; an
    empty field where a candidate cannot express any stack, a number in italics where it cannot express some.

    Raises:
        InvalidInput: the file cannot be written.
        MissingTool: the extra `plots` is not installed.
    """
    target = check_figure(path)
    from matplotlib.colors import PowerNorm
    from matplotlib.figure import Figure

    every = [kind.name for edition in EDITIONS.values() for kind in edition.kinds]
    kinds: list[str | None] = [kind for kind in every if any(kind in each.asked for each in scores)]
    columns = [*kinds, None]
    order = sorted(scores, key=lambda each: (-each.summary()["records"], each.summary().get("variation", 0)))
    cells = [[each.summary(kind) if kind in (None, *each.asked) else {} for kind in columns] for each in order]
    values = np.array([[cell.get("variation", np.nan) for cell in row] for row in cells])

    figure = Figure(figsize=(2.4 + 0.75 * len(columns), 1.6 + 0.32 * len(order)), layout="constrained")
    axes = figure.subplots()
    axes.imshow(values, cmap="viridis_r", norm=PowerNorm(0.5, 0, WORST), aspect="auto")
    for (row, column), value in np.ndenumerate(values):
        cell = cells[row][column]
        if np.isfinite(value):
            axes.text(
                column,
                row,
                f"{value:.3f}".removeprefix("0"),
                ha="center",
                va="center",
                color="white" if value > DARK else "black",
                fontsize=8,
                style="normal" if cell["records"] == cell["asked"] else "italic",
            )
    axes.set_xticks(range(len(columns)), [kind or "all scored" for kind in columns], rotation=35, ha="right")
    axes.set_yticks(range(len(order)), [each.name for each in order], parse_math=False)
    axes.set_title("Total variation against the truth (italic: some stacks cannot be expressed)", fontsize=10)
    with files.whole(target) as unfinished:
        figure.savefig(unfinished, dpi=120)
