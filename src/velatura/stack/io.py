"""Material files: YAML and JSON, in and out, and the presets that come with the package."""

from __future__ import annotations

import functools
import json
import os
from collections.abc import Callable, Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Any, TypeAlias

import yaml

from velatura.errors import InvalidInput
from velatura.files import budget, relative, text_of, whole
from velatura.readers import READERS
from velatura.stack.mix import Described, Mix, from_dict
from velatura.stack.paths import beside, is_preset, rewritten
from velatura.stack.schema import show, unknown
from velatura.stack.stack import Stack
from velatura.stack.text import Dumper, Line, parsed

_PRESETS = resources.files("velatura.stack") / "presets"
_FORMATS = {".yaml": "yaml", ".yml": "yaml", ".json": "json"}
LARGEST = 2**22  # bytes of a file
ENDINGS = (*_FORMATS, *READERS)  # of all files that hold a material

#: What names a material wherever one is asked for: a stack, a mixture, a file, the name of a preset, or what a file
#: would hold. The mapping is without its types, so that `isinstance` takes it.
MaterialLike: TypeAlias = Stack | Mix | str | Path | Mapping


#: The material of a file or a preset: a stack, or a mixture where it holds one. Typed as typeshed does it where callers
#: mostly know which, so that code for stacks compiles unchanged; what takes no mixture reads by `single`.
Loaded: TypeAlias = Stack | Any


# In ------------------------------------------------------------------------------------------------------------------


@budget()
def load(material: MaterialLike) -> Loaded:
    """The stack or mixture in a material file (.yaml, .yml or .json), or the preset of that name; either unchanged.

    A bare word without an extension is a preset. Paths in a file are relative to it; in a mapping of the keys of one,
    to the current folder. A file of another program (.mtlx, .gltf, .glb, or a scene of Mitsuba, .xml; FILE#NAME for one
    of its materials) is imported, with a warning that lists what a stack cannot carry.

    Raises:
        InvalidInput: no such file or preset, or its content is not a material, or beyond the budget of `files`; one
            line that names the file.
    """
    if isinstance(material, Stack | Mix):
        return material
    if isinstance(material, Mapping):
        try:
            return from_dict(material)
        except RecursionError:
            raise InvalidInput("the material: is nested too deeply") from None
    if not isinstance(material, str | Path):
        shown = show(material)  # type: ignore[unreachable]
        raise InvalidInput(f"a material must be a stack, a mixture, a file or the name of a preset, got {shown}")
    path = Path(material)
    if str(material) in presets() or (is_preset(str(material)) and not os.path.isdir(path)):
        return preset(str(material))
    if os.path.isdir(path):
        raise InvalidInput(f"{path}: is a folder, not a material file")
    if file := foreign(str(material)):
        imported: Loaded = READERS[Path(file).suffix.lower()](str(material))
        return imported
    _format(path, "a material file", ENDINGS)
    return loads(text_of(path, LARGEST), name=str(path), folder=path.parent)


def single(material: MaterialLike, what: str) -> Stack:
    """The stack of a material, for what takes no mixture, as "the inverse".

    Raises:
        InvalidInput: as `load`, or it is a mixture.
    """
    found: Described = load(material)
    if isinstance(found, Mix):
        raise InvalidInput(f"{what}: takes a single stack, not a mixture")
    return found


def foreign(material: str) -> str:
    """The file of another program in FILE or FILE#NAME; empty for what is none."""
    file = material if os.path.exists(material) else material.rpartition("#")[0] or material
    return file if Path(file).suffix.lower() in READERS else ""


def loads(
    text: str,
    name: str = "material.yaml",
    folder: str | Path = ".",
    find: Callable[[str], str] | None = None,
) -> Loaded:
    """The stack or mixture in a text.

    Args:
        text: YAML, or JSON where `name` ends in .json.
        name: what error messages call the text.
        folder: what paths in it are relative to.
        find: where there is no such folder: the file that a path stands for.

    Raises:
        InvalidInput: the text is not a material; one line that begins with `name`.
    """
    find = find or (lambda path: str(Path(folder, path)))
    fields = parsed(text, _FORMATS.get(Path(name).suffix.lower(), "yaml"), name)
    try:
        return from_dict(rewritten(fields, find))
    except InvalidInput as error:
        raise InvalidInput(f"{name}: {error}") from None
    except RecursionError:
        raise InvalidInput(f"{name}: is nested too deeply") from None


