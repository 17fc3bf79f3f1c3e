"""`velatura tables`: build the tables of averages from nothing, and measure them."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer

from velatura.cli import options, progress
from velatura.results import Table


def tables(
    as_json: options.Json = False,
    yardstick: Annotated[
        bool, typer.Option("--yardstick", help="Add the plain 64^4 grid of Belcour 2018, which they replace.")
    ] = False,
) -> None:
    """Build the tables from nothing, and measure them."""
    from velatura.tables.build.report import report

    with progress.bar("Building tables") as advance:
        rows = report(progress=lambda share: advance(round(1000 * share), 1000), with_yardstick=yardstick)
    if as_json:
        print(json.dumps(rows, allow_nan=False))
        return

    columns = [column.replace("_", " ") for column in rows[0]]
    texts = [[_cell(name, value) for name, value in row.items()] for row in rows]
    options.console().print(Table("", columns, texts, [column for column in columns if column != "table"]))


def _cell(name: str, value: Any) -> str:
    if name == "shape":
        return "x".join(map(str, value))
    if name.endswith("_error"):
        return f"{value:.1e}"
    return f"{value:.2f}" if isinstance(value, float) else "" if value is None else str(value)
