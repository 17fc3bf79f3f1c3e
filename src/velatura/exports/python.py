"""A Python script that describes the material, and renders it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from velatura.exports.request import Export, Request
from velatura.stack import Mix, dumps


def write(request: Request) -> Export:
    """A module with the stack as `stack`, or the mixture as `mix`; as a script it renders a picture."""
    name = "mix" if isinstance(request.material, Mix) else "stack"
    choices = {"model": request.model.name, **request.switches}
    chosen = ", ".join(f"{key}={value!r}" for key, value in choices.items())
    first, *rest = _described(json.loads(dumps(request.material, "json")))
    lines = [
        '"""Written by `velatura export`. As a script it renders material.png, or the file that is named."""',
        "",
        "import sys",
        "",
        "import velatura as vt",
        "",
        f"{name} = {first}",
        *rest,
        "",
        'if __name__ == "__main__":',
        f"    picture = vt.render({name}, {chosen})",
        '    vt.scenes.write_image(picture, sys.argv[1] if len(sys.argv) > 1 else "material.png")',
        "",
    ]
    return Export("\n".join(lines))


def _described(fields: Mapping[str, Any]) -> list[str]:
    """The lines of an expression for a stack or a mixture, by the mapping of its file."""
    kind, held, entries = ("Mix", "mix", _parts) if "mix" in fields else ("Stack", "layers", _layers)
    given = [f"    {key}={value!r}," for key, value in fields.items() if key != held]
    return [
        f"vt.{kind}(",
        *given,
        f"    {held}=[",
        *(f"        {line}" for line in entries(fields[held])),
        "    ],",
        ")",
    ]


def _layers(layers: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for layer in layers:
        for entry, keys in layer.items():
            yield f"vt.{entry.capitalize()}({', '.join(f'{key}={value!r}' for key, value in keys.items())}),"


def _parts(parts: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for part in parts:
        first, *rest, last = _described(part["material"])
        weight, covers = part.get("weight"), part.get("covers")
        yield f"dict(weight={weight!r}, covers={covers!r}, material={first}" if covers else f"({weight!r}, {first}"
        yield from (*rest, f"{last}),")
