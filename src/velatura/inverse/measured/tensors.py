"""Files of named arrays, the "tensor files" of the RGL database and of Mitsuba."""

from __future__ import annotations

import mmap
import struct
from math import prod
from pathlib import Path

import numpy as np

from velatura import files
from velatura.errors import InvalidInput
from velatura.inverse.lobes.partial_stack import Array

MAGIC = b"tensor_file\0"
LARGEST = 2**30  # bytes; what is not looked at is not read
MOST = 64  # arrays
KINDS = dict(enumerate(("u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8"), start=1))

Arrays = dict[str, Array]


def begins(path: Path) -> bool:
    """Whether a file begins as one of tensors. Raises InvalidInput if it cannot be read."""
    files.check_regular(path)
    try:
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    except OSError as error:
        raise InvalidInput(f"{path}: cannot be read: {files.reason(error)}") from None


def read(path: Path) -> Arrays:
    """The arrays of a file, read from it where they are looked at.

    Raises:
        InvalidInput: it cannot be read, its head ends early, or an array lies outside the file; one line.
    """
    files.check_regular(path)
    try:
        with path.open("rb") as file:
            content = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{path}: cannot be read: {files.reason(error)}") from None
    if len(content) > LARGEST:
        raise InvalidInput(f"{path}: is larger than {LARGEST >> 20} MiB")
    arrays: Arrays = {}
    try:
        if content[: len(MAGIC)] != MAGIC:
            raise ValueError("it does not begin as one")
        (count,), at = struct.unpack_from("<I", content, 14), 18
        if count > MOST:
            raise ValueError(f"more than {MOST} arrays")
        for _ in range(count):
            (length,) = struct.unpack_from("<H", content, at)
            name, at = content[at + 2 : at + 2 + length].decode("ascii"), at + 2 + length
            dimensions, kind, begin = struct.unpack_from("<HBQ", content, at)
            shape = struct.unpack_from(f"<{dimensions}Q", content, at + 11)
            at += 11 + 8 * dimensions
            arrays[name] = np.frombuffer(content, KINDS[kind], prod(shape), begin).reshape(shape)
    except (struct.error, KeyError, OverflowError, ValueError) as error:
        raise InvalidInput(f"{path}: is no file of tensors: its head is broken ({error})") from None
    return arrays
