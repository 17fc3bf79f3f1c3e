"""Answers as the files of a static folder hold them: gzip, JSON inside, with what repeats brought together.

`page/packing.js` reads them.

Arrays follow the JSON and a line break. They lie by planes, the bytes of the same place of all numbers one after
another, floats without their last byte, and numbers as differences from others before them where that is shorter. Steps
of tapes name those before them by how far back they are.
"""

from __future__ import annotations

import base64
import gzip
import json
import zlib
from collections.abc import Mapping
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

ARRAY = {"dtype", "shape", "data"}
TAPE = {"inputs", "constants", "steps", "outputs"}
UNSIGNED = {1: np.uint8, 2: np.uint16, 4: np.uint32}  # by the bytes of a number


def packed(answer: Any) -> bytes:
    """The file of an answer."""
    planes = bytearray()
    text = json.dumps(_brought(answer, planes), allow_nan=False, separators=(",", ":")).encode()
    return gzip.compress(text + b"\n" + planes if planes else text, mtime=0)


def numbered(text: str, numbers: dict[str, int]) -> list[int]:
    """The lines of a text by number, each as its distance from the one before; new lines are added to `numbers`."""
    found = [numbers.setdefault(line, len(numbers)) for line in text.split("\n")]
    return [after - before for before, after in zip([0, *found], found)]


def _brought(value: Any, planes: bytearray) -> Any:
    if isinstance(value, Mapping):
        if value.keys() == ARRAY:
            return _by_planes(value, planes)
        fields = {key: _brought(each, planes) for key, each in value.items()}
        return _relative(fields) if value.keys() >= TAPE else fields
    return [_brought(each, planes) for each in value] if isinstance(value, list | tuple) else value


def _by_planes(array: Mapping[str, Any], planes: bytearray) -> dict[str, Any]:
    """An array whose planes lie from a byte on, over so many bytes, from the last place that is kept: floats have 16
    bits of precision, and none below. Each number is the difference from the one so many `steps` before; 0 for none."""
    dtype, shape = np.dtype(array["dtype"]), array["shape"]
    whole = np.frombuffer(base64.b64decode(array["data"]), dtype)
    first = 0
    if dtype == np.float32:
        bits = whole.view(np.uint32)
        whole, first = (
            np.where(np.abs(whole) < np.float32(3e38), bits + np.uint32(0x80), bits) & np.uint32(0xFFFFFF00),
            1,
        )
    steps = [0]
    if dtype.itemsize in UNSIGNED:
        whole = whole.view(UNSIGNED[dtype.itemsize])
        steps += sorted({prod(shape[k:]) for k in range(1, len(shape) + 1)})
    made = [(_planes(whole, step, first), step) for step in steps if step < max(whole.size, 1)]
    data, step = min(made, key=lambda each: len(zlib.compress(each[0], 1)))
    begin = len(planes)
    planes += data
    return {"dtype": array["dtype"], "shape": shape, "planes": [begin, len(data)], "step": step}


def _planes(whole: NDArray[Any], step: int, first: int) -> bytes:
    if step:
        whole = whole - np.concatenate([np.zeros(step, whole.dtype), whole[:-step]])
    return np.ascontiguousarray(whole.view(np.uint8).reshape(-1, whole.itemsize).T[first:]).tobytes()


def _relative(tape: dict[str, Any]) -> dict[str, Any]:
    """A tape whose steps name others by negative numbers, and what is given as before."""
    first = len(tape["inputs"]) + len(tape["constants"])

    def step(k: int, entries: list[Any]) -> list[Any]:
        return [x - first - k if isinstance(x, int) and first <= x < first + k else x for x in entries]

    return {**tape, "steps": [step(k, entries) for k, entries in enumerate(tape["steps"])]}
