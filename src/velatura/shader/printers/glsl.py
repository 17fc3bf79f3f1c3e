"""GLSL: ES 3.00, 4.50 for the desktop, and 4.50 for Vulkan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from velatura.shader.printers.c_like import SAMPLER, VALUES, CLike
from velatura.shader.printers.printer import ATOM
from velatura.shader.recorder.cost import Cost

_COMPARE = {"less": "lessThan", "greater": "greaterThan", "at_most": "lessThanEqual", "at_least": "greaterThanEqual"}


@dataclass(frozen=True)
class Glsl(CLike):
    """GLSL ES 3.00, which WebGL 2 reads."""

    language: ClassVar[str] = "GLSL ES 3.00"
    first_lines: ClassVar[str] = "precision highp float;\nprecision highp int;\n"
    functions = {**CLike.functions, "arctan2": "atan"}  # noqa: RUF012

    def listed(self, kind: str, values: Sequence[str]) -> str:
        return f"{self.type(kind)}[{len(values)}]({', '.join(values)})"

    def texture(self, name: str, place: int) -> str:
        return f"uniform highp sampler2D {name};\n"

    def filtered(self, name: str) -> str:
        return f"texture({name}, uv)"

    def uniforms(self, material: str, arrays: Sequence[tuple[str, str, int]]) -> str:
        declared = (f"uniform {kind} {name}[{length}];\n" for kind, name, length in arrays)
        return f"uniform VtMaterial {material};\n\n{''.join(declared)}"

    # Values

    def each_channel(self, op: str, a: str, b: str) -> str:
        return f"{_COMPARE[op]}({a}, {b})" if op in _COMPARE else super().each_channel(op, a, b)

    def select(self, condition: str, a: str, b: str) -> tuple[str, int]:
        return f"vt_choice({condition}, {a}, {b})", ATOM

    def select_channels(self, conditions: str, a: str, b: str) -> str:
        return f"mix({b}, {a}, {conditions})"

    helping = {  # noqa: RUF012
        "Without branches, for which compilers for processors write long code": {
            (("select", "number"),): "float vt_choice(bool where, float a, float b) { return mix(b, a, where); }\n",
            (("select", "colour"),): "vec3 vt_choice(bool where, vec3 a, vec3 b) { return mix(b, a, bvec3(where)); }\n",
            (
                ("select", "condition"),
            ): "bool vt_choice(bool where, bool a, bool b) { return (where && a) || (!where && b); }\n",
        },
    }


@dataclass(frozen=True)
class Desktop(Glsl):
    """GLSL 4.50, with a binding for each texture."""

    language: ClassVar[str] = "GLSL 4.50"
    first_lines: ClassVar[str] = ""

    def texture(self, name: str, place: int) -> str:
        return f"{self.bound(name, place)} uniform sampler2D {name};\n"

    def bound(self, name: str, place: int) -> str:
        """Where a resource is bound, by a macro that has a default."""
        macro = f"VT_{name.removeprefix('vt_').upper()}_BINDING"
        default = f"#ifndef {macro}\n#define {macro} {self.binding + place}\n#endif\n"
        return f"{default}layout({self.qualifiers(macro)})"

    def qualifiers(self, macro: str) -> str:
        return f"binding = {macro}"


@dataclass(frozen=True)
class Vulkan(Desktop):
    """GLSL 4.50 for Vulkan, with textures apart from what filters them, and no uniform outside a block."""

    language: ClassVar[str] = "GLSL 4.50 for Vulkan"
    first_lines: ClassVar[str] = "#extension GL_EXT_samplerless_texture_functions : require\n"

    def texture(self, name: str, place: int) -> str:
        return f"{self.bound(name, place)} uniform texture2D {name};\n"

    def sampler(self) -> str:
        return f"{self.bound('vt_sampler', SAMPLER)} uniform sampler vt_sampler;\n"

    def filtered(self, name: str) -> str:
        return f"texture(sampler2D({name}, vt_sampler), uv)"

    def uniforms(self, material: str, arrays: Sequence[tuple[str, str, int]]) -> str:
        members = [f"    {kind} {name}[{length}];" for kind, name, length in arrays]
        head = f"{self.bound(material, VALUES)} uniform VtParameters {{"
        return "\n".join([head, f"    VtMaterial {material};", *members, "};", ""])

    def qualifiers(self, macro: str) -> str:
        return f"set = VT_SET, {super().qualifiers(macro)}"

    def header(self, name: str, model: str, fixed: bool, costs: Mapping[str, Cost]) -> str:
        return f"{super().header(name, model, fixed, costs)}#ifndef VT_SET\n#define VT_SET {self.group}\n#endif\n"


#: The language that shaders are printed in by default.
GLSL = Glsl()
