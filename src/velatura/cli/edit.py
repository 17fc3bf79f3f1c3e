"""`velatura edit`: the editor in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from velatura.cli import options, progress


def edit(
    material: Annotated[
        str | None, typer.Argument(metavar="M", help="A material file (YAML or JSON), or the name of a preset.")
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="N", help="Port of the server; 0 for any free one.")
    ] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
    static: Annotated[
        Path | None,
        typer.Option(
            parser=options.folder,
            metavar="FOLDER",
            help="Write the editor to this folder instead, for any web server; it then needs no Python.",
        ),
    ] = None,
) -> None:
    """Edit the materials of the working directory in the browser."""
    from velatura.errors import InvalidInput, needs

    if static is not None:
        if material is not None:
            raise InvalidInput("--static: takes no material; the page shows all presets, and opens files of its user")
        with needs("editor"):
            from velatura.editor import offline
        with progress.bar(f"Writing {static}") as advance:
            sizes = offline.write(static, advance)
        print(f"The editor is in {static}: {len(sizes)} files, {sum(sizes.values()) / 1e6:.0f} MB", flush=True)
        return
    with needs("editor"):
        from velatura.editor import server
    server.serve(material, port, browser)
