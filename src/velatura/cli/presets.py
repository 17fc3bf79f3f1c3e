"""`velatura presets`: the materials that come with the package."""

from __future__ import annotations

import json
from collections.abc import Iterable
from itertools import groupby

from velatura.cli import options


def presets(as_json: options.Json = False) -> None:
    """List the materials that come with the package.

    Each with its layers from the top; the JSON also has the source of its numbers.
    """
    from velatura import stack

    stacks = {name: stack.preset(name) for name in stack.presets()}
    if as_json:
        print(json.dumps([{"name": name, "layers": m.kinds, "source": m.source} for name, m in stacks.items()]))
        return

    width = max(map(len, stacks))
    for name, material in stacks.items():
        print(f"{name:{width}}  {_layers(material.kinds)}")


def _layers(kinds: Iterable[str]) -> str:
    """Kinds of layers from the top, those in a row counted: 2 dielectrics, mirror."""
    rows = [(kind, len(list(row))) for kind, row in groupby(kinds)]
    return ", ".join(kind if count == 1 else f"{count} {kind}s" for kind, count in rows)
