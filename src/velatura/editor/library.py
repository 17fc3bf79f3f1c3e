"""Tags and small pictures of the materials of a folder, which the library of the page keeps beside them."""

from __future__ import annotations

import contextlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from velatura.errors import InvalidInput
from velatura.files import whole
from velatura.stack.schema import Parameter, show

FOLDER = ".velatura-library"  # in which each material has a file of its own
LARGEST = 2**17  # bytes of such a file
TAGS = 16  # of a material
LETTERS = 32  # of a tag
JPEG = "/9j/"  # how one begins, in base64
PICTURE = 2**16  # characters of one


@dataclass(frozen=True)
class Tags(Parameter):
    """Words by which a material is found, each once."""

    what: ClassVar[str] = f"a list of {TAGS} tags at most, each of 1 to {LETTERS} letters, without commas"

    def check(self, value: Any) -> list[str]:
        if not isinstance(value, list) or len(value) > TAGS:
            raise self.refuse(value)
        for tag in value:
            if not isinstance(tag, str) or not 1 <= len(tag) <= LETTERS or not tag.isprintable() or "," in tag:
                raise self.refuse(tag)
        return list(dict.fromkeys(value))


@dataclass(frozen=True)
class Thumbnail(Parameter):
    """A small JPEG in base64."""

    what: ClassVar[str] = f"a JPEG in base64, of {PICTURE} characters at most"

    def check(self, value: Any) -> str:
        if not isinstance(value, str) or not value.startswith(JPEG) or len(value) > PICTURE:
            raise ValueError(f"must be {self.what}, got {show(value)}")
        return value


#: What is kept of a material, by its keys.
KEYS: dict[str, Parameter] = {"tags": Tags("of a material"), "thumbnail": Thumbnail("of a material")}


def kept(folder: Path, name: str) -> dict[str, Any]:
    """The `tags` and the `thumbnail` of a file, as far as there are any; what is no such thing is left out."""
    path = _place(folder, name)
    with contextlib.suppress(OSError, ValueError, RecursionError):
        if path.stat().st_size <= LARGEST and isinstance(found := json.loads(path.read_text("utf-8")), dict):
            return {key: value for key, value in found.items() if _is_valid(key, value)}
    return {}


def keep(folder: Path, name: str, **changes: Any) -> None:
    """Keep other tags, or another thumbnail, of a file. Raises InvalidInput where it cannot be written."""
    text = json.dumps({**kept(folder, name), **changes}, ensure_ascii=False)
    try:
        (folder / FOLDER).mkdir(exist_ok=True)
    except OSError as error:
        raise InvalidInput(f"{FOLDER}: cannot be made in the folder ({error.strerror})") from None
    with whole(Path(os.path.relpath(_place(folder, name)))) as unfinished:
        unfinished.write_text(text, "utf-8")


def move(folder: Path, name: str, target: str) -> None:
    """Keep of a file under another name what is kept of it; of none there is nothing to keep."""
    with contextlib.suppress(OSError):
        os.replace(_place(folder, name), _place(folder, target))


def _place(folder: Path, name: str) -> Path:
    return folder / FOLDER / f"{name}.json"


def _is_valid(key: str, value: Any) -> bool:
    try:
        KEYS[key].check(value)
    except (KeyError, ValueError):
        return False
    return True
