"""Answers as the files of a static folder hold them."""

from __future__ import annotations

import gzip
import json
from itertools import accumulate
from typing import Any

import numpy as np

from velatura.editor.messages import array
from velatura.editor.packing import numbered, packed


def read(file: bytes) -> Any:
    return json.loads(gzip.decompress(file).partition(b"\n")[0])


def numbers(file: bytes, made: dict[str, Any]) -> np.ndarray:
    """The numbers of an array of a file."""
    dtype, length = np.dtype(made["dtype"]), int(np.prod(made["shape"]))
    (begin, size), step = made["planes"], made["step"]
    kept = gzip.decompress(file).partition(b"\n")[2][begin : begin + size]
    planes = np.frombuffer(kept, np.uint8).reshape(-1, length)
    whole = np.zeros((dtype.itemsize, length), np.uint8)
    whole[dtype.itemsize - len(planes) :] = planes
    found = np.ascontiguousarray(whole.T).view(f"u{dtype.itemsize}").ravel()
    for k in range(step, length if step else 0):
        found[k : k + 1] += found[k - step : k - step + 1]
    return found.view(dtype).reshape(made["shape"])


def test_arrays_keep_sixteen_bits_of_precision_and_whole_numbers_all() -> None:
    rng = np.random.default_rng(1)
    floats = (rng.standard_normal((50, 3)) * 10.0 ** rng.uniform(-30, 30, (50, 3))).astype(np.float32)
    floats[:2] = np.array([[0, 1, -1], [3.4e38, -3.4e38, 1 - 2**-24]])
    whole = np.arange(9) * 10**8, np.cumsum(rng.integers(-99, 99, (400, 3)), axis=0)
    file = packed({"a": [{"b": array(floats)}], "c": array(whole[0], "uint32"), "d": array(whole[1], "int16")})
    made = read(file)
    np.testing.assert_allclose(numbers(file, made["a"][0]["b"]), floats, rtol=2**-16, atol=0)
    for name, wanted in zip("cd", whole):
        np.testing.assert_array_equal(numbers(file, made[name]), wanted)
    assert made["d"]["step"] == 3


def test_steps_name_others_by_how_far_back_they_are() -> None:
    """Expected: the second sum of a pattern is written as the first; inputs, constants and details stay."""
    steps = [["add", 0, 2], ["component", 1, 3], ["add", 0, 4], ["component", 1, 5]]
    tape = {"inputs": ["a", "b"], "constants": [1.0], "steps": steps, "outputs": [6], "tables": []}
    made = read(packed({"baked": tape}))["baked"]
    assert made == {**tape, "steps": [["add", 0, 2], ["component", 1, -1], ["add", 0, -1], ["component", 1, -1]]}


def test_lines_of_texts_are_numbered_together() -> None:
    known: dict[str, int] = {}
    texts = ["a\nb\nc", "b\nc\n\na"]
    found = [numbered(text, known) for text in texts]
    assert found[0] == [0, 1, 1]
    assert ["\n".join(list(known)[k] for k in accumulate(each)) for each in found] == texts
