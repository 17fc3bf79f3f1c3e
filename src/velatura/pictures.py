"""Pictures without Mitsuba: their size by the head of a file, before it is decoded into as much memory as the file asks
for, and PNG of 8 bits."""

from __future__ import annotations

import re
import struct
import zlib
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from velatura import files
from velatura.errors import InvalidInput

LARGEST = 2**27  # pixels of one picture: 16384 x 8192

_PNG = b"\x89PNG\r\n\x1a\n"
_JPEG = b"\xff\xd8"
_EXR = b"\x76\x2f\x31\x01"
_MULTIPART = 0x1000  # flag of OpenEXR
_MOST = 10_000  # segments, parts or attributes of a file
_NETPBM = re.compile(rb"P[56Ff]\s+(?:#[^\n]*\n\s*)*(\d{1,9})\s+(?:#[^\n]*\n\s*)*(\d{1,9})\s")
_RADIANCE = re.compile(rb"\n\n[-+]Y (\d{1,9}) [-+]X (\d{1,9})\n")
_BEGINNING = 2**16  # bytes that hold the head of these two


def ending(data: bytes) -> str:
    """The ending of a file of PNG or JPEG; empty for other data."""
    return ".png" if data.startswith(_PNG) else ".jpg" if data.startswith(_JPEG) else ""


def check_size(file: BinaryIO, subject: str) -> None:
    """Spend the pixels of a picture, of a format that Mitsuba reads.

    Raises:
        InvalidInput: it is none, or too large; one line that begins with the subject.
    """
    file.seek(0)
    head = file.read(_BEGINNING)
    try:
        pixels = _pixels(file, head)
    except (struct.error, OSError, ValueError):  # the head ends early
        pixels = 0
    if pixels <= 0:
        raise InvalidInput(f"{subject} is no image that Mitsuba can read")
    if pixels > LARGEST:
        raise InvalidInput(f"{subject} holds {pixels:.2g} pixels, more than {LARGEST:.2g}")
    with files.budget() as left:
        left.spend(subject.removesuffix(":"), "pixels", pixels)


def check(path: Path, subject: str = "") -> None:
    """Check the size of a file as `check_size`; also raises InvalidInput for one that is unreadable or not regular."""
    files.check_regular(path)
    try:
        with path.open("rb") as file:
            check_size(file, subject or f"{path}:")
    except OSError as error:
        raise InvalidInput(f"{path}: cannot be read: {files.reason(error)}") from None


def _pixels(file: BinaryIO, head: bytes) -> int:
    """Pixels of a file of that head; 0 of an unknown format."""
    if head.startswith(_PNG):
        width, height = struct.unpack(">II", head[16:24])
    elif head.startswith(_JPEG):
        width, height = _jpeg(file)
    elif head.startswith(_EXR):
        return _exr(file)
    elif head.startswith(b"BM"):
        width, height = map(abs, struct.unpack("<ii", head[18:26]))
    elif found := _NETPBM.match(head):
        width, height = map(int, found.groups())
    elif head.startswith(b"#?"):
        found = _RADIANCE.search(head)
        height, width = map(int, found.groups()) if found else (0, 0)
    else:
        file.seek(-18, 2)
        width, height = struct.unpack("<HH", head[12:16]) if file.read().startswith(b"TRUEVISION-XFILE.") else (0, 0)
    return width * height


def _jpeg(file: BinaryIO) -> tuple[int, int]:
    """Width and height in the first header of a frame (ITU T.81, B.2.2)."""
    file.seek(2)
    for _ in range(_MOST):
        marker, length = struct.unpack(">HH", file.read(4))
        if 0xFFC0 <= marker <= 0xFFCF and marker not in (0xFFC4, 0xFFC8, 0xFFCC):
            _, height, width = struct.unpack(">BHH", file.read(5))
            return width, height
        if marker < 0xFF02 or length < 2:
            break
        file.seek(length - 2, 1)
    return 0, 0


def _exr(file: BinaryIO) -> int:
    """The most pixels that a part of a file of OpenEXR asks for: those of its data, of a tile, and of its channels."""
    file.seek(4)
    (version,) = struct.unpack("<I", file.read(4))
    most, width, height, tile, channels = 0, 0, 0, 0, 0
    for _ in range(_MOST):
        name = _word(file)
        if name:
            kind, (size,) = _word(file), struct.unpack("<I", file.read(4))
            value = file.read(min(size, _BEGINNING))
            file.seek(size - len(value), 1)
            if name == b"dataWindow":
                left, top, right, bottom = struct.unpack("<4i", value)
                width, height = right - left + 1, bottom - top + 1
            elif name == b"tiles":
                x, y, _ = struct.unpack("<IIB", value)
                tile = x * y
            elif kind == b"chlist":
                channels = size // 18  # bytes of each at least
            continue
        if min(width, height) < 1:
            return 0
        most = max(most, max(width * height, tile) * max(1, channels // 4))
        if not version & _MULTIPART:
            break
        following = file.read(1)
        if following in (b"", b"\0"):
            break
        file.seek(-1, 1)
    return most


def _word(file: BinaryIO) -> bytes:
    """Bytes up to a zero, of a name."""
    found = bytearray()
    while (byte := file.read(1)) != b"\0":
        if not byte or len(found) > 255:
            raise ValueError
        found += byte
    return bytes(found)


def png(pixels: NDArray[np.uint8]) -> bytes:
    """A file of PNG of pixels (height, width, channels): 1 for grey, 3 for colours, 4 with opacity (ISO 15948)."""
    height, width, channels = pixels.shape
    rows = np.pad(pixels.reshape(height, width * channels), ((0, 0), (1, 0)))  # each begins with its filter: none
    head = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    parts = ((b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes())), (b"IEND", b""))
    chunks = (
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in parts
    )
    return _PNG + b"".join(chunks)
