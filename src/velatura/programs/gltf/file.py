"""Files of glTF, .gltf and .glb: their materials, with images that lie beside or inside them."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from velatura import files, kernel
from velatura.errors import InvalidInput
from velatura.programs import embedded
from velatura.programs.given import is_number
from velatura.programs.gltf import read as gltf
from velatura.programs.gltf.images import Images
from velatura.programs.gltf.parameters import ANISOTROPY, CHANNELS, CLEARCOAT, COAT, CORE, image_of
from velatura.programs.imported import Imported, Left, Notes, shown
from velatura.programs.surface import INDICES
from velatura.programs.values import Value, changed
from velatura.stack import Texture, loads
from velatura.stack.schema import show
from velatura.stack.text import parsed

LARGEST = 2**26  # characters of JSON
_MAGIC, _JSON, _BINARY = b"glTF", b"JSON", b"BIN\0"


def materials(path: Path) -> tuple[dict[str, Callable[[Notes], Imported]], None]:
    """The materials of a file by name, those without one by their number, each as a function that reads it; the
    file chooses none.

    Raises:
        InvalidInput: it cannot be read, or is no glTF.
    """
    document, chunk = read(path)
    images = Images(path, document, chunk)
    found: dict[str, Callable[[Notes], Imported]] = {}
    entries = document.get("materials", [])
    if not isinstance(entries, list):
        raise InvalidInput(f"{path}: materials: must be a list, got {show(entries)}")
    for number, entry in enumerate(entries):
        if not isinstance(entry, Mapping):
            raise InvalidInput(f"{path}: material {number}: must hold keys and values, got {show(entry)}")
        name = str(entry.get("name") or f"material {number}")
        name = name if name not in found else f"{name} ({number})"
        found[name] = _reader(entry, name, path, document, images)
    return found, None


def _reader(
    entry: Mapping[str, Any], name: str, path: Path, document: Mapping[str, Any], images: Images
) -> Callable[[Notes], Imported]:
    def read(notes: Notes) -> Imported:
        try:
            ours = str(document["asset"].get("generator", "")).startswith("Velatura ")
            held = entry if ours else {key: value for key, value in entry.items() if key != "extras"}
            return of_material(held, name, notes, images, path.parent)
        except InvalidInput as error:
            raise InvalidInput(f"{path}: {name}: {error}") from None
        except (AttributeError, KeyError, IndexError, RecursionError, TypeError, ValueError) as error:
            raise InvalidInput(f"{path}: {name}: is no material of glTF: {error}") from None

    return read


def of_material(
    material: Mapping[str, Any],
    name: str,
    notes: Notes,
    find: Callable[[Mapping[str, Any]], Path | str],
    folder: Path = Path(),
) -> Imported:
    """The stack of an entry of `materials`: the one that it was baked from, or the nearest one.

    `find` gives the file of an image, or the reason why it has none; `folder` is that of the file.
    """
    held = embedded.of_gltf(material)
    if held is not None:
        try:
            stack = loads(json.dumps(held), "the stack in extras.json", folder)
            return Imported(stack, (Left("extras", embedded.KEY, embedded.READ),))
        except InvalidInput as error:  # its images may lie elsewhere, and inside the file
            notes.add("extras", embedded.KEY, f"the parameters are read, since {error}")
    extensions = _holding(material.get("extensions", {}), "extensions")
    parts = {name: _holding(part, name) for name, part in {CORE: material.get(CORE, {}), **extensions}.items()}
    if COAT in parts:
        parts.pop(CLEARCOAT, None)  # which is there for those that know no other
    values: dict[str, Any] = {}

    # Factors, by the parts that they stand in
    for factor in gltf.PARAMETERS:
        if factor.within and factor.name in parts.get(factor.within, {}):
            given = parts[factor.within][factor.name]
            values[factor.name] = given[:3] if factor.is_colour and isinstance(given, list | tuple) else given
    for index in ("ior", "coatIor"):
        if values.get(index) == 0:
            notes.add(index, 0.0, f"an infinite index: {INDICES[1]:g} stands for it")
            values[index] = INDICES[1]
    strength = _number(parts.get("KHR_materials_emissive_strength", {}), "emissiveStrength", 1.0)
    if any(material.get("emissiveFactor", ())):
        emitted = material["emissiveFactor"]
        values["emissiveFactor"] = [strength * part if is_number(part) else part for part in emitted]

    # Images, times their factors
    for factor in gltf.PARAMETERS:
        key = image_of(factor.name)
        reference = parts.get(factor.within, {}).get(key) if factor.name in CHANNELS else None
        if reference is None:
            continue
        most = values.get(factor.name, factor.default)
        least = _number(values, "iridescenceThicknessMinimum", 100.0) if key == "iridescenceThicknessTexture" else 0.0
        texture = _texture(_holding(reference, key), CHANNELS[factor.name], key, notes, find)
        if texture is not None:
            values[factor.name] = _scaled(texture, most, least, factor.name, notes)
    for key in gltf.IGNORED:
        if any(key in part for part in (material, parts.get(CLEARCOAT, {}), parts.get(COAT, {}))):
            values[key] = "an image"
    for part, key in ((ANISOTROPY, "anisotropyTexture"), (COAT, "coatAnisotropyTexture")):
        if key in parts.get(part, {}):
            notes.add(key, "an image", "the strength and the rotation beside it stand for it")

    # Cover, and extensions that are not read
    if (mode := material.get("alphaMode", "OPAQUE")) != "OPAQUE":
        cutoff = _number(material, "alphaCutoff", 0.5)
        values["alpha"] = gltf.covered(mode, _alpha(parts[CORE], notes, find), cutoff)
    known = {each.within for each in gltf.PARAMETERS if each.within} | {"KHR_materials_emissive_strength"}
    for part in sorted(set(extensions) - known):
        notes.add(part, "", "not read")
    return gltf.read(values, name, notes)


def _alpha(core: Mapping[str, Any], notes: Notes, find: Callable[[Mapping[str, Any]], Path | str]) -> Value:
    """The fourth component of the base colour, times the alpha of its image where that has one."""
    base, key = core.get("baseColorFactor", ()), "baseColorTexture"
    alpha = _number({"alpha": base[3]} if len(base) > 3 else {}, "alpha", 1.0)
    texture = _texture(_holding(core[key], key), "a", key, notes, find) if key in core else None
    if texture is None or not kernel.bitmap(texture.texture).has_alpha():
        return alpha
    return changed(texture, lambda x: alpha * x)


def _holding(part: object, name: str) -> Mapping[str, Any]:
    """A part of a material, or its extensions, if it holds keys and values."""
    if not isinstance(part, Mapping):
        raise InvalidInput(f"{name}: must hold keys and values, got {show(part)}")
    return part


def _number(part: Mapping[str, Any], name: str, default: float) -> float:
    value = part.get(name, default)
    if not is_number(value):
        raise InvalidInput(f"{name}: must be a number, got {show(value)}")
    return float(value)


def _texture(
    reference: Mapping[str, Any],
    channel: str,
    key: str,
    notes: Notes,
    find: Callable[[Mapping[str, Any]], Path | str],
) -> Texture | None:
    file = find(reference)
    if isinstance(file, str):
        notes.add(key, "an image", f"{file}: left out")
        return None
    if reference.get("texCoord", 0) or "KHR_texture_transform" in reference.get("extensions", {}):
        notes.add(f"{key}: coordinates", file.name, "the image lies on the texture coordinates as they are")
    return Texture(texture=file, channel=channel, encoding="srgb" if channel == "rgb" else "linear")


def _scaled(texture: Texture, factor: Any, least: float, name: str, notes: Notes) -> Any:
    """An image times its factor; what is no factor stays, to be refused with the others."""
    if np.shape(factor) not in ((), (3,)) or np.asarray(factor).dtype.kind not in "iuf":
        return factor
    if isinstance(factor, list | tuple) and len(set(factor)) > 1:
        notes.add(name, shown(tuple(factor)), "its mean is a factor on the image")
    most = float(np.mean(factor))
    return changed(texture, lambda x: least + (most - least) * x)


def read(path: Path) -> tuple[Mapping[str, Any], bytes | None]:
    """The JSON of a file, and its binary chunk if it is a .glb that has one.

    Raises:
        InvalidInput: it cannot be read, or is no glTF.
    """
    text, chunk = _parts(path, files.content(path))
    return _document(path, text), chunk


def _parts(path: Path, data: bytes) -> tuple[str, bytes | None]:
    """The JSON of a file, and its binary chunk if it is a .glb that has one."""
    if data[:4] != _MAGIC:
        return files.decoded(data, path), None
    if len(data) < 20 or data[16:20] != _JSON:
        raise InvalidInput(f"{path}: is no glTF: its first chunk is not JSON")
    version, whole, length = struct.unpack("<III", data[4:16])
    if version != 2:
        raise InvalidInput(f"{path}: is glTF in version {version}, and 2 is read")
    if whole != len(data) or 20 + length > whole:
        raise InvalidInput(f"{path}: is not whole: its head says {whole} bytes, and it has {len(data)}")
    chunk = data[20 + length :]
    if len(chunk) < 8 or chunk[4:8] != _BINARY:
        return files.decoded(data[20 : 20 + length], path), None
    (size,) = struct.unpack("<I", chunk[:4])
    if 8 + size > len(chunk):
        raise InvalidInput(f"{path}: is not whole: its binary chunk says {size} bytes, and it has {len(chunk) - 8}")
    return files.decoded(data[20 : 20 + length], path), chunk[8 : 8 + size]


def packed(text: bytes, chunk: bytes) -> bytes:
    """A .glb of the JSON of a document and its binary chunk, without one where that is empty."""
    chunks = [(_JSON, text + b" " * (-len(text) % 4))]
    if chunk:
        chunks.append((_BINARY, chunk + b"\0" * (-len(chunk) % 4)))
    body = b"".join(struct.pack("<I", len(data)) + kind + data for kind, data in chunks)
    return _MAGIC + struct.pack("<II", 2, 12 + len(body)) + body


def _document(path: Path, text: str) -> Mapping[str, Any]:
    if len(text) > LARGEST:
        raise InvalidInput(f"{path}: holds more than {LARGEST >> 20} MiB of JSON")
    document = parsed(text, "json", path)
    if not isinstance(document, Mapping) or "asset" not in document:
        raise InvalidInput(f"{path}: is no glTF: has no asset")
    return document
