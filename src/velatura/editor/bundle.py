"""The page in its served form: built from `page/` when the package is built, so that a wheel needs no Node."""

from __future__ import annotations

import sys
from pathlib import Path

from velatura.errors import MissingTool
from velatura.kernel import Component

STATIC = Path(__file__).with_name("static")
SOURCES = Path(__file__).with_name("page")


def require() -> Path:
    """The folder of the page. Raises MissingTool, with the command that builds it, where there is none."""
    found = finding()
    if not found.ok:
        raise MissingTool(f"the editor's page is missing; build it with: {found.mend}")
    return STATIC


def finding() -> Component:
    """Whether the page is installed, as `velatura doctor` reports it."""
    there = all((STATIC / name).is_file() for name in ("index.html", "editor.js", "widget.js"))
    # An installation has no sources, and gets the page with the package
    what = f"--editable {SOURCES.parents[3]}" if SOURCES.is_dir() else "--force-reinstall --no-deps velatura"
    mend = f"{sys.executable} -m pip install {what}"
    return Component("Editor's page", "bundled", True) if there else Component("Editor's page", "missing", False, mend)
