"""A material as shader code, and the texture that it reads."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from velatura.exports.request import Export, Request, Stored, headed, relative
from velatura.shader import Shader, shader
from velatura.shader.printers.c_like import CLike
from velatura.shader.printers.glsl import Desktop, Glsl, Vulkan
from velatura.shader.printers.hlsl import Hlsl, Slang
from velatura.shader.printers.wgsl import Wgsl
from velatura.shader.program import PREFIX, described

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
    arrays = {".tables.bin": read, ".films.bin": made.films}
    beside = {end: x.astype("<f2" if half else "<f4").tobytes() for end, x in arrays.items() if x is not None}
    files: dict[str, str | Path] = {end: end for end in beside}
    apart = {}
    if shared is not None and made.looked_up:
        files[".tables.bin"] = Path(shared)
        apart = {Path(shared): beside.pop(".tables.bin")}
    names = {".tables.bin": "tables" if made.looked_up else "baked", ".films.bin": "films"}
    textures = [
        Stored(f"{prefix}_{names[end]}", file, array.shape[1], array.shape[0], "RGBA16F" if half else "RGBA32F")
        for end, file in files.items()
        if (array := arrays[end]) is not None
    ]

    notes = (f"{shared}: not written, since this code reads no tables that materials share",)
    return Export(
        headed(made.text),
        beside,
        costs={name: str(cost) for name, cost in made.costs.items()},
        notes=notes if shared is not None and not apart else (),
        apart=apart,
        facts=facts_of(made, printer.language, request.folder),
        textures=textures,
    )


def facts_of(made: Shader, language: str, folder: Path | None) -> dict[str, Any]:
    """The language, the models that the code is of, its functions with their costs, the values of the struct, and the
    images that samplers read."""
    return {
        "language": language,
        "drawn_by": list(dict.fromkeys(described(part.recording.model) for part in made.parts)),
        "entry_points": {name: asdict(cost) for name, cost in made.costs.items()},
        "uniforms": dict(made.uniforms),
        "images": {
            name: {"file": relative(image.texture, folder), "encoding": image.encoding}
            for name, image in made.maps.items()
        },
    }
