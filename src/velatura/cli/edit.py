"""`velatura edit`: the editor in the browser."""

from __future__ import annotations

from typing import Annotated

import typer


def edit(
    material: Annotated[
        str | None, typer.Argument(metavar="M", help="A material file (YAML or JSON), or the name of a preset.")
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="N", help="Port of the server; 0 for any free one.")
    ] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
) -> None:
    """Edit the materials of the working directory in the browser."""
    from velatura.errors import needs

    with needs("editor"):
        from velatura.editor import server
    server.serve(material, port, browser)
