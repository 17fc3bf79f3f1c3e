"""`velatura check`: hold a material to the laws that every BSDF must keep."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from velatura.cli import options, progress
from velatura.errors import LawBroken


def check(
    material: options.Material,
    model: options.Bsdf = None,
    settings: options.Settings = None,
    plots: Annotated[
        Path | None,
        typer.Option(parser=options.folder, metavar="DIR", help="A folder for a plot of each law that is broken."),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Check the energy, reciprocity and sampling of a material."""
    stack, switches = options.read(material, settings)
    import velatura

    name = options.model_name(model)
    with progress.bar(f"Checking {stack.name or material}") as advance:
        report = velatura.check(stack, model=name, plots=plots, progress=advance, **switches)

    if as_json:
        print(json.dumps({"material": stack.name or material, "model": name, **report.to_dict()}, allow_nan=False))
    else:
        options.console().print(*report.as_tables())
    if not report.passed:
        raise LawBroken(f"{stack.name or material} ({name}) breaks a law: {', '.join(report.broken)}")
