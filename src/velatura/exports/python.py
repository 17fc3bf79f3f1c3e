"""A Python script that describes the material, and renders it."""

from __future__ import annotations

import json

from velatura.exports.request import Export, Request
from velatura.stack import dumps


def write(request: Request) -> Export:
    """A module with the stack as `stack`; as a script it renders a picture."""
    fields = json.loads(dumps(request.stack, "json"))
    layers = [
        f"        vt.{entry.capitalize()}({', '.join(f'{key}={value!r}' for key, value in keys.items())}),"
        for layer in fields.pop("layers")
        for entry, keys in layer.items()
    ]
    given = [f"    {key}={value!r}," for key, value in fields.items()]
    choices = {"model": request.model.name, **request.switches}
    chosen = ", ".join(f"{key}={value!r}" for key, value in choices.items())
    lines = [
        '"""Written by `velatura export`. As a script it renders material.png, or the file that is named."""',
        "",
        "import sys",
        "",
        "import velatura as vt",
        "",
        "stack = vt.Stack(",
        *given,
        "    layers=[",
        *layers,
        "    ],",
        ")",
        "",
        'if __name__ == "__main__":',
        f"    picture = vt.render(stack, {chosen})",
        '    vt.scenes.write_image(picture, sys.argv[1] if len(sys.argv) > 1 else "material.png")',
        "",
    ]
    return Export("\n".join(lines))
