"""Files of other programs, by their endings, and materials by their parameters."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from velatura import files
from velatura.errors import Incomplete, InvalidInput, short
from velatura.programs import FORMATS, embedded, reader
from velatura.programs.imported import Imported, Left, Notes
from velatura.stack import loads
from velatura.stack.io import Loaded, foreign
from velatura.stack.schema import show, unknown

LONGEST = 5000  # characters of a warning
BAKED = (".mtlx", ".xml")  # files whose bakes hold their stack in a comment


@files.budget()
def read(path: str | Path, material: str | None = None) -> Imported:
    """A material of a file of another program: MaterialX (.mtlx), glTF (.gltf, .glb), or a scene of Mitsuba (.xml).

    Args:
        material: its name, where the file has several, and no look of MaterialX assigns one alone; `FILE#NAME` names
            both.

    Raises:
        InvalidInput: the file cannot be read, has no such material, or several and none is named.
    """
    file = foreign(str(path)) or str(path)
    material = material or str(path)[len(file) + 1 :] or None
    found, chosen = _found(file)
    material = chosen if material is None else material
    if material is None and len(found) > 1:
        names = ", ".join(list(found)[:12]) + (", ..." if len(found) > 12 else "")
        raise InvalidInput(f"{file}: has {len(found)} materials; name one, as in {Path(file).name}#NAME: {names}")
    name = next(iter(found)) if material is None else material
    if name not in found:
        raise InvalidInput(f"{file}: {unknown('material', name, found)}")
    held = _held(Path(file)) if Path(file).suffix.lower() in BAKED and len(found) == 1 else None
    imported: Imported = held or found[name](Notes())
    return imported


@files.budget()
def choice(path: str | Path) -> list[str]:
    """The names of a file's materials where `read` needs one of them; none where it does not.

    Raises:
        InvalidInput: the file cannot be read, or has no material.
    """
    found, chosen = _found(str(path))
    return list(found) if chosen is None and len(found) > 1 else []


def _found(file: str) -> tuple[Mapping[str, Any], str | None]:
    """The functions that read the materials of a file, by name, and the name that the file chooses, if any."""
    ending = Path(file).suffix.lower()
    if ending not in FORMATS:
        raise InvalidInput(f"{file}: a file to import ends in {', '.join(FORMATS)}")
    found, chosen = reader(ending).materials(Path(file))
    if not found:
        raise InvalidInput(f"{file}: has no material that is read here")
    return found, chosen if chosen in found else None


def _held(path: Path) -> Imported | None:
    """The stack that the only material of a file was baked from; None of any other file."""
    held = embedded.of_xml(files.content(path).decode("utf-8", "replace"))
    if held is None:
        return None
    stack = loads(json.dumps(held), f"{path}: the stack in it.json", path.parent)
    return Imported(stack, (Left("comment", embedded.KEY, embedded.READ),))


def load(path: str) -> Loaded:
    """The stack or mixture nearest to a material of a file; one warning lists what that cannot carry.

    Raises:
        InvalidInput: as `read`.
    """
    found = read(path)
    if found.left:
        warnings.warn(short(f"{path}: {'; '.join(map(str, found.left))}", LONGEST), Incomplete, stacklevel=2)
    return found.stack


def from_openpbr(**parameters: Any) -> Imported:
    """The stack nearest to a surface of OpenPBR 1.1, by the names of its parameters: numbers, colours, `vt.Texture`.

    Raises:
        InvalidInput: an unknown parameter, or a value of another kind.
    """
    from velatura.programs.openpbr import read

    return read.read(parameters)


def from_standard_surface(**parameters: Any) -> Imported:
    """The stack nearest to Autodesk's Standard Surface; see `from_openpbr`."""
    from velatura.programs.standard_surface import read

    return read.read(parameters)


def from_gltf(material: Mapping[str, Any]) -> Imported:
    """The stack nearest to a material of glTF, an entry of `materials` in its JSON; for files see `read`.

    Raises:
        InvalidInput: it is none.
    """
    from velatura.programs.gltf.file import of_material

    if not isinstance(material, Mapping):
        raise InvalidInput(f"a material of glTF must hold its keys and values, got {show(material)}")
    try:
        return of_material(material, str(material.get("name", "")), Notes(), lambda _: "without a file")
    except (AttributeError, KeyError, IndexError, TypeError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{show(material)} is no material of glTF: {error}") from None


def from_principled(described: Mapping[str, Any]) -> Imported:
    """The stack nearest to Mitsuba's `principled`, described as `mi.load_dict` takes it.

    Raises:
        InvalidInput: another plugin, an unknown parameter, or a value of another kind.
    """
    from velatura.programs.mitsuba_xml.read import of_dict

    return of_dict(described, Notes())
