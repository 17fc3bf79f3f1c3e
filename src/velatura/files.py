"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator, Sequence
from errno import EACCES, EINVAL
from pathlib import Path

from velatura.errors import InvalidInput

_TRIAL = bytes(4096)  # written and thrown away, so that a full disk shows itself


def check_writable(path: str | os.PathLike[str], what: str, endings: Sequence[str]) -> Path:
    """The path of a file, after a check that it can be written there.

    Args:
        what: the file as a message names it, "a picture".
        endings: that it may have, ".png"; in a message each may be followed by its meaning, ".png (tone-mapped)".

    Raises:
        InvalidInput: another ending, no such folder, a folder in its place, no permission, a full disk, a name that is
            too long.
    """
    target = Path(path)
    if target.suffix.lower() not in (ending.split()[0] for ending in endings):
        raise InvalidInput(f"{target}: {what} ends in {' or '.join(endings)}")
    if not os.path.isdir(target.parent):
        raise InvalidInput(f"{target}: there is no folder {target.parent}")
    if os.path.isdir(target):
        raise InvalidInput(f"{target}: is a folder")
    try:
        place, existing = _place(target)
    except OSError as error:
        raise _unwritable(target, error) from None
    if existing is None or stat.S_ISREG(existing):
        check_folder(place.parent, str(target))
    return target


def make_folder(folder: Path) -> None:
    """Make a folder, and those above it, where they are missing.

    Raises:
        InvalidInput: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput(f"{folder}: the folder cannot be made: {reason(error)}") from None


def check_folder(folder: Path, subject: str) -> None:
    """Raise InvalidInput about `subject` unless a file can be made in the folder."""
    try:
        with tempfile.TemporaryFile(dir=folder) as trial:
            trial.write(_TRIAL)
            trial.flush()
    except OSError as error:
        raise InvalidInput(f"{subject}: the folder {folder} is not writable ({reason(error)})") from None


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A temporary path to write to; its content replaces `path` at the end of the block, unless the block fails.

    A link stays a link, to a file that keeps its mode. A file without permission to write is not replaced, and neither
    is a device or a pipe, into which the finished file is copied.

    Raises:
        InvalidInput: the file cannot be written; also in place of an OSError in the block.
    """
    try:
        place, existing = _place(path)
        replaced = existing is None or stat.S_ISREG(existing)
        # A folder of its own has a name that is free and not to be foreseen, and a file in it gets the usual mode
        with tempfile.TemporaryDirectory(
            prefix=".velatura-", dir=place.parent if replaced else None, ignore_cleanup_errors=True
        ) as folder:
            unfinished = Path(folder, f"unfinished{path.suffix.lower()}")
            yield unfinished
            if not replaced:
                with unfinished.open("rb") as source, place.open("wb") as sink:
                    shutil.copyfileobj(source, sink)
                return
            if existing is not None:
                unfinished.chmod(stat.S_IMODE(existing))
            os.replace(unfinished, place)
    except OSError as error:
        raise _unwritable(path, error) from None


def reason(error: Exception) -> str:
    """The message of a system error, as the end of a line."""
    return (getattr(error, "strerror", None) or str(error)).lower()


def _place(path: Path) -> tuple[Path, int | None]:
    """The path to write to, with links followed, and the type and mode of an existing file.

    Raises:
        OSError: it cannot be looked at, or is a file without permission to write.
    """
    try:
        followed = Path(os.path.realpath(path)) if os.path.islink(path) else path
        existing = os.stat(path).st_mode
    except FileNotFoundError:
        return followed, None
    except ValueError as error:  # a null byte
        raise OSError(EINVAL, str(error)) from None
    if not existing & 0o222 or not os.access(path, os.W_OK):
        raise PermissionError(EACCES, "is read-only")
    # What stands behind a device's or a pipe's name may have no path of its own
    return followed if stat.S_ISREG(existing) else path, existing


def _unwritable(path: Path, error: Exception) -> InvalidInput:
    return InvalidInput(f"{path}: cannot be written: {reason(error)}")
