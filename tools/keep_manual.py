"""Keep the manual that `make docs` has built beside those of other versions.

    python tools/keep_manual.py [FOLDER]

Copies `site/` to `FOLDER/VERSION`, in place of one that is there, and lists all versions in `FOLDER/index.html`, the
newest first. The folder can be hosted as it is, by any web server.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from html import escape
from importlib.metadata import version
from pathlib import Path

from packaging.version import InvalidVersion, Version

ROOT = Path(__file__).parents[1]
SITE = ROOT / "site"
OTHER = ("bench", "blender")  # what else is written there
PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Velatura: manuals</title>
<style>
:root {{ color-scheme: light dark }}
body {{ font: 1rem/1.6 system-ui; max-width: 40rem; margin: 4rem auto; padding: 0 1rem }}
</style>
<h1>Manuals of Velatura</h1>
<ul>
{rows}
</ul>
</html>
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "manual")
    folder = parser.parse_args().folder
    if not (SITE / "index.html").is_file():
        sys.exit("keep_manual: there is no manual in site/: run make docs first")
    keep(SITE, folder, version("velatura"))


def keep(site: Path, folder: Path, name: str) -> None:
    """Copy a manual to `folder/name`, and list all that are there.

    Raises:
        InvalidVersion: the name is no version.
    """
    Version(name)
    target, unfinished = folder / name, folder / f".{name}"
    shutil.rmtree(unfinished, ignore_errors=True)
    shutil.copytree(site, unfinished, ignore=lambda where, _: OTHER if Path(where) == site else ())
    shutil.rmtree(target, ignore_errors=True)
    unfinished.rename(target)
    (folder / "index.html").write_text(listed(folder), encoding="utf-8")
    print(f"keep_manual: {target}; {folder / 'index.html'} lists all versions")


def listed(folder: Path) -> str:
    """The page that lists the manuals of a folder, the newest version first."""
    found = []
    for path in folder.iterdir():
        if (path / "index.html").is_file():
            try:
                found.append((Version(path.name), path.name))
            except InvalidVersion:
                continue
    rows = (
        f'<li><a href="{escape(name)}/index.html">{escape(name)}</a></li>' for _, name in sorted(found, reverse=True)
    )
    return PAGE.format(rows="\n".join(rows))


if __name__ == "__main__":
    main()
