"""A material as shader code, and the texture that it reads."""

from __future__ import annotations

from pathlib import Path

from velatura.exports.request import Export, Request, headed
from velatura.shader import shader
from velatura.shader.printers.c_like import CLike
from velatura.shader.printers.glsl import Desktop, Glsl, Vulkan
from velatura.shader.printers.hlsl import Hlsl, Slang
from velatura.shader.printers.wgsl import Wgsl
from velatura.shader.program import PREFIX

#: The language of each format.
LANGUAGES: dict[str, type[CLike]] = {
    "glsl": Glsl,
    "glsl450": Desktop,
    "vulkan": Vulkan,
    "hlsl": Hlsl,
    "slang": Slang,
    "wgsl": Wgsl,
}


def write(request: Request) -> Export:
    """The shader; beside it the textures that it reads, little-endian floats, or halves of them, in rows of RGBA."""
    options = request.options
    half, shared = options.get("half", False), options.get("tables")
    printer = LANGUAGES[request.to](options.get("group", 0), options.get("binding", 0), half)
    prefix = options.get("prefix", PREFIX)
    made = shader(
        request.material,
        request.model,
        request.constants,
        printer=printer,
        prefix=prefix,
        shared=shared is not None,
        baking=options.get("baked", False),
    )

    # Write its textures
    read = made.tables if made.looked_up else made.columns
    textures = {".tables.bin": read, ".films.bin": made.films}
    beside = {end: x.astype("<f2" if half else "<f4").tobytes() for end, x in textures.items() if x is not None}
    apart = {Path(shared): beside.pop(".tables.bin")} if shared is not None and made.looked_up else {}
    notes = (f"{shared}: not written, since this code reads no tables that materials share",)
    costs = {name: str(cost) for name, cost in made.costs.items()}
    return Export(headed(made.text), beside, costs, notes if shared is not None and not apart else (), apart)
