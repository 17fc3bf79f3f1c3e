"""Files that are read within a budget, and written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextvars import ContextVar
from errno import EACCES, EINVAL
from pathlib import Path

from velatura.errors import InvalidInput, one_line, short

_TRIAL = bytes(4096)  # written and thrown away, so that a full disk shows itself

#: What may be read at once, by all files and graphs that belong together: elements of XML, values of other texts, nodes
#: of graphs, pixels of images.
LIMITS = {
    "files": 256,
    "bytes": 2**28,
    "elements": 200_000,
    "values": 2_000_000,
    "nodes": 10_000,
    "pixels": 2**28,
}
LAST = 253402300799  # second of the year 9999
SECONDS = 30.0  # of the processor, in which they are read

# Reading -------------------------------------------------------------------------------------------------------------


class Budget:
    """The rest of `LIMITS` and `SECONDS`."""

    def __init__(self) -> None:
        self._left = dict(LIMITS)
        self._end = time.thread_time() + SECONDS

    def spend(self, where: object, what: str, count: int = 1) -> None:
        """Take some of the budget, for the file that is being read.

        Raises:
            InvalidInput: there is not so much left, or no time; one line that begins with `where`.
        """
        self._left[what] -= count
        if self._left[what] < 0:
            raise InvalidInput(f"{where}: holds more than {LIMITS[what]} {what}, with all that it is read with")
        if time.thread_time() > self._end:
            raise InvalidInput(f"{where}: takes longer than {SECONDS:g} s to read, with all that it is read with")


_current: ContextVar[Budget | None] = ContextVar("budget", default=None)


@contextlib.contextmanager
def budget() -> Iterator[Budget]:
    """The budget of what is read in the block, or in a function that this decorates: that around it, or a new one."""
    left = _current.get() or Budget()
    token = _current.set(left)
    try:
        yield left
    finally:
        _current.reset(token)


def content(path: Path, largest: int = LIMITS["bytes"]) -> bytes:
    """The content of a file.

    Raises:
        InvalidInput: it cannot be read, is no regular file, larger than `largest` bytes, or beyond the budget; one line
            that begins with the path.
    """
    with budget() as left:
        left.spend(path, "files")
        try:
            check_regular(path)  # since opening a pipe or a device may wait, or do something
            with open(path, "rb", opener=_at_once) as file:
                data = file.read(largest + 1) or b""
        except (OSError, ValueError) as error:
            if isinstance(error, InvalidInput):
                raise
            raise InvalidInput(f"{path}: cannot be read: {reason(error)}") from None
        if len(data) > largest:
            raise InvalidInput(f"{path}: is larger than {_size(largest)}")
        left.spend(path, "bytes", len(data))
    return data


def _at_once(path: str, flags: int) -> int:
    """Open a file without waiting, where the system knows of that."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def text_of(path: Path, largest: int = LIMITS["bytes"]) -> str:
    """The content of a file of UTF-8, with or without a mark of its order of bytes.

    Raises:
        InvalidInput: as `content`, or it is none.
    """
    return decoded(content(path, largest), path)


def decoded(data: bytes, where: object) -> str:
    """UTF-8 as text. Raises InvalidInput, in one line that begins with `where`, if it is none."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput(f"{where}: is not UTF-8 text (byte {error.start})") from None


def check_regular(path: Path) -> None:
    """Raise InvalidInput unless there is a file of that name, and no folder, pipe or device."""
    try:
        mode = os.stat(path).st_mode
    except FileNotFoundError:
        raise InvalidInput(f"{path}: file not found") from None
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{path}: cannot be read: {reason(error)}") from None
    if not stat.S_ISREG(mode):
        raise InvalidInput(f"{path}: cannot be read: is {'a directory' if stat.S_ISDIR(mode) else 'no regular file'}")


def number(text: str) -> float:
    """A decimal number as all programs write it: in ASCII, without underscores. Raises ValueError."""
    if not _NUMBER.fullmatch(text.strip()):
        raise ValueError(f"{text!r} is no number")
    return float(text)


_NUMBER = re.compile(r"[-+]?(([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?|inf|nan)", re.IGNORECASE)


def source_date() -> int | None:
    """Seconds since 1970 of the environment's SOURCE_DATE_EPOCH, of which all that is written has its date.

    Raises:
        InvalidInput: it is no date.
    """
    given = os.environ.get("SOURCE_DATE_EPOCH")
    if given and not (re.fullmatch("[0-9]{1,12}", given) and int(given) <= LAST):
        raise InvalidInput(
            f"SOURCE_DATE_EPOCH: must be whole seconds since 1970, 0 to {LAST}, got {one_line(short(given, 40))!r}"
        )
    return int(given) if given else None


def _size(count: int) -> str:
    return f"{count >> 20} MiB" if count >= 2**20 else f"{count >> 10} KiB"


# Writing -------------------------------------------------------------------------------------------------------------


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


def relative(path: str | Path, folder: Path) -> str:
    """The path of a file from a folder, with forward slashes; unchanged where none leads there, as to another drive."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:
        return Path(path).as_posix()


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
