"""Objects of several parts, as files of glTF."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from velatura.programs.gltf import file
from velatura.scenes import OBJECTS


def in_a_row(names: Sequence[str]) -> bytes:
    """A .glb of spheres in a row, 2.4 apart from the left, each a primitive with a material of its own, by names."""
    surface = OBJECTS["sphere"].surface()
    chunk, views, accessors = b"", list[dict[str, int]](), list[dict[str, object]]()

    def accessor(values: np.ndarray, kind: str, component: int, **others: object) -> int:
        nonlocal chunk
        views.append({"buffer": 0, "byteOffset": len(chunk), "byteLength": values.nbytes})
        chunk += values.tobytes()
        accessors.append(
            {"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind, **others}
        )
        return len(accessors) - 1

    normals = accessor(surface.normals.astype("<f4"), "VEC3", 5126)
    corners = accessor(surface.triangles.ravel().astype("<u4"), "SCALAR", 5125)
    primitives = []
    for number in range(len(names)):
        placed = (surface.positions + np.array([2.4 * number, 0, 0])).astype("<f4")
        ends = {"min": placed.min(axis=0).tolist(), "max": placed.max(axis=0).tolist()}
        attributes = {"POSITION": accessor(placed, "VEC3", 5126, **ends), "NORMAL": normals}
        primitives.append({"attributes": attributes, "indices": corners, "material": number})
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [{"name": name, "pbrMetallicRoughness": {"metallicFactor": 0}} for name in names],
        "buffers": [{"byteLength": len(chunk)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    return file.packed(json.dumps(document).encode(), chunk)
