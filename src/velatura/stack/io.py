"""Material files: YAML and JSON, in and out, and the presets that come with the package."""

from __future__ import annotations

import itertools
import json
import math
import os
import re
from collections.abc import Callable, Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Any, TypeAlias

import yaml

from velatura.errors import InvalidInput
from velatura.files import budget, text_of, whole
from velatura.readers import READERS
from velatura.stack.paths import beside, rewritten
from velatura.stack.schema import show, unknown
from velatura.stack.stack import Stack

_PRESETS = resources.files("velatura.stack") / "presets"
_FORMATS = {".yaml": "yaml", ".yml": "yaml", ".json": "json"}
LARGEST = 2**22  # bytes of a file
_MOST = 100_000  # values in a file
_DIGITS = 300  # of a number that may be an integer
ENDINGS = (*_FORMATS, *READERS)  # of all files that hold a material

#: What names a material wherever one is asked for: a stack, a file, the name of a preset, or what a file would hold.
#: The mapping is without its types, so that `isinstance` takes it.
MaterialLike: TypeAlias = Stack | str | Path | Mapping


# In ------------------------------------------------------------------------------------------------------------------


@budget()
def load(material: MaterialLike) -> Stack:
    """The stack in a material file (.yaml, .yml or .json), or the preset of that name; a stack unchanged.

    A bare word without an extension is a preset. Paths in a file are relative to it; in a mapping of the keys of one,
    to the current folder. A file of another program (.mtlx, .gltf, .glb, or a scene of Mitsuba, .xml; FILE#NAME for one
    of its materials) is imported, with a warning that lists what a stack cannot carry.

    Raises:
        InvalidInput: no such file or preset, or its content is not a material, or beyond the budget of `files`; one
            line that names the file.
    """
    if isinstance(material, Stack):
        return material
    if isinstance(material, Mapping):
        try:
            return Stack.from_dict(material)
        except RecursionError:
            raise InvalidInput("the material: is nested too deeply") from None
    if not isinstance(material, str | Path):
        shown = show(material)  # type: ignore[unreachable]
        raise InvalidInput(f"a material must be a stack, a file or the name of a preset, got {shown}")
    path = Path(material)
    if str(material) in presets() or (not path.suffix and path.parent == Path() and not os.path.isdir(path)):
        return preset(str(material))
    if os.path.isdir(path):
        raise InvalidInput(f"{path}: is a folder, not a material file")
    if file := foreign(str(material)):
        imported: Stack = READERS[Path(file).suffix.lower()](str(material))
        return imported
    _format(path, "a material file", ENDINGS)
    return loads(text_of(path, LARGEST), name=str(path), folder=path.parent)


def foreign(material: str) -> str:
    """The file of another program in FILE or FILE#NAME; empty for what is none."""
    file = material if os.path.exists(material) else material.rpartition("#")[0] or material
    return file if Path(file).suffix.lower() in READERS else ""


