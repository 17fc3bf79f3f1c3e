"""`velatura figure`: a figure of the papers, recomputed."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated

import typer

from velatura.cli import progress


def figure(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The figure, such as belcour2018-12.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="F", help="PNG, PDF or SVG; default: NAME.png, here.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figure's numbers as JSON; draw it only with -o.")
    ] = False,
) -> None:
    """Compute a figure of the papers: its numbers, and its picture."""
    # Refuse what cannot work before anything slow begins
    from velatura import comparison, figures

    chosen = figures.figure(name)
    path = output or (None if as_json else Path(f"{name}.png"))
    if path:
        comparison.check_figure(path)

    start = time.perf_counter()
    with progress.bar(f"Computing {name}") as advance:
        numbers = chosen.compute(progress=advance)
    if path:
        chosen.draw(numbers, path)
    if as_json:
        print(json.dumps({key: value for key, value in numbers.items() if key != "pictures"}, allow_nan=False))
    else:
        print(f"{path}: {name}, {time.perf_counter() - start:.1f} s")
