"""Results that are kept for the next question of the same key, up to a size: those asked for most recently."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from dataclasses import is_dataclass
from threading import Lock
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

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
    """Bytes of all arrays in a tuple, a list or a record, of those that are there more than once counted once."""
    return sum({id(array): array.nbytes for array in _arrays(value)}.values())


def _arrays(value: Any) -> Iterator[NDArray[Any]]:
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple | list):
        for each in value:
            yield from _arrays(each)
    elif is_dataclass(value):
        yield from _arrays([*vars(value).values()])
