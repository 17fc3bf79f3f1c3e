"""Text to values and back: YAML and JSON, within the budget of `files`."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Iterable
from typing import Any

import yaml

from velatura.errors import InvalidInput
from velatura.files import budget
from velatura.stack.schema import show

_MOST = 100_000  # values in a file
_DIGITS = 300  # of a number that may be an integer


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


class Dumper(yaml.SafeDumper):
    """YAML with one line a layer and no anchors."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


class Line(dict[str, Any]):
    """A mapping that is written on one line."""


_EXPONENT = re.compile(r"[-+]?(\d[\d_]*\.?[\d_]*|\.\d[\d_]*)[eE][-+]?\d+$")
for _dialect in (_Loader, Dumper):
    _dialect.add_implicit_resolver("tag:yaml.org,2002:float", _EXPONENT, list("-+.0123456789"))
for _kind in ("int", "float"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _Loader.construct_number)
# PyYAML would write U+0085 as a line break, and read back a space
Dumper.add_representer(
    str,
    lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", text, style='"' if "\x85" in text else None),
)
Dumper.add_representer(
    Line, lambda dumper, data: dumper.represent_mapping("tag:yaml.org,2002:map", data, flow_style=True)
)