def loads(
    text: str,
    name: str = "material.yaml",
    folder: str | Path = ".",
    find: Callable[[str], str] | None = None,
) -> Stack:
    """The stack in a text.

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
        return Stack.from_dict(rewritten(fields, find))
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


def preset(name: str) -> Stack:
    """The preset of that name.

    Raises:
        InvalidInput: there is none.
    """
    if name not in presets():
        unknown_name = unknown("preset", name, presets(), "`velatura presets` lists all")
        raise InvalidInput(f"{unknown_name}; a material file ends in {', '.join(ENDINGS)}")
    return loads((_PRESETS / f"{name}.yaml").read_text(encoding="utf-8"), name=f"{name}.yaml")


def presets() -> tuple[str, ...]:
    """The names of all presets, sorted."""
    return tuple(sorted(file.name.removesuffix(".yaml") for file in _PRESETS.iterdir()))


# Out -----------------------------------------------------------------------------------------------------------------


def save(stack: Stack, path: str | Path) -> None:
    """Write a material file, whole or not at all; paths in it are written relative to it.

    Images that no file of the user's holds, such as those inside a .glb, are written beside it.

    Raises:
        InvalidInput: the extension is none of .yaml, .yml and .json, or a file cannot be written.
    """
    path = Path(path)
    format = _format(path)
    if not os.path.isdir(path.parent):
        raise InvalidInput(f"{path}: there is no folder {path.parent}")
    with beside(stack, path.parent) as stack, whole(path) as unfinished:
        unfinished.write_bytes(dumps(stack, format, path.parent).encode("utf-8"))


def dumps(stack: Stack, format: str = "yaml", folder: str | Path | None = None) -> str:
    """The text of a material file, `yaml` or `json`, that `loads` reads back exactly.

    Values that equal their default are left out. Paths in it are relative to `folder`, or absolute where it is None.

    Raises:
        InvalidInput: an unknown format.
    """
    fields = stack.to_dict()
    if folder is not None:
        start = Path(folder).resolve()
        fields = rewritten(fields, lambda path: Path(os.path.relpath(path, start)).as_posix())
    if format == "json":
        return json.dumps(fields, indent=2, ensure_ascii=False) + "\n"
    if format == "yaml":
        fields["layers"] = [{entry: _Line(keys) for entry, keys in layer.items()} for layer in fields["layers"]]
        return yaml.dump(fields, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=float("inf"))
    raise InvalidInput(unknown("format", format, ("yaml", "json")))


# Text to values and back ---------------------------------------------------------------------------------------------


def parsed(text: str, format: str, where: object) -> Any:
    """The values in a text of "yaml" or "json".

    Raises:
        InvalidInput: it is none, or beyond the budget; one line that begins with `where`.
    """
    with budget() as left:
        left.spend(where, "values", sum(map(text.count, ",[{")) if format == "json" else 0)
    try:
        if format == "json":
            return json.loads(text, object_pairs_hook=_unique, parse_int=_integer)
        return yaml.load(text, Loader=_Loader)
    except InvalidInput as error:
        raise InvalidInput(f"{where}: {error}") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f"line {mark.line + 1}: " if mark else ""
        reason = getattr(error, "problem", None) or getattr(error, "reason", None) or "it cannot be read"
        raise InvalidInput(f"{where}: {line}is not valid YAML: {reason}") from None
    except json.JSONDecodeError as error:
        raise InvalidInput(f"{where}: line {error.lineno}: is not valid JSON: {error.msg}") from None
    except RecursionError:
        raise InvalidInput(f"{where}: is nested too deeply") from None
    except Exception as error:  # a date that is none: PyYAML lets all sorts pass
        raise InvalidInput(f"{where}: cannot be read: {error}") from None


def _integer(text: str) -> int | float:
    """A number without a point: infinite if it is long, so that it is refused where it stands."""
    return int(text) if len(text) <= _DIGITS else math.copysign(math.inf, -1 if text[0] == "-" else 1)


def _unique(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    fields: dict[str, Any] = {}
    for key, value in pairs:
        if key in fields:
            raise InvalidInput(f"key {key!r} appears twice")
        fields[key] = value
    return fields


class _Loader(yaml.SafeLoader):
    """YAML that refuses tags, duplicate keys and endless aliases, and reads 1e-3 as a number, as YAML 1.2 does."""

    _values = 0

    def get_event(self) -> yaml.Event:
        event = super().get_event()
        self._values += isinstance(event, yaml.NodeEvent)
        if self._values > _MOST:
            raise InvalidInput(f"holds more than {_MOST} values")
        tag = getattr(event, "tag", None)
        if tag is not None:
            raise InvalidInput(f"line {event.start_mark.line + 1}: a value must have no tag, got {show(tag)}")
        return event

    def get_single_node(self) -> yaml.Node | None:
        node = super().get_single_node()
        if node is not None and _size(node, {}) > _MOST:
            raise InvalidInput(f"holds more than {_MOST} values once its aliases are written out")
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if key.value in seen:
                    raise InvalidInput(f"line {key.start_mark.line + 1}: key {key.value!r} appears twice")
                seen.add(key.value)
        return super().construct_mapping(node, deep)

    def construct_number(self, node: yaml.ScalarNode) -> Any:
        """A number; one of many digits in linear time, so without the base 60 of YAML 1.1."""
        plain = self.construct_yaml_int if node.tag.endswith(":int") else self.construct_yaml_float
        if len(node.value) <= _DIGITS:
            return plain(node)
        try:
            return float(node.value)
        except ValueError:
            return math.inf


def _size(node: yaml.Node, known: dict[int, float]) -> float:
    """How many values a node holds, aliases written out; one that holds itself has no end."""
    if id(node) not in known:
        known[id(node)] = math.inf
        parts = node.value if isinstance(node, yaml.CollectionNode) else ()
        flat = itertools.chain.from_iterable(parts) if isinstance(node, yaml.MappingNode) else parts
        known[id(node)] = 1 + sum(_size(part, known) for part in flat)
    return known[id(node)]


class _Dumper(yaml.SafeDumper):
    """YAML with one line a layer and no anchors."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


class _Line(dict[str, Any]):
    """A mapping that is written on one line."""


_EXPONENT = re.compile(r"[-+]?(\d[\d_]*\.?[\d_]*|\.\d[\d_]*)[eE][-+]?\d+$")
for _dialect in (_Loader, _Dumper):
    _dialect.add_implicit_resolver("tag:yaml.org,2002:float", _EXPONENT, list("-+.0123456789"))
for _kind in ("int", "float"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _Loader.construct_number)
# PyYAML would write U+0085 as a line break, and read back a space
_Dumper.add_representer(
    str,
    lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", text, style='"' if "\x85" in text else None),
)
_Dumper.add_representer(
    _Line, lambda dumper, data: dumper.represent_mapping("tag:yaml.org,2002:map", data, flow_style=True)
)


def _format(path: Path, what: str = "a material file", endings: Iterable[str] = _FORMATS) -> str:
    """The format of a file by its ending; `endings` are those that may stand in its place."""
    if path.suffix.lower() not in _FORMATS:
        raise InvalidInput(f"{path}: {what} ends in {', '.join(endings)}")
    return _FORMATS[path.suffix.lower()]
