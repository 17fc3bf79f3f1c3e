"""`velatura paint`: concentrations of pigments for a wished colour."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from velatura.cli import invert, options
from velatura.errors import InvalidInput
from velatura.files import number

if TYPE_CHECKING:
    from velatura.stack import Spectrum


def paint(
    material: options.Material,
    colour: Annotated[
        str | None,
        typer.Option(metavar="COLOUR", help="#rrggbb of sRGB, or linear r,g,b in 0 to 1."),
    ] = None,
    reflectance: Annotated[
        str | None, typer.Option(metavar="FILE", help="In place of it: a table of wavelength (nm) and reflectance.")
    ] = None,
    most: Annotated[float, typer.Option(min=1e-6, max=1e6, metavar="C", help="Bound of each concentration.")] = 1.0,
    total: Annotated[
        float | None, typer.Option(min=1e-6, max=1e6, metavar="C", help="Sum of them; free by default.")
    ] = None,
    specular: Annotated[
        bool, typer.Option("--specular/--no-specular", help="Whether the wish includes what the surface reflects.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="F", help="The material (YAML or JSON).")
    ] = None,
    settings: options.Settings = None,
    as_json: options.Json = False,
) -> None:
    """Choose concentrations of pigments for a wished colour.

    All else of the material stays as it is. Light is followed through all layers at every wavelength of the pigments'
    spectra. Of a colour that no mixture has, the nearest is taken, and its CIE 1976 difference reported.
    """
    # Refuse what cannot work before anything slow begins
    stack, switches = options.read(material, settings)
    if switches:
        raise InvalidInput(f"--set {next(iter(switches))}: is a switch of models, and paints have none")
    from velatura import files, inverse
    from velatura.stack import dumps, save

    wish = _wish(colour, reflectance)
    if output:
        files.check_writable(output, "a material file", invert.ENDINGS)
    found = inverse.paint(stack, wish, most, total, specular)
    if output:
        save(found.stack, output)
    if as_json:
        print(json.dumps(found.to_dict(), allow_nan=False))
        return
    for table in found.as_tables():
        options.console().print(table)
    print(output if output else dumps(found.stack, "yaml"), end="\n" if output else "")


def _wish(colour: str | None, reflectance: str | None) -> Sequence[float] | Spectrum:
    if (colour is None) == (reflectance is None):
        raise InvalidInput("--colour: write --colour or --reflectance, one of them")
    if reflectance is not None:
        from velatura.stack import Spectrum

        return Spectrum(spectrum=reflectance)
    assert colour is not None
    if re.fullmatch("#[0-9a-fA-F]{6}", colour):
        import numpy as np

        from velatura.programs.values import linear

        linear_rgb: list[float] = linear(np.array([*bytes.fromhex(colour[1:])]) / 255).tolist()
        return linear_rgb
    try:
        return [number(part) for part in colour.split(",")]
    except ValueError:
        raise InvalidInput(
            f"--colour {colour}: needs #rrggbb, or three numbers in 0 to 1, separated by commas"
        ) from None
