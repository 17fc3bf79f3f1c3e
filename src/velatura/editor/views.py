"""The view transforms of pictures, printed as the page's shader."""

from __future__ import annotations

import functools

from velatura.editor.messages import Answer
from velatura.scenes.views import VIEWS
from velatura.shader.printers.glsl import GLSL
from velatura.shader.printers.statements import statements
from velatura.shader.recorder import symbol
from velatura.shader.recorder.graph import Graph

TITLES = {"soft": "Soft highlights", "srgb": "sRGB, cut off", "agx": "AgX", "aces": "ACES 1.0"}


def views() -> list[Answer]:
    """Every view transform: `name`, `title`, and `text`, a function `displayed` of linear light in GLSL ES."""
    return [{"name": name, "title": TITLES[name], "text": printed(name)} for name in VIEWS]


@functools.cache
def printed(name: str) -> str:
    """A view transform as `vec3 displayed(vec3 light)` in GLSL ES."""
    red, green, blue = (symbol.number(f"light.{channel}") for channel in "rgb")
    shown = Graph().unique(VIEWS[name]((red, green, blue)))
    lines, texts = statements([(value, "number") for value in shown], GLSL)
    helpers = GLSL.helpers({(each.op, each.kind) for each in symbol.in_order(shown)})
    body = "".join(f"    {line}\n" for line in lines if line)
    return f"{helpers}\nvec3 displayed(vec3 light) {{\n{body}    return vec3({', '.join(texts)});\n}}\n"
