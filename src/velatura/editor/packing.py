"""Answers as the files of a static folder hold them: gzip, JSON inside, with what repeats brought together.

`page/packing.js` reads them.

Arrays lie by planes, the bytes of the same place of all numbers one after another, and floats without their last byte.
Steps of tapes name those before them by how far back they are.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

ARRAY = {"dtype", "shape", "data"}
TAPE = {"inputs", "constants", "steps", "outputs"}


def packed(answer: Any) -> bytes:
    """The file of an answer."""
    return gzip.compress(json.dumps(_brought(answer), allow_nan=False, separators=(",", ":")).encode(), mtime=0)


def numbered(text: str, numbers: dict[str, int]) -> list[int]:
    """The lines of a text by number, each as its distance from the one before; new lines are added to `numbers`."""
    found = [numbers.setdefault(line, len(numbers)) for line in text.split("\n")]
    return [after - before for before, after in zip([0, *found], found)]


def _brought(value: Any) -> Any:
    if isinstance(value, Mapping):
        if value.keys() == ARRAY:
            return _by_planes(value)
        fields = {key: _brought(each) for key, each in value.items()}
        return _relative(fields) if value.keys() >= TAPE else fields
    return [_brought(each) for each in value] if isinstance(value, list | tuple) else value


def _by_planes(array: Mapping[str, Any]) -> dict[str, Any]:
    """An array by planes, from the last byte that is kept: floats have 16 bits of precision, and none below."""
    dtype = np.dtype(array["dtype"])
    whole = np.frombuffer(base64.b64decode(array["data"]), dtype)
    first = 0
    if dtype == np.float32:
        bits = whole.view(np.uint32)
        whole, first = np.where(np.abs(whole) < np.float32(3e38), bits + np.uint32(0x80), bits), 1
    planes = whole.view(np.uint8).reshape(-1, dtype.itemsize).T[first:]
    data = base64.b64encode(np.ascontiguousarray(planes).tobytes()).decode()
    return {"dtype": array["dtype"], "shape": array["shape"], "planes": data}


def _relative(tape: dict[str, Any]) -> dict[str, Any]:
    """A tape whose steps name others by negative numbers, and what is given as before."""
    first = len(tape["inputs"]) + len(tape["constants"])

    def step(k: int, entries: list[Any]) -> list[Any]:
        return [x - first - k if isinstance(x, int) and first <= x < first + k else x for x in entries]

    return {**tape, "steps": [step(k, entries) for k, entries in enumerate(tape["steps"])]}
