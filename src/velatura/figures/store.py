"""A folder of figures: of each its numbers, `NAME.json`, and its picture, `NAME.webp`.

The numbers hold a fingerprint of the figure's sources, so that what has been made already is not made again.
"""

from __future__ import annotations

import ast
import hashlib
import json
from pathlib import Path
from typing import Any

from velatura import files
from velatura.figures import Progress, figure, module_of

PACKAGE = "velatura.figures"
SOURCES = Path(__file__).parent


def numbers_of(numbers: dict[str, Any], **more: Any) -> str:
    """The numbers of a figure as JSON, without its pictures."""
    kept = {key: value for key, value in numbers.items() if key != "pictures"}
    return json.dumps(kept | more, allow_nan=False)


def fingerprint(name: str) -> str:
    """A hash of a figure's module, which holds its parameters, and of the modules of this package that it imports."""
    found, waiting = set[str](), {module_of(name)}
    while waiting:
        found.add(module := waiting.pop())
        waiting |= _imported(module) - found
    content = b"".join(_source(module).read_bytes() for module in sorted(found))
    return hashlib.sha256(content).hexdigest()[:16]


def _source(module: str) -> Path:
    return SOURCES / f"{module}.py"


def _imported(module: str) -> set[str]:
    """The modules of this package that one of them imports."""
    found = set()
    for node in ast.walk(ast.parse(_source(module).read_bytes())):
        if isinstance(node, ast.ImportFrom) and node.module == PACKAGE:
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module.removeprefix(f"{PACKAGE}."))
    return {name for name in found if _source(name).is_file()}


def is_made(name: str, folder: Path) -> bool:
    """Whether a folder holds a figure that was made of the present sources."""
    written, picture = folder / f"{name}.json", folder / f"{name}.webp"
    try:
        return picture.is_file() and json.loads(written.read_text())["sources"] == fingerprint(name)
    except (OSError, ValueError, LookupError):
        return False


def make(name: str, folder: Path, progress: Progress | None = None) -> None:
    """Compute a figure, and write its picture, then its numbers, into a folder.

    Raises:
        InvalidInput: an unknown figure, or a folder that cannot be written to.
        VelaturaError: as the figure.
    """
    chosen = figure(name)
    numbers = chosen.compute(progress=progress)
    chosen.draw(numbers, folder / f"{name}.webp")
    with files.whole(folder / f"{name}.json") as unfinished:
        unfinished.write_text(numbers_of(numbers, sources=fingerprint(name)) + "\n")
