"""Arrays that the page sends: the triangles of an object, and a picture of light."""

from __future__ import annotations

import base64
import binascii
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from velatura.scenes.environments import BRIGHTEST
from velatura.scenes.surfaces import Mesh
from velatura.stack.schema import Parameter

MOST = 500_000  # triangles, as many as the page draws
WIDEST = 2048  # texels of a picture, along either side, as the page has them
FARTHEST = 1e4  # of a position from the origin
ARRAYS = {"positions": ("<f4", 3), "normals": ("<f4", 3), "uv": ("<f4", 2), "triangles": ("<u4", 3)}


@dataclass(frozen=True)
class Triangles(Parameter):
    """A mesh: the bytes of each of ARRAYS in base64, numbers little-endian, those of a vertex side by side."""

    what: ClassVar[str] = "an object of positions, normals, uv and triangles"

    def check(self, value: Any) -> Mesh:
        if not isinstance(value, dict):
            raise self.refuse(value)
        positions, normals, uv, triangles = (_array(value, key, *ARRAYS[key]) for key in ARRAYS)
        if not len(positions) == len(normals) == len(uv):
            raise ValueError("positions, normals and uv must be of as many vertices")
        if not 1 <= len(triangles) <= MOST:
            raise ValueError(f"must have 1 to {MOST:,} triangles, got {len(triangles):,}")
        if triangles.max() >= len(positions):
            raise ValueError(f"triangles: must be of vertices below {len(positions)}, got {triangles.max()}")
        if not all(np.all(np.abs(array) <= FARTHEST) for array in (positions, normals, uv)):
            raise ValueError(f"numbers must be finite and at most {FARTHEST:g} in size")
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        upwards = np.where(lengths > 0, normals / np.maximum(lengths, 1e-30), (0.0, 1.0, 0.0))
        return Mesh(positions.astype(float), upwards, uv.astype(float), triangles)


@dataclass(frozen=True)
class Picture(Parameter):
    """Linear RGB from the upper left: its `width`, its `height`, and `data`, numbers as those of a mesh."""

    what: ClassVar[str] = "an object of width, height and data"

    def check(self, value: Any) -> NDArray[np.float32]:
        if not isinstance(value, dict):
            raise self.refuse(value)
        height, width = (_side(value.get(key)) for key in ("height", "width"))
        texels = _array(value, "data", "<f4", 3)
        if len(texels) != height * width:
            raise ValueError(f"data: must be of {height * width} texels, got {len(texels)}")
        if not np.all((texels >= 0) & (texels <= BRIGHTEST)):
            raise ValueError(f"data: must be from 0 to {BRIGHTEST:g}")
        return texels.reshape(height, width, 3).copy()  # Mitsuba takes none that is read only


def _side(length: Any) -> int:
    if not isinstance(length, int) or not 2 <= length <= WIDEST:
        raise ValueError(f"width and height must be whole numbers from 2 to {WIDEST}")
    return length


def _array(value: dict[str, Any], key: str, dtype: str, width: int) -> NDArray[Any]:
    """The array under a key, (n, width). Raises ValueError."""
    try:
        data = base64.b64decode(value.get(key, ""), validate=True)
    except (binascii.Error, TypeError, ValueError):
        raise ValueError(f"{key}: must be in base64") from None
    if len(data) % (4 * width):
        raise ValueError(f"{key}: must have {width} numbers of 4 bytes each, got {len(data)} bytes")
    return np.frombuffer(data, dtype).reshape(-1, width)
