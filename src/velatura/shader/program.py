"""A material as a shader: what is recorded, printed with all that it needs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from velatura.model import DEFAULT, SWITCHES, Model, named
from velatura.shader import atlas, glsl, material
from velatura.shader.recording import Recording, part, record
from velatura.shader.symbol import Kind, Operand
from velatura.stack import Stack


@dataclass(frozen=True)
class Shader:
    """GLSL ES 3.00, the texture of tables that it reads (float32, shape (height, width, 4)), and its uniforms.

    `uniforms` are the values that the struct of the material holds: flat names (`layer0_eta`) and where they lie in
    the struct (`layer0.eta`).
    """

    text: str
    tables: np.ndarray
    uniforms: Mapping[str, str]


def shader(stack: Stack, model: str | Model = DEFAULT, constant: Collection[str] = (), **switches: str) -> Shader:
    """A stack as GLSL ES 3.00: the structs `VtMaterial` and `VtLobes`, and functions on them.

    Args:
        stack: its kinds of layers make the code; its values go into `vt_material`, which gives them.
        constant: flat names of values that never change, which are worked out now and are not in the struct.

    Raises:
        InvalidInput: as `record`.
    """
    recording = record(stack, model, constant, **switches)
    read = recording.read
    looked_up = {symbol.detail for symbol in recording.symbols if symbol.op in ("texels", "value")}
    texture, readers = atlas.pack(looked_up)
    parts = [
        _HEADER.format(name=" ".join(stack.name.split()) or "A material", model=_described(recording.model)),
        material.structs(stack, list(read)),
        material.filled(stack, list(read)),
        _lobes_struct(recording),
        *([_TABLES.format(*texture.shape[1::-1]), atlas.HELPERS + readers] if looked_up else []),
        glsl.HELPERS,
        _lobes(recording),
        _function(
            "vec4 vt_eval_pdf(VtMaterial m, VtLobes l, vec3 wi, vec3 wo)",
            [(recording.value, "colour"), (recording.density, "number")],
            "vec4({}, {})",
        ),
        _WRAPPERS,
        _function(
            "vec3 vt_sample(VtMaterial m, VtLobes l, vec3 wi, vec3 u)",
            [(w, "number") for w in recording.drawn],
            "vec3({}, {}, {})",
        ),
    ]
    return Shader("\n".join(parts), texture, read)


_WRAPPERS = """\
// f(wi, wo) |cos theta_o|
vec3 vt_eval(VtMaterial m, VtLobes l, vec3 wi, vec3 wo) {
    return vt_eval_pdf(m, l, wi, wo).rgb;
}

// Density of vt_sample, per solid angle
float vt_pdf(VtMaterial m, VtLobes l, vec3 wi, vec3 wo) {
    return vt_eval_pdf(m, l, wi, wo).a;
}
"""


_TABLES = """\
// Averages of Fresnel over rough interfaces: RGBA32F, {} x {} texels, never filtered.
// `velatura export -o` writes them beside this text, row by row.
uniform highp sampler2D vt_tables;
"""

_HEADER = """\
// {name} as the model {model} has it; GLSL ES 3.00, written by Velatura.
//
//     VtMaterial m = vt_material(uv);        // or from uniforms, or your own textures
//     VtLobes l = vt_lobes(m, wi);           // once for a direction of view
//     vec4 f = vt_eval_pdf(m, l, wi, wo);    // f(wi, wo) |cos theta_o|, and the density of vt_sample
//     vec3 wo = vt_sample(m, l, wi, u);      // from three uniform numbers; f may be 0 there
//
// Directions have length 1 and point away from the surface, in its frame: x along the tangent, z the normal.

precision highp float;
precision highp int;
"""


def _described(model: Model) -> str:
    """The name of a model, with the switches that were changed."""
    shipped = named(model.name)
    changed = [f"{key}={getattr(model, key)}" for key in SWITCHES if getattr(model, key) != getattr(shipped, key)]
    return " ".join([model.name, *([f"({', '.join(changed)})"] if changed else [])])


def _lobes_struct(recording: Recording) -> str:
    """What is known once wi is."""
    count = sum(name.startswith("reflected") and name.endswith("energy") for name in recording.kinds)
    parts = {part(name): kind for name, kind in recording.kinds.items() if "." in name}
    members = [f"VtLobe reflected[{count}];"] if count else []
    members += ["VtLobe transmitted;"] if "transmitted.energy" in recording.kinds else []
    members += [f"vec3 {name};" for name in recording.kinds if "." not in name]
    lobe = material.struct(
        "VtLobe", [f"{glsl.TYPES[kind]} {name};" for name, kind in parts.items()], "rotation in radians"
    )
    return lobe + material.struct("VtLobes", members, "of light from one direction")


def _lobes(recording: Recording) -> str:
    lines, texts = glsl.statements([(value, recording.kinds[name]) for name, value in recording.lobes.items()])
    assigned = [f"l.{name} = {text};" for name, text in zip(recording.lobes, texts)]
    return _block("VtLobes vt_lobes(VtMaterial m, vec3 wi)", [*lines, "", "VtLobes l;", *assigned, "return l;"])


def _function(head: str, outputs: Sequence[tuple[Operand, Kind]], result: str) -> str:
    lines, texts = glsl.statements(outputs)
    return _block(head, [*lines, f"return {result.format(*texts)};"])


def _block(head: str, lines: Sequence[str]) -> str:
    return "\n".join([f"{head} {{", *(f"    {line}".rstrip() for line in lines), "}", ""])
