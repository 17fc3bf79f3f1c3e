"""`velatura show`: a material on one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from velatura.cli import options, progress


def show(
    material: options.Material,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="F", help="PNG, WebP, PDF or SVG; default: M-page.png, here."),
    ] = None,
    model: options.Model = None,
    spp: Annotated[int, typer.Option(min=1, max=2**20, metavar="N", help="Samples per pixel of the ball.")] = 64,
    settings: options.Settings = None,
) -> None:
    """Draw a material on one page: layers, ball, lobes.

    A second look at a file: the cross-section has true colours, and the lobes of light at 45 degrees above it.
    """
    stack, switches = options.read(material, settings)
    path = output or Path(f"{Path(material).stem}-page.png")
    from velatura import comparison, overview

    comparison.check_figure(path)
    with progress.bar(f"Drawing {path.name}") as advance:
        overview.show(stack, path, options.model_name(model), spp=spp, progress=advance, **switches)
    print(path)
