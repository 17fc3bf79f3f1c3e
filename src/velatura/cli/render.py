"""`velatura render`: a picture of a material."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from velatura.cli import options, progress


def render(
    material: options.Material,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="F", help="PNG (tone-mapped) or EXR (linear); default: M, ending in .png, here."
        ),
    ] = None,
    scene: Annotated[
        str,
        typer.Option(metavar="NAME|F", help="ball, sphere, teapot, urn, plane, wedges, lid, or a Mitsuba .xml."),
    ] = "ball",
    env: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|F",
            help="studio, sky, furnace, apartment, city, forest, lobby, sunset, workshop, or an .hdr or .exr file; "
            "default: the scene's own.",
        ),
    ] = None,
    model: options.Bsdf = None,
    spp: Annotated[int, typer.Option(min=1, max=2**20, metavar="N", help="Samples per pixel.")] = 64,
    size: Annotated[str | None, typer.Option(metavar="N|WxH", help="Pixels; default: 512, or the scene's own.")] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, metavar="N", help="Seed of the random numbers.")] = 0,
    view: Annotated[
        str, typer.Option(metavar="NAME", help="How a PNG shows light: soft (highlights), srgb (cut off), agx, aces.")
    ] = "soft",
    settings: options.Settings = None,
) -> None:
    """Render a picture of a material."""
    # Refuse what cannot work before anything slow begins
    pixels = None if size is None else _pixels(size)
    path = output or Path(f"{Path(material).stem}.png")
    stack, switches = options.read(material, settings)
    import velatura
    from velatura import scenes

    scenes.check_writable(path)
    scenes.check_view(view)

    # Render, then write the finished picture in one go
    start = time.perf_counter()
    stage: dict[str, Any] = {"scene": scene, "env": env, "spp": spp, "size": pixels, "seed": seed}
    with progress.bar(f"Rendering {path.name}") as advance:
        image = velatura.render(stack, model=options.model_name(model), progress=advance, **stage, **switches)
    scenes.write_image(image, path, view)
    height, width = image.shape[:2]
    print(f"{path}: {width} x {height} pixels, {spp} samples each, {time.perf_counter() - start:.1f} s")


def _pixels(size: str) -> tuple[int, int]:
    from velatura.scenes.stage import width_and_height

    return width_and_height(size, "--size")
