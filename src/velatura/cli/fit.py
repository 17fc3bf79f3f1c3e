"""`velatura fit`: the stack that comes closest to a table of reflectance over angles."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from velatura.cli import invert, options

if TYPE_CHECKING:
    from velatura.inverse import Fit

Output = Annotated[Path | None, typer.Option("--output", "-o", metavar="F", help="The material (YAML or JSON).")]


def fit(
    table: Annotated[str, typer.Argument(metavar="TABLE", help="CSV: theta_i, theta_o, phi in degrees, and r, g, b.")],
    target: Annotated[
        str,
        typer.Argument(
            metavar="TARGET",
            help="Its approximate lobes at normal incidence: a file as `velatura invert --help` describes.",
        ),
    ],
    starts: Annotated[int, typer.Option(min=1, max=100, metavar="N", help="Stacks to descend from.")] = 4,
    output: Output = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, metavar="N", help="Seed of these stacks.")] = 0,
    model: invert.ModelName = None,
    settings: invert.Switches = None,
    as_json: options.Json = False,
) -> None:
    """Find the stack closest to a table of reflectance over angles."""
    # Refuse what cannot work before anything slow begins
    from velatura import inverse

    wanted, name, switches = invert.read(target, model, settings)
    rows = inverse.load_table(table)
    check(output)
    show(inverse.fit_target(rows, wanted, starts, name, seed, **switches), output, as_json)


def check(output: Path | None) -> None:
    """Raises `InvalidInput` unless a material can be written there."""
    from velatura import files

    if output:
        files.check_writable(output, "a material file", invert.ENDINGS)


def show(found: Fit, output: Path | None, as_json: bool) -> None:
    """Write the material, and print it with its error."""
    from velatura.stack import dumps, save

    if output:
        save(found.stack, output)
    if as_json:
        answer = {"stack": found.stack.to_dict(), "error": found.error, "by_angle": found.by_angle}
        print(json.dumps({"model": found.model.name, **answer, "errors": found.errors}, allow_nan=False))
        return
    from rich.console import Console

    Console().print(_table(found))
    invert.say_for_which(found.model)
    print(output if output else dumps(found.stack, "yaml"), end="\n" if output else "")


def _table(found: Fit) -> Any:
    """A row per angle of incidence."""
    from rich.table import Table

    title = f"Error of log(1 + f cos): {found.error:.2g} (from other starts: {_others(found)})"
    table = Table(title=title, title_justify="left")
    for column in ("angle of incidence", "f cos, rms", "error, rms", "relative"):
        table.add_column(column, justify="right")
    for row in found.by_angle:
        cells = (f"{row['theta_i']:g}°", f"{row['wanted']:.4g}", f"{row['error']:.2g}", f"{row['relative']:.2%}")
        table.add_row(*cells)
    return table


def _others(found: Fit) -> str:
    return ", ".join(f"{error:.2g}" for error in found.errors[1:]) or "none"
