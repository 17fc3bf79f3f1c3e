"""Pictures in the format OpenEXR: halves of floats in lines, not compressed (OpenEXR, "File layout")."""

from __future__ import annotations

import struct

import numpy as np

_HALF = 1  # the type of channels


def exr(texels: np.ndarray) -> bytes:
    """A file of texels (height, width, 4), whose channels are named R, G, B and A, from the top."""
    height, width, _ = texels.shape
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(name + b"\0" + struct.pack("<iB3xii", _HALF, 0, 1, 1) for name in (b"A", b"B", b"G", b"R"))
    attributes = (
        (b"channels", b"chlist", channels + b"\0"),
        (b"compression", b"compression", b"\0"),
        (b"dataWindow", b"box2i", window),
        (b"displayWindow", b"box2i", window),
        (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        (b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
    )
    entries = (name + b"\0" + kind + b"\0" + struct.pack("<i", len(x)) + x for name, kind, x in attributes)
    head = struct.pack("<II", 20000630, 2) + b"".join(entries) + b"\0"
    size = 4 * 2 * width
    first = len(head) + 8 * height
    places = (first + np.arange(height) * (8 + size)).astype("<u8").tobytes()
    # Channels of a line follow one another, by the order of their names
    lines = np.ascontiguousarray(texels[..., ::-1].transpose(0, 2, 1), "<f2")
    return head + places + b"".join(struct.pack("<ii", y, size) + line.tobytes() for y, line in enumerate(lines))
