"""A material as a shader: what is recorded, printed with all that it needs."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from velatura.model import DEFAULT, SWITCHES, Model, named
from velatura.model.lobe_merging import merging
from velatura.shader import atlas, glsl, material
from velatura.shader.bake import Bake
from velatura.shader.recording import SHOWN, Recording, part, record
from velatura.shader.symbol import Kind, Operand, Symbol
from velatura.stack import MaterialLike, Texture, load


@dataclass(frozen=True)
class Shader:
    """GLSL ES 3.00, the texture of tables that it reads (float32, shape (height, width, 4)), and its uniforms.

    `uniforms` are the values that the struct of the material holds, or that `baked` reads: flat names (`layer0_eta`)
    and where they lie in the struct (`layer0.eta`). `maps` are the textures of the material by sampler.

    Where values are parameters: `shown` names the lobes that `vt_shown` weighs, in order, and `baked` is what works out
    the lobes for the texture `vt_baked`, None where a texture makes them differ from point to point.
    `lobes` are the layers whose light each reflected lobe is, seen from above.
    """

    text: str
    tables: np.ndarray
    uniforms: Mapping[str, str]
    maps: Mapping[str, Texture]
    lobes: Sequence[Sequence[int]]
    shown: Sequence[str]
    baked: Bake | None

    @cached_property
    def key(self) -> str:
        """Equal for equal code."""
        tape = self.baked.tape if self.baked else None
        return hashlib.sha256(f"{self.text}{tape}".encode()).hexdigest()[:16]


def shader(
    stack: MaterialLike,
    model: str | Model = DEFAULT,
    constant: Collection[str] = (),
    values: Literal["literals", "uniforms"] = "literals",
    **switches: str,
) -> Shader:
    """A material as GLSL ES 3.00: the structs `VtMaterial` and `VtLobes`, and functions on them.

    Args:
        stack: a material (a stack, a file, or a preset's name). Its kinds of layers make the code; its values go into
            `vt_material`, which gives them.
        constant: flat names of values that never change, which are worked out now and are not in the struct.
        values: plain values as `literals`, or as `uniforms` that a user changes; then the code is the same for all
            of them, be roughnesses equal or not, and lobes are drawn once for a change, and read.

    Raises:
        InvalidInput: as `record`.
    """
    stack = load(stack)
    recording = record(stack, model, constant, values == "uniforms", **switches)
    baked, read = recording.baked, recording.read
    texture, tables = _tables(recording.symbols)
    name = "A material" if recording.shown else " ".join(stack.name.split()) or "A material"
    structs = material.structs(stack, list(read))
    parameters = f"uniform VtMaterial {material.PARAMETERS};\n"
    parts = [
        _HEADER.format(name=name, model=_described(recording.model)) + _PRECISION,
        structs,
        *([parameters, f"uniform float {SHOWN}[{len(recording.shown)}];\n"] if recording.shown else []),
        material.filled(stack, list(read), bool(recording.shown)),
        _lobes_struct(recording),
        *tables,
        *([baked.reading()] if baked else []),
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
    return Shader(
        text="\n".join(parts),
        tables=texture,
        uniforms=recording.parameters,
        maps={sampler: image for image, sampler in material.maps(stack, list(read)).items()},
        lobes=_interfaces(recording),
        shown=recording.shown,
        baked=baked,
    )


def _tables(symbols: Sequence[Symbol]) -> tuple[np.ndarray, list[str]]:
    """The texture of tables, and what declares and reads it."""
    looked_up = {symbol.detail for symbol in symbols if symbol.op in ("texels", "value")}
    texture, readers = atlas.pack(looked_up)
    return texture, [_TABLES.format(*texture.shape[1::-1]), atlas.HELPERS + readers] if looked_up else []


def _interfaces(recording: Recording) -> list[list[int]]:
    """By reflected lobe, seen from above: the layers whose light it is."""
    places = [i for i, kind in enumerate(recording.stack.kinds) if kind not in ("medium", "diffuse")]
    return [[places[k] for k in group] for group in merging(recording.model, len(places))]


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

_PRECISION = """\
precision highp float;
precision highp int;
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

"""


def _described(model: Model) -> str:
    """The name of a model, with the switches that were changed."""
    shipped = named(model.name)
    changed = [f"{key}={getattr(model, key)}" for key in SWITCHES if getattr(model, key) != getattr(shipped, key)]
    return " ".join([model.name, *([f"({', '.join(changed)})"] if changed else [])])


def _lobes_struct(recording: Recording) -> str:
    """The struct of all that is known once wi is."""
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
    return glsl.block("VtLobes vt_lobes(VtMaterial m, vec3 wi)", [*lines, "", "VtLobes l;", *assigned, "return l;"])


def _function(head: str, outputs: Sequence[tuple[Operand, Kind]], result: str) -> str:
    lines, texts = glsl.statements(outputs)
    return glsl.block(head, [*lines, f"return {result.format(*texts)};"])
