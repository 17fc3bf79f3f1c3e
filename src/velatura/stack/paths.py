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
from typing import Any, TypeVar

from velatura.errors import InvalidInput
from velatura.files import content, whole
from velatura.stack import substances
from velatura.stack.schema import Record

_PRESETS = Path(os.path.realpath(__file__)).parent / "presets"

M = TypeVar("M", bound=Record)  # a material

KEYS = ("texture", "spectrum", "table", "refractiveindex", "pigment", "material")  # of paths


def rewritten(node: Any, rewrite: Callable[[str], str]) -> Any:
    """A copy of parsed values in which the path of every texture, table and file is rewritten."""
    if isinstance(node, dict):
        return {
            key: rewrite(value) if _is_path(key, value) else rewritten(value, rewrite) for key, value in node.items()
        }
    return [rewritten(entry, rewrite) for entry in node] if isinstance(node, list) else node


def _is_path(key: object, value: object) -> bool:
    if key not in KEYS or not isinstance(value, str):
        return False
    if key == "material":
        return not is_preset(value)
    return key != "refractiveindex" or substances.is_path(value)


def is_preset(material: str) -> bool:
    """Whether a material is called by the name of a preset, a bare word without an ending."""
    return not Path(material).suffix and Path(material).parent == Path()


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


def is_of_presets(path: str | Path) -> bool:
    """Whether a file lies beside the presets of the package."""
    try:
        return Path(os.path.realpath(path)).parent == _PRESETS
    except ValueError:  # no path at all, as with a null byte
        return False


def held(material: Record, presets: bool = False) -> list[str]:
    """The paths of the images of a material that `hold` has made, and of those that come with the `presets`."""
    found: list[str] = []
    rewritten(material.to_dict(), lambda path: found.append(path) or path)  # type: ignore[func-returns-value]
    return [
        path for path in dict.fromkeys(found) if Path(path).parent == _folder() or (presets and is_of_presets(path))
    ]


@contextlib.contextmanager
def beside(material: M, folder: Path, presets: bool = False) -> Iterator[M]:
    """A material whose held images, and those that come with the `presets`, have been written into a folder; they are
    removed again if the block fails.

    Raises:
        InvalidInput: an image cannot be written, or another file has its name.
    """
    made: list[Path] = []
    places = {path: folder.resolve() / Path(path).name for path in held(material, presets)}
    try:
        for path, place in places.items():
            data = Path(path).read_bytes()
            if not os.path.lexists(place):
                with whole(place) as unfinished:
                    unfinished.write_bytes(data)
                made.append(place)
            elif content(place) != data:
                raise InvalidInput(f"{place}: is another file than the image of that name, and stays")
        moved = rewritten(material.to_dict(), lambda path: str(places.get(path, path)))
        yield type(material).from_dict(moved) if places else material
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
