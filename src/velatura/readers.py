"""Readers of material files of other programs; the package enters them, so that `stack` imports nothing above it."""

from __future__ import annotations

TYPE_CHECKING = False  # without `typing`, since the package imports this
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

#: By the ending of the file: the function that gives the stack in FILE or FILE#NAME.
READERS: dict[str, Callable[[str], Any]] = {}
