"""`velatura export`: a material for other programs, as a shader, JSON, a scene of Mitsuba, or a script."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from velatura.cli import options
from velatura.errors import InvalidInput
from velatura.exports import FORMATS, check_writable, with_constants
from velatura.exports import export as exported

To = Enum("To", {name: name for name in FORMATS}, type=str)  # type: ignore[misc]
_SHADERS = ", ".join(with_constants())


def export(
    material: options.Material,
    to: Annotated[To, typer.Option("--to", help="The format of the file.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="F", help="The file; default: standard output.")
    ] = None,
    model: options.Model = None,
    constant: Annotated[
        list[str] | None,
        typer.Option(
            "--constant",
            metavar="KEY",
            help=f"For {_SHADERS}: a parameter that never changes (layer0_eta), or all; may be repeated.",
        ),
    ] = None,
    settings: options.Settings = None,
) -> None:
    """Write a material as a shader, JSON, a Mitsuba scene or a script."""
    if output is not None:
        check_writable(output, to.value)
    if constant and not FORMATS[to.value].constants:
        raise InvalidInput(f"--constant: only for --to {_SHADERS}, not for {to.value}")
    stack, switches = options.read(material, settings)
    folder = output.parent if output else None
    made = exported(stack, to.value, options.model_name(model), constant=constant or (), folder=folder, **switches)
    if output is None:
        print(made.text, end="")
        return
    path, *beside = made.save(output)
    print(path if not beside else f"{path}, and its tables {beside[0]}")
