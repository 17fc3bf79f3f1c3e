"""Images of glTF: files beside it, and images inside it, which are held for as long as the process runs."""

from __future__ import annotations

import base64
import binascii
import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from velatura import files, pictures
from velatura.errors import InvalidInput
from velatura.stack.paths import hold
from velatura.stack.schema import show


class Images:
    """The images of a document, each read once.

    Args:
        path: of the file.
        chunk: the binary chunk of a .glb; None without one.
    """

    def __init__(self, path: Path, document: Mapping[str, Any], chunk: bytes | None = None) -> None:
        self._path, self._document, self._chunk = path, document, chunk
        self._found: dict[int, Path | str] = {}
        self._buffers: dict[int, bytes] = {}

    def __call__(self, reference: Mapping[str, Any]) -> Path | str:
        """The file of a texture's image, or the reason why it has none that is read here.

        Raises:
            InvalidInput: there is no such texture or image, or its data is not whole.
        """
        texture = self._entry("textures", reference.get("index"))
        if "source" not in texture:
            return "in a format of an extension"
        source = texture["source"]
        image = self._entry("images", source)
        if source not in self._found:
            self._found[source] = self._file(f"image {source}", source, image)
        return self._found[source]

    def _file(self, where: str, source: int, image: Mapping[str, Any]) -> Path | str:
        uri = image.get("uri")
        if isinstance(uri, str) and not uri.startswith("data:"):
            return self._path.parent / unquote(uri)
        data = inline(where, uri) if isinstance(uri, str) else self._view(where, image.get("bufferView"))
        ending = pictures.ending(data)
        if not ending:
            return "inside the file, neither PNG nor JPEG"
        pictures.check_size(io.BytesIO(data), f"{where}:")
        return hold(data, str(image.get("name") or f"image-{source}"), ending)

    def _view(self, where: str, index: object) -> bytes:
        view = self._entry("bufferViews", index)
        begin, length = (_count(f"{where}: bufferView {index}", view, key) for key in ("byteOffset", "byteLength"))
        data = self._buffer(view.get("buffer"))
        if not length or begin + length > len(data):
            raise InvalidInput(f"{where}: bufferView {index}: lies outside its buffer of {len(data)} bytes")
        return data[begin : begin + length]

    def _buffer(self, index: Any) -> bytes:
        buffer, where = self._entry("buffers", index), f"buffer {show(index)}"
        if index not in self._buffers:
            chunk = self._chunk if index == 0 else None
            self._buffers[index] = data_of(where, buffer, chunk, lambda name: files.content(self._path.parent / name))
        return self._buffers[index]

    def _entry(self, part: str, index: object) -> Mapping[str, Any]:
        """An entry of a list of the document."""
        entries = self._document.get(part)
        known = isinstance(entries, list) and type(index) is int and 0 <= index < len(entries)
        if not known or not isinstance(entries[index], Mapping):  # type: ignore[index]
            name = "image" if part == "textures" else "entry"
            raise InvalidInput(f"{part}: has no {name} of index {show(index)}")
        return entries[index]  # type: ignore[index]


def _count(where: str, view: Mapping[str, Any], key: str) -> int:
    value = view.get(key, 0)
    if type(value) is not int or value < 0:
        raise InvalidInput(f"{where}: {key}: must be a number of bytes, got {show(value)}")
    return value


def data_of(where: str, buffer: Mapping[str, Any], chunk: bytes | None, beside: Callable[[str], bytes]) -> bytes:
    """The data of a buffer: inside the document, in the binary chunk, or by its name that of a file `beside`.

    Raises:
        InvalidInput: it has none, or what is inside is not whole.
    """
    uri = buffer.get("uri")
    if uri is None and chunk is not None:
        return chunk
    if not isinstance(uri, str):
        raise InvalidInput(f"{where}: has no data")
    return inline(where, uri) if uri.startswith("data:") else beside(unquote(uri))


def inline(where: str, uri: str) -> bytes:
    """The data in a URI (RFC 2397), which glTF has in base64."""
    kind, _, text = uri.partition(",")
    if not kind.endswith(";base64"):
        raise InvalidInput(f"{where}: must be in base64, got {show(kind)}")
    with files.budget() as left:
        left.spend(where, "bytes", len(text))
    try:
        return base64.b64decode(unquote(text) if "%" in text else text, validate=True)
    except (binascii.Error, ValueError):
        raise InvalidInput(f"{where}: is not in base64") from None
