"""Answers as the files of a static folder hold them."""

from __future__ import annotations

import base64
import gzip
import json
from itertools import accumulate
from typing import Any

import numpy as np

from velatura.editor.messages import array
from velatura.editor.packing import numbered, packed


def read(file: bytes) -> Any:
    return json.loads(gzip.decompress(file))


def numbers(made: dict[str, Any]) -> np.ndarray:
    """The numbers of an array by planes."""
    dtype, length = np.dtype(made["dtype"]), int(np.prod(made["shape"]))
    planes = np.frombuffer(base64.b64decode(made["planes"]), np.uint8).reshape(-1, length)
    whole = np.zeros((dtype.itemsize, length), np.uint8)
    whole[dtype.itemsize - len(planes) :] = planes
    return np.ascontiguousarray(whole.T).view(dtype).reshape(made["shape"])


def test_arrays_keep_sixteen_bits_of_precision_and_whole_numbers_all() -> None:
    rng = np.random.default_rng(1)
    floats = (rng.standard_normal((50, 3)) * 10.0 ** rng.uniform(-30, 30, (50, 3))).astype(np.float32)
    floats[:2] = np.array([[0, 1, -1], [3.4e38, -3.4e38, 1 - 2**-24]])
    made = read(packed({"a": [{"b": array(floats)}], "c": array(np.arange(9) * 10**8, "uint32")}))
    np.testing.assert_allclose(numbers(made["a"][0]["b"]), floats, rtol=2**-16, atol=0)
    np.testing.assert_array_equal(numbers(made["c"]), np.arange(9) * 10**8)


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
