"""`velatura check`: hold a material to the laws that every BSDF must keep."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from velatura.cli import options, progress
from velatura.errors import LawBroken

if TYPE_CHECKING:
    from rich.table import Table

    from velatura.checks import Report

_STYLES = {"kept": "green", "declared": "yellow", "broken": "red"}


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
        options.console().print(_table(f"{stack.name or material} ({name})", report))
    if not report.passed:
        raise LawBroken(f"{stack.name or material} ({name}) breaks a law: {', '.join(report.broken)}")


def _table(title: str, report: Report) -> Table:
    """A row per law."""
    from rich.table import Table
    from rich.text import Text

    caption = f"false alarms: {report.false_alarms:g} of all reports"
    table = Table("law", title=Text(title), title_justify="left", caption=caption, caption_justify="left")
    table.add_column("")
    for column in ("value", "bound"):
        table.add_column(column, justify="right")
    table.add_column("", overflow="fold")
    for finding in report.findings:
        status = Text(finding.status, _STYLES[finding.status])
        table.add_row(finding.law, status, f"{finding.value:.4g}", f"{finding.bound:.4g}", Text(finding.detail))
    return table
