"""`velatura cite`: what to cite for a picture."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer

from velatura.cli import options


class CitationFormat(str, Enum):
    """How entries are printed."""

    bibtex = "bibtex"
    text = "text"


def cite(
    models: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[MODEL]...",
            help=f"{options.MODELS}; reference, the walk; weidlich_wilkie, the baseline. Default: velatura.",
        ),
    ] = None,
    form: Annotated[
        CitationFormat, typer.Option("--format", help="BibTeX, or a line of text for each.")
    ] = CitationFormat.bibtex,
) -> None:
    """Print what to cite for a picture.

    The papers of its models, Velatura itself in its version, and Mitsuba.
    """
    from velatura import citations

    found = citations.entries(models or ()).values()
    print("\n\n".join(found) if form is CitationFormat.bibtex else "\n".join(map(citations.text, found)))
