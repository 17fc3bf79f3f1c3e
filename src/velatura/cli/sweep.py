"""`velatura sweep`: the same question asked of many materials, into a Zarr store."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from velatura.cli import options


def sweep(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="What varies, and what is asked (YAML or JSON).")],
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            parser=options.folder,
            metavar="STORE",
            help="The Zarr store; one that was begun is continued.",
        ),
    ],
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="A scheduler of dask (tcp://host:8786); default: processes here."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, max=4096, metavar="N", help="Processes here; default: one for each core.")
    ] = None,
    part: Annotated[
        str | None, typer.Option(metavar="K/N", help="One part of N alone, as a job of an array: 3/64.")
    ] = None,
) -> None:
    """Ask the same of many materials, here or on a cluster."""
    from velatura import sweeps

    start = time.perf_counter()
    found = sweeps.carry_out(sweeps.load_plan(plan), output, scheduler, workers, part=part)
    seconds = f"{time.perf_counter() - start:.1f} s"
    if part:  # beside others that write, whose points are not read
        print(f"{output}: part {part} is done, {seconds}")
        return
    failed = int((found.status == 0).sum())
    why = f", {failed} failed: see `reason`" if failed else ""
    print(f"{output}: {found.status.size} points{why}, {seconds}")
