"""Paths in materials; and images that no file of the user's holds, in a folder of this process until they are saved."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from velatura.errors import InvalidInput
from velatura.files import content, whole
from velatura.stack import substances
from velatura.stack.stack import Stack

KEYS = ("texture", "spectrum", "table", "refractiveindex", "pigment")  # of paths


def rewritten(node: Any, rewrite: Callable[[str], str]) -> Any:
    """A copy of parsed values in which the path of every texture and table is rewritten."""
    if isinstance(node, dict):
        return {
            key: rewrite(value) if _is_path(key, value) else rewritten(value, rewrite) for key, value in node.items()
        }
    return [rewritten(entry, rewrite) for entry in node] if isinstance(node, list) else node


def _is_path(key: object, value: object) -> bool:
    return key in KEYS and isinstance(value, str) and (key != "refractiveindex" or substances.is_path(value))


def hold(data: bytes, name: str, ending: str) -> Path:
    """The file of an image in memory, removed when the process ends.

    Its name is the letters and digits of `name`, and a digest of the data.
    """
    plain = re.sub(r"[^A-Za-z0-9]+", "-", name)[:40].strip("-") or "image"
    path = _folder() / f"{plain}-{hashlib.sha256(data).hexdigest()[:12]}{ending}"
    if not path.exists():
        with whole(path) as unfinished:
            unfinished.write_bytes(data)
    return path


def held(stack: Stack) -> list[str]:
    """The paths of the images of a material that `hold` has made."""
    found: list[str] = []
    rewritten(stack.to_dict(), lambda path: found.append(path) or path)  # type: ignore[func-returns-value]
    return [path for path in dict.fromkeys(found) if Path(path).parent == _folder()]


@contextlib.contextmanager
def beside(stack: Stack, folder: Path) -> Iterator[Stack]:
    """A material whose held images have been written into a folder; they are removed again if the block fails.

    Raises:
        InvalidInput: an image cannot be written, or another file has its name.
    """
    made: list[Path] = []
    places = {path: folder.resolve() / Path(path).name for path in held(stack)}
    try:
        for path, place in places.items():
            data = Path(path).read_bytes()
            if not os.path.lexists(place):
                with whole(place) as unfinished:
                    unfinished.write_bytes(data)
                made.append(place)
            elif content(place) != data:
                raise InvalidInput(f"{place}: is another file than the image of that name, and stays")
        moved = rewritten(stack.to_dict(), lambda path: str(places.get(path, path)))
        yield Stack.from_dict(moved) if places else stack
    except BaseException:
        for place in made:
            place.unlink(missing_ok=True)
        raise


@functools.cache
def _folder() -> Path:
    """A folder that is removed when the process ends."""
    return Path(os.path.realpath(_temporary().name))


@functools.cache
def _temporary() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="velatura-images-", ignore_cleanup_errors=True)
