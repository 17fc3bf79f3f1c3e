"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from velatura.errors import InvalidInput


def check_writable(path: str | os.PathLike[str], what: str, endings: Sequence[str]) -> Path:
    """The path of a file, once it is sure that it can be written there.

    Args:
        what: the file as a message names it, "a picture".
        endings: that it may have, ".png"; in a message each may be followed by its meaning, ".png (tone-mapped)".

    Raises:
        InvalidInput: another ending, no such folder, a folder in its place, or no permission.
    """
    target = Path(path)
    if target.suffix.lower() not in (ending.split()[0] for ending in endings):
        raise InvalidInput(f"{target}: {what} ends in {' or '.join(endings)}")
    if not target.parent.is_dir():
        raise InvalidInput(f"{target}: there is no folder {target.parent}")
    if target.is_dir():
        raise InvalidInput(f"{target}: is a folder")
    check_folder(target.parent, str(target))
    return target


def check_folder(folder: Path, subject: str) -> None:
    """Raise InvalidInput about `subject` unless a file can be made in the folder."""
    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise InvalidInput(f"{subject}: the folder {folder} is not writable ({error.strerror})") from None


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A path to write to, which takes the place of `path` when all is written, and is removed if that fails."""
    unfinished = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix.lower()}")
    try:
        yield unfinished
        os.replace(unfinished, path)
    finally:
        with contextlib.suppress(OSError):
            unfinished.unlink()
