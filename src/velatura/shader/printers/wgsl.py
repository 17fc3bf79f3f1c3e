"""WGSL, the language of WebGPU."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from velatura.shader.material import PARAMETERS
from velatura.shader.printers.c_like import SAMPLER, VALUES, CLike
from velatura.shader.printers.printer import ATOM, Field
from velatura.shader.recorder.symbol import LAYOUT, REMAINDER, SHOWN

_TYPES = {"float": "f32", "int": "i32", "bvec3": "vec3<bool>", "mat3": "mat3x3f"}
_TYPES |= {f"{short}vec{n}": f"vec{n}{end}" for short, end in (("", "f"), ("i", "i")) for n in (2, 3, 4)}
_WORDS = _TYPES | {"texelFetch": "textureLoad", "dFdx": "dpdx", "dFdy": "dpdy"}
_WORD = re.compile(rf"\b({'|'.join(_WORDS)})\b")
_TYPE = rf"(?:{'|'.join(_TYPES)}|bool|Vt\w+)"
_FUNCTION = re.compile(rf"^({_TYPE}) (\w+)\((.*?)\) (?=\{{)", re.MULTILINE)
_ARGUMENT = re.compile(rf"({_TYPE}) (\w+)")
_DECLARED = re.compile(rf"\b{_TYPE} (\w+) = ")


@dataclass(frozen=True)
class Wgsl(CLike):
    """WGSL; numbers of bindings are in the text, since it has no macros."""

    language: ClassVar[str] = "WGSL"

    def spelled(self, text: str) -> str:
        def function(found: re.Match[str]) -> str:
            arguments = _ARGUMENT.sub(r"\2: \1", found[3])
            return f"fn {found[2]}({arguments}) -> {found[1]} "

        text = _DECLARED.sub(r"var \1 = ", _FUNCTION.sub(function, text))
        return _WORD.sub(lambda word: _WORDS[word[1]], text)

    def declared(self, kind: str, name: str, text: str = "") -> str:
        return f"let {name} = {text};" if text else f"var {name}: {self.type(kind)};"

    def variable(self, kind: str, name: str, text: str) -> str:
        return f"var {name} = {text};" if text else self.declared(kind, name)

    def array(self, kind: str, name: str, values: Sequence[str] | int, constant: bool = False) -> str:
        if isinstance(values, int):
            return f"var {name}: array<{self.type(kind)}, {values}>;"
        return f"var {name} = {self.listed(kind, values)};"

    def listed(self, kind: str, values: Sequence[str]) -> str:
        return f"array<{self.type(kind)}, {len(values)}>({', '.join(values)})"

    def members(self, fields: Sequence[Field]) -> list[str]:
        return [f"    {name}: {self._member(kind, length)}," for name, kind, length in fields]

    def _member(self, kind: str, length: int) -> str:
        return f"array<{self.type(kind)}, {length}>" if length else self.type(kind)

    def texture(self, name: str, place: int) -> str:
        return f"{self._bound(place)} var {name}: texture_2d<f32>;\n"

    def sampler(self) -> str:
        """How textures are filtered: as pixels of pictures are."""
        return f"{self._bound(SAMPLER)} var vt_sampler: sampler;\n\n{_FILTERED}"

    def filtered(self, name: str) -> str:
        return f"vt_filtered({name}, uv)"

    def uniforms(self, material: str, arrays: Sequence[tuple[str, str, int]]) -> str:
        """A buffer, since arrays of numbers in uniforms take four times the room."""
        fields = [Field("material", "VtMaterial"), *(Field(name, kind, length) for kind, name, length in arrays)]
        lines = "\n".join(["struct VtParameters {", *self.members(fields), "}", ""])
        return f"{lines}{self._bound(VALUES)} var<storage, read> {material}: VtParameters;\n"

    def _bound(self, place: int) -> str:
        return f"@group({self.group}) @binding({self.binding + place})"

    # Values

    def input(self, place: str) -> str:
        if place == PARAMETERS:
            return f"{PARAMETERS}.material"
        return f"{PARAMETERS}.{place}" if place.startswith((SHOWN, REMAINDER, LAYOUT)) else place

    def each_channel(self, op: str, a: str, b: str) -> str:
        return f"(({a}) & ({b}))" if op == "both" else super().each_channel(op, a, b)

    def select(self, condition: str, a: str, b: str) -> tuple[str, int]:
        return f"select({b}, {a}, {condition})", ATOM

    def select_channels(self, conditions: str, a: str, b: str) -> str:
        return self.select(conditions, a, b)[0]

    helping = {}  # noqa: RUF012


_FILTERED = """\
// In stages without derivatives: textureSampleLevel(map, vt_sampler, uv, 0.0)
fn vt_filtered(map: texture_2d<f32>, uv: vec2f) -> vec4f {
    return textureSample(map, vt_sampler, uv);
}

"""
