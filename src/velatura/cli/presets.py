"""`velatura presets`: the materials that come with the package."""

from __future__ import annotations

import json
from collections.abc import Iterable
from itertools import groupby
from typing import TYPE_CHECKING

from velatura.cli import options

if TYPE_CHECKING:
    from velatura.stack import Described, Kind


def presets(as_json: options.Json = False) -> None:
    """List the materials that come with the package.

    Each with its layers from the top, mixtures with the names of their parts; the JSON also has the source of numbers.
    """
    from velatura import stack

    materials = {name: stack.preset(name) for name in stack.presets()}
    if as_json:
        listed = {name: (_kinds(material), material.source) for name, material in materials.items()}
        print(
            json.dumps(
                [{"name": name, "layers": sum(kinds, ()), "source": source} for name, (kinds, source) in listed.items()]
            )
        )
        return

    width = max(map(len, materials))
    for name, material in materials.items():
        stacks = [stack for _, stack in material.leaves()]
        shown = _layers(stacks[0].kinds) if len(stacks) == 1 else " + ".join(stack.name for stack in stacks)
        print(f"{name:{width}}  {shown}")


def _kinds(material: Described) -> list[tuple[Kind, ...]]:
    """The kinds of layers of every stack."""
    return [stack.kinds for _, stack in material.leaves()]


def _layers(kinds: Iterable[str]) -> str:
    """Kinds of layers from the top, those in a row counted: 2 dielectrics, mirror."""
    rows = [(kind, len(list(row))) for kind, row in groupby(kinds)]
    return ", ".join(kind if count == 1 else f"{count} {kind}s" for kind, count in rows)
