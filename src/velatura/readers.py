"""Readers of material files of other programs; the package enters them, so that `stack` imports nothing above it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

#: By the ending of the file: the function that gives the stack in FILE or FILE#NAME.
READERS: dict[str, Callable[[str], Any]] = {}
