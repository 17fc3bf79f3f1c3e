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
    used: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[MODEL|PAGE]...",
            help=f"{options.MODELS}; reference, the walk; weidlich_wilkie, the baseline; or a page of "
            "refractiveindex.info, as main/Au/Johnson. Default: velatura.",
        ),
    ] = None,
    form: Annotated[
        CitationFormat, typer.Option("--format", help="BibTeX, or a line of text for each.")
    ] = CitationFormat.bibtex,
) -> None:
    """Print what to cite for a picture.

    The papers of its models, the sources of its indices, Velatura itself in its version, and Mitsuba.
    """
    from velatura import citations

    found = citations.entries(used or ()).values()
    print("\n\n".join(found) if form is CitationFormat.bibtex else "\n".join(map(citations.text, found)))
