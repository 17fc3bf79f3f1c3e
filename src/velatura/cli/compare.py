"""`velatura compare`: models against the truth, as numbers and as one figure."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from velatura.cli import options, progress


def compare(
    material: options.Material,
    models: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME,...",
            help=f"{options.MODELS}; default: all of these. Also weidlich_wilkie, reference, a bake (openpbr, gltf, "
            "gltf-coat, usd, blender-principled, mitsuba-principled), a BSDF plugin of Mitsuba's with its defaults "
            "(principled), or an XML file of one (mine.xml).",
        ),
    ] = None,
    cos: Annotated[
        str, typer.Option(metavar="C,C,...", help="Cosines of the incident directions, in (0, 1].")
    ] = "1,0.7,0.35",
    settings: options.Settings = None,
    paths: Annotated[
        int, typer.Option(min=2, max=2 * 10**7, metavar="N", help="Random walks of the truth for each direction.")
    ] = 3_000_000,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, metavar="N", help="Seed of the random numbers.")] = 0,
    microsurface: Annotated[
        bool | None,
        typer.Option(
            "--microsurface/--no-microsurface",
            help="In the truth, let light scatter many times between microfacets; default: if a model does.",
        ),
    ] = None,
    polarised: Annotated[
        bool,
        typer.Option(
            "--polarised",
            help="Follow polarisation in the truth, and report what leaving it out costs; not with --pictures.",
        ),
    ] = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="F", help="A figure of the results (PNG, WebP, PDF or SVG).")
    ] = None,
    pictures: Annotated[
        bool, typer.Option("--pictures", help="Also render spheres, for their errors and the figure.")
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Compare models with the truth: lobes, albedo, distribution."""
    # Refuse what cannot work before anything slow begins
    cosines = options.cosines(cos)
    stack, switches = options.read(material, settings)
    from velatura import comparison

    if plot:
        comparison.check_figure(plot)

    with progress.bar(f"Comparing {stack.name or material}") as advance:
        found = comparison.compare(
            stack,
            models.split(",") if models is not None else None,
            cosines,
            paths,
            seed,
            microsurface,
            pictures=pictures,
            polarised=polarised,
            progress=advance,
            **switches,
        )
    if plot:
        comparison.save_figure(found, plot)

    if as_json:
        print(json.dumps({**found.to_dict(), "material": stack.name or material}, allow_nan=False))
        return
    options.console().print(*found.as_tables())
