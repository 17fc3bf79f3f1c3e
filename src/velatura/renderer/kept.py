"""Results that are kept for the next question of the same key, up to a size: those asked for most recently."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import is_dataclass
from threading import Lock
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")


class Kept:
    """Results up to a number of bytes, of their arrays. Threads may share it; two that miss at once both make one."""

    def __init__(self, most: int) -> None:
        self._most, self._size = most, 0
        self._found: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()
        self._lock = Lock()

    def once(self, key: Hashable, make: Callable[[], T]) -> T:
        """The result of that key, which is made if it is not kept."""
        with self._lock:
            if key in self._found:
                self._found.move_to_end(key)
                result: T = self._found[key][0]
                return result
        made = make()
        size = _size(made)
        with self._lock:
            if key not in self._found:
                self._found[key] = made, size
                self._size += size
            while self._size > self._most and len(self._found) > 1:
                _, (_, freed) = self._found.popitem(last=False)
                self._size -= freed
        return made

    def clear(self) -> None:
        """Forget all of them."""
        with self._lock:
            self._found.clear()
            self._size = 0


def _size(value: Any) -> int:
    """Bytes of all arrays in a tuple, a list or a record."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, tuple | list):
        return sum(map(_size, value))
    return sum(map(_size, vars(value).values())) if is_dataclass(value) else 0
