"""HLSL and Slang."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from velatura.shader.printers.c_like import SAMPLER, VALUES, CLike
from velatura.shader.printers.printer import ATOM

_NUMBERS = {"": "float", "i": "int", "b": "bool"}
_WORDS = {"mix": "lerp"} | {f"{short}vec{n}": f"{name}{n}" for short, name in _NUMBERS.items() for n in (2, 3, 4)}
_WORD = re.compile(rf"\b({'|'.join(_WORDS)})\b")
_FETCH = re.compile(r"texelFetch\((\w+), (.+?), 0\)")
_CHOICE = 1  # how strongly it binds


@dataclass(frozen=True)
class Hlsl(CLike):
    """HLSL of shader model 5 and later."""

    language: ClassVar[str] = "HLSL"

    def spelled(self, text: str) -> str:
        return _WORD.sub(lambda word: _WORDS[word[1]], _FETCH.sub(r"\1.Load(int3(\2, 0))", text))

    def listed(self, kind: str, values: Sequence[str]) -> str:
        return f"{{{', '.join(values)}}}"

    def texture(self, name: str, place: int) -> str:
        return self.bound(f"Texture2D<float4> {name}", f"t{self.binding + place}") + ";\n"

    def sampler(self) -> str:
        """How textures are filtered: as pixels of pictures are, unless a program says otherwise."""
        declared = self.bound("SamplerState vt_sampler", f"s{self.binding + SAMPLER}")
        return f"{declared};\n#ifndef VT_SAMPLE\n#define VT_SAMPLE(map, uv) map.Sample(vt_sampler, uv)\n#endif\n"

    def filtered(self, name: str) -> str:
        return f"VT_SAMPLE({name}, uv)"

    def uniforms(self, material: str, arrays: Sequence[tuple[str, str, int]]) -> str:
        members = [f"    {self.type(kind)} {name}[{length}];" for kind, name, length in arrays]
        head = self.bound("cbuffer vt_values", f"b{self.binding + VALUES}")
        return "\n".join([f"{head} {{", f"    VtMaterial {material};", *members, "};", ""])

    def bound(self, declared: str, register: str) -> str:
        """A declaration with its register, a macro that has a default."""
        macro = f"VT_{declared.rpartition('vt_')[2].upper()}_REGISTER"
        default = f"#ifndef {macro}\n#define {macro} {register}, space{self.group}\n#endif\n"
        return f"{default}{declared} : register({macro})"

    # Values

    def colour(self, channels: Sequence[str]) -> str:
        return f"(float3)({channels[0]})" if len(channels) == 1 else super().colour(channels)

    def counter(self, array: str) -> str:
        """Another one for each array, since a counter stays declared after its loop."""
        return f"texel_of_{array}"

    def select(self, condition: str, a: str, b: str) -> tuple[str, int]:
        return f"{condition} ? {a} : {b}", _CHOICE

    def select_channels(self, conditions: str, a: str, b: str) -> str:
        return f"vt_choice({conditions}, {a}, {b})"

    helping = {  # noqa: RUF012
        "For each channel": {
            (("select", "colour"),): (
                "vec3 vt_choice(bvec3 where, vec3 a, vec3 b) {\n"
                "    return vec3(where.x ? a.x : b.x, where.y ? a.y : b.y, where.z ? a.z : b.z);\n"
                "}\n"
            ),
        },
    }


@dataclass(frozen=True)
class Slang(Hlsl):
    """Slang."""

    language: ClassVar[str] = "Slang"

    def select(self, condition: str, a: str, b: str) -> tuple[str, int]:
        return f"select({condition}, {a}, {b})", ATOM

    def select_channels(self, conditions: str, a: str, b: str) -> str:
        return f"select({conditions}, {a}, {b})"

    helping = {}  # noqa: RUF012
