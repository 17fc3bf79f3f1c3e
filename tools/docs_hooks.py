"""MkDocs hooks: what the program says of itself goes into the manual, so that the two cannot disagree.

`<!-- parameters -->` becomes the table of a material's parameters, `<!-- help VERB -->` the output of
`velatura VERB --help`.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from typing import Any


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replaces the placeholders of a page."""
    markdown = re.sub(r"<!-- parameters -->", lambda _: _parameters(), markdown)
    return re.sub(r"<!-- help( \w+)? -->", lambda match: _help((match[1] or "").split()), markdown)


def _parameters() -> str:
    from velatura.stack import parameter_table

    return parameter_table()


def _help(verb: list[str]) -> str:
    command = [sys.executable, "-m", "velatura", *verb, "--help"]
    run = subprocess.run(command, check=True, capture_output=True, text=True, env={**os.environ, "COLUMNS": "100"})
    return f"```text\n{run.stdout.rstrip()}\n```"
