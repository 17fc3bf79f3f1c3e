"""A material as shader code, and the texture that it reads."""

from __future__ import annotations

from velatura.exports.formats import Export, Request
from velatura.shader import shader
from velatura.shader.c_like import CLike
from velatura.shader.glsl import GLSL, Desktop, Vulkan
from velatura.shader.hlsl import Hlsl, Slang
from velatura.shader.wgsl import Wgsl

#: The language of each format.
PRINTERS: dict[str, CLike] = {
    "glsl": GLSL,
    "glsl450": Desktop(),
    "vulkan": Vulkan(),
    "hlsl": Hlsl(),
    "slang": Slang(),
    "wgsl": Wgsl(),
}


def write(request: Request) -> Export:
    """The shader; beside it the textures that it reads, little-endian floats in rows of RGBA."""
    made = shader(request.stack, request.model, request.constants, printer=PRINTERS[request.to])
    read = made.tables if made.looked_up else made.columns
    textures = {".tables.bin": read, ".films.bin": made.films}
    beside = {end: x.astype("<f4").tobytes() for end, x in textures.items() if x is not None}
    return Export(made.text, beside, {name: str(cost) for name, cost in made.costs.items()})
