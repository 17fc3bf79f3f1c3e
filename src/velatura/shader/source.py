"""What the model's own source calls its values, where somebody is to read them: names, and the titles of blocks."""

from __future__ import annotations

import linecache
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, NamedTuple, Protocol

PACKAGE = Path(__file__).parents[1]
_OURS = tuple(str(PACKAGE / part) for part in ("model", "optics", "tables"))


class Named(Protocol):
    """What can be given a name."""

    hint: str | None


class Place(NamedTuple):
    """The function that a value was made in, and the title of the block around it ("" for none)."""

    function: str
    title: str


NOWHERE = Place("", "")
_naming: ContextVar[bool] = ContextVar("naming", default=False)


def is_read() -> bool:
    """Whether what is recorded now is to be read by people."""
    return _naming.get()


def place() -> Place:
    """The place in the model that runs now; nowhere, if nobody is to read of it."""
    if not is_read():
        return NOWHERE
    function, title = "", ""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        if frame.f_code.co_filename.startswith(_OURS):
            function = function or frame.f_code.co_name
            title = _title(frame.f_code.co_filename, frame.f_lineno)
            if title:
                break
        frame = frame.f_back
    return Place(function, title)


@cache
def _title(file: str, line: int) -> str:
    """The comment above a line, of its own block."""
    lines = linecache.getlines(file)
    depth = _depth(lines[line - 1])
    for text in reversed(lines[:line]):
        if not text.strip() or _depth(text) > depth:
            continue
        if text.lstrip().startswith("# "):
            return text.strip()[2:]
        if text.lstrip().startswith(("def ", "class ")):
            break
        depth = min(depth, _depth(text)) if text.rstrip().endswith(":") else depth
    return ""


def _depth(text: str) -> int:
    return len(text) - len(text.lstrip())


@contextmanager
def naming(symbol: type[Named]) -> Iterator[None]:
    """Gives the symbols that the model makes meanwhile the names of its variables and fields; the first one stays."""
    before = sys.getprofile()

    def look(frame: FrameType, event: str, argument: Any) -> None:
        if event != "return":
            return
        code = frame.f_code
        if code.co_filename.startswith(_OURS) or (code.co_name == "__init__" and code.co_filename == "<string>"):
            held = frame.f_locals
            for name in _named(code):
                _hint(symbol, name, held.get(name))

    sys.setprofile(look)
    outside = _naming.set(True)
    try:
        yield
    finally:
        _naming.reset(outside)
        sys.setprofile(before)


@cache
def _named(code: CodeType) -> tuple[str, ...]:
    """Variables of a function without its arguments; fields of a record."""
    first = 1 if code.co_name == "__init__" else code.co_argcount + code.co_kwonlyargcount
    return tuple(name for name in (*code.co_varnames[first:], *code.co_cellvars) if not name.startswith("_"))


def _hint(symbol: type[Named], name: str, value: Any) -> None:
    if isinstance(value, symbol):
        if value.hint is None:
            value.hint = name
    elif isinstance(value, tuple | list) and 0 < len(value) <= 24:
        parts = "xyz" if isinstance(value, tuple) and len(value) == 3 else range(len(value))
        for part, each in zip(parts, value):
            if isinstance(each, symbol):
                _hint(symbol, f"{name}_{part}", each)
