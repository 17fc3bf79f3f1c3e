"""`velatura pigment`: a pigment's K and S of measured reflectances over black and over white."""

from __future__ import annotations

import json
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from velatura.cli import options

if TYPE_CHECKING:
    from velatura.inverse import PigmentFit


def pigment(
    measured: Annotated[
        str,
        typer.Argument(
            metavar="MEASURED",
            help="CSV of a film's reflectances in 0 to 1: wavelength_nm,black,white, over a black and a white ground.",
        ),
    ],
    depth: Annotated[
        float, typer.Option(min=1e-6, max=1e6, metavar="D", help="Thickness of the film; K and S are per its unit.")
    ],
    white: Annotated[float, typer.Option(min=0.0, max=1.0, metavar="W", help="Albedo of the white ground.")],
    black: Annotated[float, typer.Option(min=0.0, max=1.0, metavar="B", help="Albedo of the black ground.")] = 0.0,
    eta: Annotated[float, typer.Option(min=1.0, max=10.0, metavar="N", help="Index of the film's binder.")] = 1.5,
    alpha: Annotated[float, typer.Option(min=0.0, max=1.0, metavar="A", help="Roughness of its surface.")] = 0.0,
    g: Annotated[float, typer.Option(min=-0.99, max=0.99, metavar="G", help="Asymmetry of the scattering.")] = 0.0,
    specular: Annotated[
        bool,
        typer.Option(
            "--specular/--no-specular", help="Whether the readings include what the surface reflects (SPIN, SPEX)."
        ),
    ] = True,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="F", help="The pigment, as a material names it (CSV).")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Find K and S of a pigment from its reflectances.

    They are those of a film of it over black and over white. Light is followed through surface, film and ground as an
    instrument with an integrating sphere sees it (di:8); Kubelka and Munk's formulas are the first guess. Reports
    standard errors for one of .001 in the readings: S of a film that hides its ground is open.
    """
    # Refuse what cannot work before anything slow begins
    from velatura import files, inverse
    from velatura.stack import Interface

    nm, over_black, over_white = inverse.load_reflectances(measured)
    if output:
        files.check_writable(output, "a file of a pigment", (".csv",))
    surface = Interface(eta=eta, alpha=alpha)
    found = inverse.fit_pigment(nm, over_black, over_white, depth, black, white, surface, g, specular)
    if output:
        found.save(output, f"K and S of {Path(measured).name}, of a film of {depth:g} under an index of {eta:g}")
    if as_json:
        print(json.dumps(_answer(found), allow_nan=False))
        return
    for table in found.brief():
        options.console().print(table)
    print(f"Reflectances are met within {abs(found.error).max():.2g}")
    if output:
        print(output)


def _answer(found: PigmentFit) -> dict[str, Any]:
    spread = [[x if x < inf else None for x in each] for each in found.spread.tolist()]
    return {
        "wavelength_nm": found.wavelengths_nm.tolist(),
        "K": found.K.tolist(),
        "S": found.S.tolist(),
        "error": found.error.tolist(),
        "standard_error": {"K": spread[0], "S": spread[1]},
    }
