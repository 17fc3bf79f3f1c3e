"""The struct of a material in GLSL, and the function that fills it: with numbers, and from textures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any

import numpy as np

from velatura.model.stack_lobes import number as plain
from velatura.shader.glsl import block, literal
from velatura.shader.symbol import operand
from velatura.stack import Brushing, Stack, Texture, Varying, is_colour, within

PARAMETERS = "vt_parameters"  # in the code: the values that change


def place(name: str) -> str:
    """Where a value lies in the struct: `layer0.eta` for `layer0_eta`."""
    return name.replace("_", ".", 1) if name.startswith("layer") else name


def constant(name: str, value: Any) -> Any:
    """A value of a material as a float, or as an array of three channels where they differ."""
    channels = np.ravel(plain(name, value))
    return float(channels[0]) if np.all(channels == channels[0]) else channels


def structs(stack: Stack, read: Sequence[str]) -> str:
    """`VtMaterial`, which holds the values that are read, by flat name: a struct for each layer that has any."""
    text, members = "", ["float exterior;"]
    for i, kind in enumerate(stack.kinds):
        prefix = f"layer{i}_"
        names = [name for name in read if name.startswith(prefix)]
        if names:
            fields = [f"{'vec3' if is_colour(name) else 'float'} {name.removeprefix(prefix)};" for name in names]
            text += struct(f"VtLayer{i}", fields, kind)
            members.append(f"VtLayer{i} layer{i};")
    return text + struct("VtMaterial", members, "indices are absolute, rotations in degrees")


def maps(stack: Stack, read: Sequence[str]) -> dict[Texture, str]:
    """The samplers of the textures, named after the first value that reads each."""
    images: dict[Texture, str] = {}
    for name, value in stack.flat().items():
        if name in read and isinstance(value, Texture):
            images.setdefault(value, f"vt_map_{name}")
    return images


def filled(stack: Stack, read: Sequence[str], parameters: bool) -> str:
    """`vt_material`: the values of the stack at texture coordinates, and the samplers that it needs.

    With `parameters`, plain values are those of a uniform.
    """
    flat, images = stack.flat(), maps(stack, read)
    written = [name for name in read if name != "exterior" and (isinstance(flat[name], Varying) or not parameters)]
    lines = [f"m.{place(name)} = {_value(name, flat[name], images)};" for name in written]
    begin = ["VtMaterial m;", f"m.exterior = {literal(stack.exterior)};"]
    samplers = [
        f"uniform sampler2D {name}; // {image.texture}{', to be decoded from sRGB' * (image.encoding == 'srgb')}\n"
        for image, name in images.items()
    ]
    lines = [*([f"VtMaterial m = {PARAMETERS};"] if parameters else begin), *lines, "return m;"]
    return f"{''.join(samplers)}{block('VtMaterial vt_material(vec2 uv)', lines)}"


def struct(name: str, members: Sequence[str], comment: str) -> str:
    return "\n".join([f"struct {name} {{ // {comment}", *(f"    {member}" for member in members), "};", ""])


def _value(name: str, value: Any, images: Mapping[Texture, str]) -> str:
    if isinstance(value, Brushing):
        across = 90.0 if value.brushing == "concentric" else 0.0
        centre = f"uv.y - {literal(value.v)}, uv.x - {literal(value.u)}"
        return f"degrees(atan({centre})) + {literal(across + value.offset)}"
    if not isinstance(value, Varying):
        text = literal(operand(constant(name, value)))
        return f"vec3({text})" if is_colour(name) and not text.startswith("vec3") else text
    assert isinstance(value, Texture)
    colour = is_colour(name)
    channel = "rgb" if colour and value.channel in (None, "rgb") else (value.channel or "r")
    texel = f"texture({images[value]}, uv).{channel} * {literal(value.scale)} + {literal(value.offset)}"
    low, high = within(name)
    low = max(low, -1e6)
    texel = f"max({texel}, {literal(low)})" if high == inf else f"clamp({texel}, {literal(low)}, {literal(high)})"
    return f"vec3({texel})" if colour and channel != "rgb" else texel
