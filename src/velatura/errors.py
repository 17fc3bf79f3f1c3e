"""The errors of Velatura, each with its exit status on the command line.

Every message is one line that a user can act on: it names the file, the layer, the key and what is allowed.
"""

from __future__ import annotations

import contextlib
import operator
import re
import sys
from collections.abc import Iterator
from typing import SupportsIndex

MOST = 2000  # characters of a line


def short(text: str, most: int = MOST) -> str:
    """A text of at most so many characters, without its middle where it is longer."""
    end = most // 3
    return text if len(text) <= most else f"{text[: most - end - 3]}...{text[-end:]}"


def one_line(text: str) -> str:
    """A text without its middle if it is long, and with Python's escapes for line breaks and control characters.

    Those would end or garble its line. Surrogates for bytes of a file's name that are not UTF-8 stay unchanged.
    """
    text = short(text)
    kept = (c if c.isprintable() or "\udc80" <= c <= "\udcff" else c.encode("unicode_escape").decode() for c in text)
    return "".join(kept)


def remark(text: str) -> str:
    """A text as a comment of code holds it, up to the end of its line.

    A backslash or a trigraph at the end of a line would continue it, and other programs know more ends of lines.
    """
    return one_line(re.sub(r"\\|(?<=\?)\?", lambda found: f"\\u{ord(found[0]):04x}", text))


class VelaturaError(Exception):
    """Any failure that Velatura foresees, in one line."""

    exit_status = 1

    def __init__(self, message: str = "") -> None:
        super().__init__(one_line(message))


class InvalidInput(VelaturaError, ValueError):
    """A file, a name or a value that does not mean anything, or lies outside its range."""

    exit_status = 2


class NoSolution(VelaturaError):
    """Valid input for which no stack exists."""

    exit_status = 3


class LawBroken(VelaturaError):
    """A material breaks a law that every BSDF must keep, or a comparison failed."""

    exit_status = 1


class MissingTool(VelaturaError):
    """Something that must be installed is missing or too old; the message holds the command that installs it."""

    exit_status = 1


class VelaturaWarning(UserWarning):
    """A warning in one line."""


class Incomplete(VelaturaWarning):
    """A material of another program of which a stack cannot carry all."""


class OutOfRange(VelaturaWarning):
    """A value that is set through Mitsuba and lies outside its range: the nearest one stands for it."""


class Damaged(VelaturaWarning):
    """A store of a sweep whose files are not as they were written."""


def whole_number(name: str, value: SupportsIndex, least: int = 0) -> int:
    """A count or a seed. Raises InvalidInput unless it is a whole number of at least so much."""
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if number < least or isinstance(value, bool):
        raise InvalidInput(f"{name}: must be a whole number of at least {least}, got {short(repr(value), 60)}")
    return number


@contextlib.contextmanager
def within(place: str, refusal: type[ValueError] = InvalidInput) -> Iterator[None]:
    """Raises InvalidInput for a refusal in the block, which names the place of what is read: `layer 1: depth: ...`."""
    try:
        yield
    except refusal as error:
        raise InvalidInput(f"{place}: {error}") from None


@contextlib.contextmanager
def needs(extra: str) -> Iterator[None]:
    """Raises MissingTool where an import in the block fails since this extra of the package is not installed."""
    try:
        yield
    except ModuleNotFoundError as error:
        mend = f'{sys.executable} -m pip install "velatura[{extra}]"'
        raise MissingTool(f"{error.name} is not installed: run `{mend}`") from None