def read(path: str | Path, what: str) -> Any:
    """The content of a YAML or JSON file, unchecked; `what` is its kind in messages, as "a target file".

    Raises:
        InvalidInput: no such file, or its text is neither; one line that names the file.
    """
    path = Path(path)
    format = _format(path, what)
    return parsed(text_of(path, LARGEST), format, path)


def preset(name: str) -> Loaded:
    """The preset of that name.

    Raises:
        InvalidInput: there is none.
    """
    if name not in presets():
        unknown_name = unknown("preset", name, presets(), "`velatura presets` lists all")
        raise InvalidInput(f"{unknown_name}; a material file ends in {', '.join(ENDINGS)}")
    return _preset(name)


@functools.cache
def _preset(name: str) -> Loaded:
    text = (_PRESETS / f"{name}.yaml").read_text(encoding="utf-8")
    return loads(text, name=f"{name}.yaml", folder=str(_PRESETS))


def presets(mixtures: bool = True) -> tuple[str, ...]:
    """The names of all presets, sorted; of those that are no mixtures, where these are not wanted."""
    names = sorted(file.name.removesuffix(".yaml") for file in _PRESETS.iterdir() if file.name.endswith(".yaml"))
    return tuple(name for name in names if mixtures or isinstance(preset(name), Stack))


# Out -----------------------------------------------------------------------------------------------------------------


def save(material: Described, path: str | Path) -> None:
    """Write a material file, whole or not at all; paths in it are written relative to it.

    Images that no file of the user's holds, such as those inside a .glb, are written beside it.

    Raises:
        InvalidInput: the extension is none of .yaml, .yml and .json, or a file cannot be written.
    """
    path = Path(path)
    format = _format(path)
    if not os.path.isdir(path.parent):
        raise InvalidInput(f"{path}: there is no folder {path.parent}")
    with beside(material, path.parent) as material, whole(path) as unfinished:
        unfinished.write_bytes(dumps(material, format, path.parent).encode("utf-8"))


def dumps(material: Described, format: str = "yaml", folder: str | Path | None = None) -> str:
    """The text of a material file, `yaml` or `json`, that `loads` reads back exactly.

    Values that equal their default are left out, and the materials of a mixture are written out. Paths in it are
    relative to `folder`, or absolute where it is None.

    Raises:
        InvalidInput: an unknown format.
    """
    fields = material.to_dict()
    if folder is not None:
        start = Path(folder).resolve()
        fields = rewritten(fields, lambda path: relative(path, start))
    if format == "json":
        return json.dumps(fields, indent=2, ensure_ascii=False) + "\n"
    if format == "yaml":
        return yaml.dump(_in_lines(fields), Dumper=Dumper, sort_keys=False, allow_unicode=True, width=float("inf"))
    raise InvalidInput(unknown("format", format, ("yaml", "json")))


def _in_lines(fields: dict[str, Any]) -> dict[str, Any]:
    """The mapping of a material with its layers on one line each."""
    if "mix" in fields:
        parts = [{**part, "material": _in_lines(part["material"])} for part in fields["mix"]]
        return {**fields, "mix": parts}
    layers = [{entry: Line(keys) for entry, keys in layer.items()} for layer in fields["layers"]]
    return {**fields, "layers": layers}


def _format(path: Path, what: str = "a material file", endings: Iterable[str] = _FORMATS) -> str:
    """The format of a file by its ending; `endings` are those that may stand in its place."""
    if path.suffix.lower() not in _FORMATS:
        raise InvalidInput(f"{path}: {what} ends in {', '.join(endings)}")
    return _FORMATS[path.suffix.lower()]
