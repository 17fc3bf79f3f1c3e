"""`velatura coat`: a material under a coat, with or without changing what is seen of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from velatura.cli import invert, options

if TYPE_CHECKING:
    from rich.table import Table

    from velatura.inverse import Coated


def coat(
    material: options.Material,
    eta: Annotated[float, typer.Option(min=0.1, max=10.0, metavar="N", help="Index of the coat.")] = 1.5,
    alpha: Annotated[float, typer.Option(min=0.0, max=1.0, metavar="A", help="Roughness of the coat.")] = 0.0,
    keep_appearance: Annotated[
        bool, typer.Option("--keep-appearance", help="Change the material below so that its lobes stay as they are.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="F", help="The coated material (YAML or JSON).")
    ] = None,
    model: Annotated[
        str | None, typer.Option("--model", metavar="NAME", help="The named model; else bati2021.")
    ] = None,
    settings: options.Settings = None,
    as_json: options.Json = False,
) -> None:
    """Put a coat on a material, and say how that changes its lobes."""
    # Refuse what cannot work before anything slow begins
    stack, switches = options.read(material, settings)
    from velatura import files, inverse
    from velatura.stack import dumps, save

    if output:
        files.check_writable(output, "a material file", invert.ENDINGS)

    coated = inverse.coat(stack, eta, alpha, keep_appearance, model=model or inverse.MODEL, **switches)
    if output:
        save(coated.stack, output)
    if as_json:
        report = {"stack": coated.stack.to_dict(), "lobes": coated.change(), **_diffuse(coated)}
        print(json.dumps(report, allow_nan=False))
        return
    from rich.console import Console

    Console().print(_table(coated.change(), _diffuse(coated)))
    print(output if output else dumps(coated.stack, "yaml"), end="\n" if output else "")


def _diffuse(coated: Coated) -> dict[str, dict[str, list[float]]]:
    """Energy of a diffuse base, before and after; nothing where there is none."""
    if coated.diffuse is None:
        return {}
    before, after = coated.diffuse
    return {"diffuse": {"energy_before": before.tolist(), "energy_after": after.tolist()}}


def _table(rows: list[dict[str, Any]], diffuse: dict[str, dict[str, list[float]]]) -> Table:
    """A row per interface of the bare material, and one for a diffuse base."""
    from rich.table import Table

    table = Table("lobe", title="At normal incidence, without and with the coat", title_justify="left")
    for column in ("energy", "with coat", "alpha", "with coat"):
        table.add_column(column, justify="right")
    for n, row in enumerate(rows, 1):
        table.add_row(str(n), *(" ".join(f"{x:.4f}" for x in _flat(row[key])) for key in row))
    for name, row in diffuse.items():
        table.add_row(name, *(" ".join(f"{x:.4f}" for x in _flat(row[key])) for key in row), "", "")
    return table


def _flat(values: Any) -> list[float]:
    """Numbers in a line, one where they are all alike."""
    import numpy as np

    numbers = [float(x) for x in np.ravel(values)]
    return numbers[:1] if len(set(numbers)) == 1 else numbers
