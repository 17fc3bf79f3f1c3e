"""`velatura figure`: a figure of the papers, or all of them, recomputed."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from velatura.cli import progress
from velatura.errors import InvalidInput, VelaturaError, one_line

FOLDER = "figures"


def figure(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="The figure, such as belcour2018-12.")] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="F",
            help=f"PNG, WebP, PDF or SVG; default: NAME.png, here. With --all a folder; default: {FOLDER}.",
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figure's numbers as JSON; draw it only with -o.")
    ] = False,
    every: Annotated[
        bool, typer.Option("--all", help="Write all figures that the folder lacks: NAME.json and NAME.webp of each.")
    ] = False,
) -> None:
    """Compute a figure of the papers: its numbers, and its picture.

    With --all, figures that the folder has are left as they are, unless their sources have changed.
    """
    if every:
        if name or as_json:
            raise InvalidInput("--all takes neither NAME nor --json")
        _all(output or Path(FOLDER))
    elif name is None:
        raise InvalidInput("name a figure, such as belcour2018-12, or give --all")
    else:
        _one(name, output or (None if as_json else Path(f"{name}.png")), as_json)


def _one(name: str, path: Path | None, as_json: bool) -> None:
    # Refuse what cannot work before anything slow begins
    from velatura import comparison, figures
    from velatura.figures.store import numbers_of

    chosen = figures.figure(name)
    if path:
        comparison.check_figure(path)

    start = time.perf_counter()
    with progress.bar(f"Computing {name}") as advance:
        numbers = chosen.compute(progress=advance)
    if path:
        chosen.draw(numbers, path)
    if as_json:
        print(numbers_of(numbers))
    else:
        print(f"{path}: {name}, {time.perf_counter() - start:.1f} s")


def _all(folder: Path) -> None:
    """Raises VelaturaError when all others are made, if figures failed."""
    from velatura import comparison, figures
    from velatura.figures import store

    if not folder.exists() and folder.parent.is_dir():
        folder.mkdir()
    comparison.check_figure(folder / f"{figures.FIGURES[0]}.webp")

    missing = [name for name in figures.FIGURES if not store.is_made(name, folder)]
    print(f"{folder}: {len(figures.FIGURES)} figures, {len(missing)} to make", flush=True)
    failed = []
    for number, name in enumerate(missing, 1):
        start = time.perf_counter()
        try:
            with progress.bar(f"{number} of {len(missing)}: {name}") as advance:
                store.make(name, folder, advance)
            print(f"{name}: {time.perf_counter() - start:.1f} s", flush=True)
        except Exception as error:  # of any kind, so that the others are made
            if _interrupts(error):
                raise KeyboardInterrupt from None
            failed.append(name)
            print(one_line(f"{name}: failed: {error or type(error).__name__}"), file=sys.stderr, flush=True)
    if failed:
        raise VelaturaError(f"{len(failed)} of {len(missing)} figures failed: {', '.join(failed)}")


def _interrupts(error: BaseException | None) -> bool:
    """Whether an error is what a library made of Ctrl-C."""
    while error and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
