"""A material of glTF, alone or on a mesh; as a .glb with its images inside."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from velatura import files
from velatura.errors import InvalidInput
from velatura.exports import baked
from velatura.exports.request import Export, Request
from velatura.programs.gltf import file
from velatura.programs.gltf.images import data_of
from velatura.stack.schema import unknown

if TYPE_CHECKING:
    from velatura.scenes.surfaces import Mesh

Array = NDArray[np.floating]

FLOAT, UNSIGNED = 5126, 5125  # types of components
VERTICES, INDICES = 34962, 34963  # targets of views
MESHES = (".gltf", ".glb")


def write(request: Request) -> Export:
    """The file, which shows the material on the mesh that is asked for; `.glb` holds all in one.

    Raises:
        InvalidInput: an unknown object; a file that cannot be read, is no glTF, has no mesh, or takes data from
            elsewhere.
    """
    shown = request.options.get("mesh")
    scene, buffer = ({}, bytearray()) if shown is None else _scene(shown)
    made = baked.write(request)
    document = json.loads(made.text)
    extensions = [*dict.fromkeys([*scene.get("extensionsUsed", ()), *document.get("extensionsUsed", ())])]
    asset = {**scene.get("asset", {}), **document["asset"]}
    document = {**document, **scene, "asset": asset, "extensionsUsed": extensions}
    document = {key: value for key, value in document.items() if value not in ([], {})}
    text = _json(_with_buffer(document, buffer, inline=True), indent=2) + "\n"
    packed = partial(_packed, document, buffer, request.folder or Path(), made.apart)
    return replace(made, text=text, binary={".glb": packed})


# Scenes --------------------------------------------------------------------------------------------------------------


def _scene(shown: str | Path) -> tuple[dict[str, Any], bytearray]:
    """A document that shows the material 0, and its one buffer."""
    from velatura.scenes import OBJECTS

    if Path(shown).suffix.lower() in MESHES:
        return _of_file(Path(shown))
    if shown not in OBJECTS:
        raise InvalidInput(f"mesh: {unknown('object', shown, OBJECTS)}; or a file, {' or '.join(MESHES)}")
    return _of_object(str(shown), OBJECTS[str(shown)].surface())


def _of_object(name: str, mesh: Mesh) -> tuple[dict[str, Any], bytearray]:
    """An object, with the tangents that rotations are measured from."""
    parts = {
        "POSITION": mesh.positions,
        "NORMAL": mesh.normals,
        "TANGENT": tangents(mesh),
        "TEXCOORD_0": mesh.uv,
        "": mesh.triangles.ravel(),
    }
    buffer = bytearray()
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    for key, values in parts.items():
        data = values.astype("<f4" if key else "<u4")
        kind = f"VEC{data.shape[1]}" if key else "SCALAR"
        about: dict[str, Any] = {"bufferView": len(views), "componentType": FLOAT if key else UNSIGNED}
        about |= {"count": len(data), "type": kind}
        if key == "POSITION":
            about |= {"min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist()}
        views.append(_view(buffer, data.tobytes()) | {"target": VERTICES if key else INDICES})
        accessors.append(about)
    attributes = {key: n for n, key in enumerate(parts) if key}
    primitive = {"attributes": attributes, "indices": len(attributes), "material": 0}
    document: dict[str, Any] = {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": name}],
        "meshes": [{"name": name, "primitives": [primitive]}],
        "accessors": accessors,
        "bufferViews": views,
    }
    return document, buffer


def tangents(mesh: Mesh) -> Array:
    """Unit tangents along growing u (n, 4), the mean of those of a vertex' triangles; the last part is 1, as seen from
    outside the bitangent lies anticlockwise of the tangent."""
    p, uv = mesh.positions[mesh.triangles], mesh.uv[mesh.triangles]
    (p1, p2), (t1, t2) = ((each[:, 1] - each[:, 0], each[:, 2] - each[:, 0]) for each in (p, uv))
    area = t1[:, 0] * t2[:, 1] - t2[:, 0] * t1[:, 1]
    along = (p1 * t2[:, 1:] - p2 * t1[:, 1:]) * np.sign(area)[:, None]
    found = np.zeros_like(mesh.positions)
    for corner in mesh.triangles.T:
        np.add.at(found, corner, along)
    found -= mesh.normals * np.sum(found * mesh.normals, axis=1, keepdims=True)
    # Any tangent will do where u has no direction, as at a pole
    other = np.cross(mesh.normals, np.where(np.abs(mesh.normals[:, :1]) < 0.9, [1.0, 0, 0], [0, 1.0, 0]))
    found = np.where(np.linalg.norm(found, axis=1, keepdims=True) > 1e-9, found, other)
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    return np.pad(found, ((0, 0), (0, 1)), constant_values=1.0)


def _of_file(path: Path) -> tuple[dict[str, Any], bytearray]:
    """The scene of a file, all of whose primitives have the material 0, without its own materials and images."""
    found, chunk = file.read(path)
    document = {
        key: value for key, value in found.items() if key not in ("materials", "textures", "images", "samplers")
    }
    buffer, starts = bytearray(), []
    try:
        for number, each in enumerate(document.get("buffers", ())):
            where = f"{path}: buffer {number}"
            data = data_of(where, each, None if number else chunk, partial(_beside, path.parent, where))
            starts.append(_view(buffer, data)["byteOffset"])
        views = [dict(each) for each in document.get("bufferViews", ())]
        for view in views:
            view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
            view["buffer"] = 0
        primitives = [part for mesh in document.get("meshes", ()) for part in mesh["primitives"]]
        for part in primitives:
            part["material"] = 0
        for part in (document, *primitives):
            part.get("extensions", {}).pop("KHR_materials_variants", None)
        for key in ("extensionsUsed", "extensionsRequired"):
            document[key] = [each for each in document.get(key, ()) if not re.search("_(materials|texture)_", each)]
    except (AttributeError, KeyError, IndexError, TypeError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{path}: is no glTF: {error!r}") from None
    if not primitives:
        raise InvalidInput(f"{path}: has no mesh")
    return {**document, "bufferViews": views}, buffer


def _beside(folder: Path, where: str, name: str) -> bytes:
    """The content of a file below a folder, which is copied: none from elsewhere."""
    if ":" in name or Path(name).is_absolute() or ".." in Path(name).parts:
        raise InvalidInput(f"{where}: must lie below the folder of the file")
    return files.content(folder / name)


# Buffers -------------------------------------------------------------------------------------------------------------


def _view(buffer: bytearray, data: bytes) -> dict[str, Any]:
    """A view of data that are added to a buffer, at a multiple of 4 bytes."""
    buffer.extend(b"\0" * (-len(buffer) % 4))
    view = {"buffer": 0, "byteOffset": len(buffer), "byteLength": len(data)}
    buffer.extend(data)
    return view


def _with_buffer(document: Mapping[str, Any], buffer: bytes | bytearray, inline: bool = False) -> dict[str, Any]:
    about: dict[str, Any] = {"byteLength": len(buffer)}
    if inline:
        about["uri"] = f"data:application/octet-stream;base64,{base64.b64encode(buffer).decode()}"
    return {**document, "buffers": [about]} if buffer else dict(document)


def _json(document: Mapping[str, Any], indent: int | None = None) -> str:
    return json.dumps(document, indent=indent, ensure_ascii=False, allow_nan=False)


def _packed(document: Mapping[str, Any], buffer: bytearray, folder: Path, baked_images: Mapping[Path, bytes]) -> bytes:
    """A .glb: the document, and a chunk with the buffer and the images, of which some are in no file."""
    buffer, views, inside = bytearray(buffer), list(document.get("bufferViews", ())), []
    for image in document.get("images", ()):
        path = folder / unquote(image["uri"])
        kind = "image/png" if path.suffix.lower() == ".png" else "image/jpeg"
        inside.append({"name": path.stem, "bufferView": len(views), "mimeType": kind})
        views.append(_view(buffer, baked_images[path] if path in baked_images else files.content(path)))
    document = {**document, **({"images": inside, "bufferViews": views} if inside else {})}
    return file.packed(_json(_with_buffer(document, buffer)).encode(), bytes(buffer))
