"""Arrays that the page sends: the triangles of an object, and a picture of light."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from velatura.scenes.environments import BRIGHTEST
from velatura.scenes.surfaces import Mesh
from velatura.stack.schema import Parameter, show

PARTS = 32  # of an object
NAME = 255  # characters
MOST = 500_000  # triangles, as many as the page draws
WIDEST = 2048  # texels of a picture, along either side, as the page has them
FARTHEST = 1e4  # of a position from the origin
ARRAYS = {"positions": ("<f4", 3), "normals": ("<f4", 3), "uv": ("<f4", 2), "triangles": ("<u4", 3)}


@dataclass(frozen=True)
class Triangles(Parameter):
    """A mesh: the bytes of each of ARRAYS in base64, numbers little-endian, those of a vertex side by side.

    Its `parts` are the name and the number of triangles of each, in their order; the mesh is checked as one surface a
    part, by names.
    """

    what: ClassVar[str] = "an object of positions, normals, uv and triangles"

    def check(self, value: Any) -> dict[str, Mesh]:
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
        whole = Mesh(positions.astype(float), upwards, uv.astype(float), triangles)
        parts = value.get("parts")
        return {"": whole} if parts is None else dict(_divided(whole, _parts(parts, len(triangles))))


def _parts(value: Any, triangles: int) -> dict[str, int]:
    """The numbers of triangles of parts, by their names. Raises ValueError."""
    if not isinstance(value, list) or not 1 <= len(value) <= PARTS:
        raise ValueError(f"parts: must be a list of 1 to {PARTS}")
    counts: dict[str, int] = {}
    for part in value:
        name, count = (part.get("name"), part.get("triangles")) if isinstance(part, dict) else (None, None)
        if not isinstance(name, str) or len(name) > NAME or name in counts:
            raise ValueError(f"parts: name: must be text of {NAME} characters at most, once, got {show(name)}")
        if not isinstance(count, int) or not 1 <= count <= triangles:
            raise ValueError(f"parts: triangles: must be a whole number from 1 to {triangles}, got {show(count)}")
        counts[name] = count
    if sum(counts.values()) != triangles:
        raise ValueError(f"parts: must have {triangles} triangles together, got {sum(counts.values())}")
    return counts


def _divided(mesh: Mesh, counts: dict[str, int]) -> Iterator[tuple[str, Mesh]]:
    """The parts of a mesh, each with its own vertices alone."""
    first = 0
    for name, count in counts.items():
        used, corners = np.unique(mesh.triangles[first : first + count], return_inverse=True)
        places = (mesh.positions[used], mesh.normals[used], mesh.uv[used])
        yield name, Mesh(*places, corners.reshape(-1, 3).astype(np.uint32))
        first += count


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
