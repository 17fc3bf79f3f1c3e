"""A material as engines light it in real time: what its modules and shaders for them share.

Lights are met by `vt_eval`, environments by the parts of `velatura.shader.prefiltered`; directions are in the frame of
`vt_frame_of`.
"""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import cos, sin
from typing import NamedTuple

import numpy as np

from velatura.errors import InvalidInput, remark
from velatura.exports.request import Export, Request, origin
from velatura.exports.shader import facts_of
from velatura.model.variance import Isotropic
from velatura.shader import Shader, prefiltered, shader
from velatura.shader.closures import shares
from velatura.shader.material import title
from velatura.shader.prefiltered import Prefiltered, Sums
from velatura.shader.printers.c_like import CLike
from velatura.shader.program import PREFIX, described
from velatura.shader.recorder import recording
from velatura.stack import Material, Varying

_DEFINED = re.compile(r"^\w+ (\w+)\(", re.MULTILINE)  # a function, whose definition begins a line


class Row(NamedTuple):
    """A row of texels over the cosine, one for each azimuth, in the texture of sums: nodes over the cosine and the
    azimuth, less 1; rows to that of light from below; the first row."""

    columns: int
    turns: int
    below: int
    first: int


class Part(NamedTuple):
    """A part of a stack: the side that it leaves on, 1 or -1 of the view's, and names of functions that give its energy
    and its blurs."""

    side: int
    energy: str
    blurs: Sequence[str]


class Leaf(NamedTuple):
    """A stack: cosine and sine of where its azimuths begin, the rows of its texels, and its parts, whose functions take
    these texels."""

    axis: Sequence[float]
    rows: Sequence[Row]
    parts: Sequence[Part]


@dataclass(frozen=True)
class Environment:
    """The parts of all stacks of a material, and the texture vt_parts of their sums, (height, width, 4).

    `functions` are by name, in GLSL: where texels lie, what parts are by them, and what a blur sees. `text` is the code
    of GLSL ES with them, which calls vt_blurred(direction, root of alpha).
    """

    text: str
    functions: Mapping[str, str]
    stacks: Sequence[Leaf]
    texture: np.ndarray

    @property
    def bare(self) -> Environment:
        """The same whose text has no comments."""
        return replace(self, text=_without_comments(self.text))


@dataclass(frozen=True)
class Lit:
    """A material in an engine: its shader; code of the model in a language, and of the frame in GLSL; textures by name,
    of shape (height, width, 4); whether both of its sides are seen."""

    shader: Shader
    language: str
    code: str
    frame: str
    textures: Mapping[str, np.ndarray]
    two_sided: bool

    @property
    def texture(self) -> str:
        """The name of its texture, if it has one, which is the only one."""
        return next(iter(self.textures), "")

    @cached_property
    def _readers(self) -> list[str]:
        """The names of functions of the code that read the texture, or call one that does."""
        code, readers = _without_comments(self.code), [self.texture]
        starts = list(_DEFINED.finditer(code))
        for start, end in zip(starts, [*(each.start() for each in starts[1:]), len(code)]):
            if re.search(rf"\b(?:{'|'.join(readers)})\b", code[start.end() : end]):
                readers.append(start[1])
        return readers[1:]

    def handed(self, text: str, argument: str) -> str:
        """The code, or calls of its functions, where these are given the texture, if there is one, which their
        definitions declare as an argument."""
        if not self.texture:
            return text

        def given(found: re.Match[str]) -> str:
            return f"{found[1] or ''}{found[2]}({argument if found[1] else self.texture}, "

        return re.sub(rf"(^\w+ )?\b({'|'.join(self._readers)})\(", given, text, flags=re.MULTILINE)

    @property
    def bare(self) -> Lit:
        """The same without comments, in which a preprocessor might read names of materials."""
        return replace(self, code=_without_comments(self.code), frame=_without_comments(self.frame))


def lit(request: Request, printer: CLike) -> Lit:
    """The parts of a material that a module for an engine holds, with the prefix that is asked for.

    Raises:
        InvalidInput: a material with textures.
    """
    varying = [address.name for address, value in request.material.values() if isinstance(value, Varying)]
    if varying:
        raise InvalidInput(f"{varying[0]}: {request.to} is written of uniform materials, without textures")
    prefix = request.options.get("prefix", PREFIX)
    made = shader(request.material, request.model, printer=printer, prefix=prefix, baking=True)
    stacks = [stack for _, stack in request.material.leaves()]
    brushed = any(recording.variance(stack) is not Isotropic for stack in stacks)
    return Lit(
        made,
        printer.language,
        made.text.replace(printer.first_lines, "", 1),
        _FRAME.format(tangent=_TANGENT if brushed else ""),
        {} if made.columns is None else {f"{prefix}_baked": made.columns},
        any(stack.transmits for stack in stacks),
    )


def environment(request: Request) -> Environment:
    """The light of a material without textures by an engine's environment."""
    leaves = zip(shares(request.material), request.material.leaves())
    parts = [(share, prefiltered.prefiltered(Material.of(leaf), request.model)) for share, (_, leaf) in leaves if share]
    azimuths = any(len(found.shape) > 1 for _, found in parts)
    functions = {
        "vt_place": _PLACE.format(azimuth=_AZIMUTH if azimuths else "    float azimuth = 0.0;\n"),
        "vt_at": _AT,
    }
    widest = max(found.shape[0] for _, found in parts)
    stacks, texels, first = list[Leaf](), [], 0
    for share, found in parts:
        sums = prefiltered.summed(found)
        count, sides, turns, cosines, _ = sums.texels.shape
        rows = [Row(cosines - 1, turns - 1, turns * (sides - 1), first + turns * sides * k) for k in range(count)]
        axis = [round(f(found.turn), 7) + 0.0 for f in (cos, sin)]
        stacks.append(Leaf(axis, rows, list(_parts(share, found, sums, functions))))
        own = sums.texels.reshape(-1, cosines, 4)
        texels.append(np.pad(own, ((0, 0), (0, widest - cosines), (0, 0))))
        first += len(own)
    functions |= {"vt_plane": _INCIDENCE, "vt_ray": _RAY}
    text = _ENVIRONMENT.format(functions="\n".join(functions.values()), stacks="\n".join(map(_statement, stacks)))
    return Environment(text, functions, stacks, np.concatenate(texels))


def _parts(share: float, found: Prefiltered, sums: Sums, functions: dict[str, str]) -> Iterator[Part]:
    """The parts of a stack of a share, whose functions are added to others."""
    for passes, (energy, *seen) in zip(found.passes, sums.factors):
        number = sum(name.startswith("vt_energy_") for name in functions)
        names = [f"vt_energy_{number}", *(f"vt_blur_{number}_{k}" for k in range(len(seen)))]
        for name, factors in zip(names, [share * energy, *seen]):
            functions[name] = _sum(name, factors)
        yield Part(-1 if passes else 1, names[0], names[1:])


def _sum(name: str, factors: np.ndarray) -> str:
    """A function of GLSL that gives four numbers by texels; their factors (4, 4 T + 1)."""
    *of_texels, added = np.split(np.round(factors, 9) + 0.0, range(4, factors.shape[1], 4), axis=1)

    def number(k: int) -> str:
        terms = [
            f"dot(vec4({', '.join(map(_float, own[k]))}), t{texel})"
            for texel, own in enumerate(of_texels)
            if own[k].any()
        ]
        return " + ".join([*terms, _float(added[k, 0])])

    arguments = ", ".join(f"vec4 t{texel}" for texel in range(len(of_texels)))
    value = ",\n        ".join(map(number, range(4)))
    return f"vec4 {name}({arguments}) {{\n    return vec4(\n        {value});\n}}\n"


def _float(x: float) -> str:
    return repr(float(f"{x:.6g}"))


def _statement(leaf: Leaf) -> str:
    """A statement of GLSL that adds a stack."""
    lines = [f"vec3 place = vt_place(wi, vec2({', '.join(map(str, leaf.axis))}));"]
    texels = ", ".join(f"t{k}" for k in range(len(leaf.rows)))
    for k, row in enumerate(leaf.rows):
        lines.append(f"vec4 t{k} = vt_texel(vt_at(vec4({', '.join(f'{x}.0' for x in row)}), place));")
    for part in leaf.parts:
        seen = " + ".join(f"vt_light({blur}({texels}), wi, plane, {part.side}.0)" for blur in part.blurs)
        lines.append(f"sum += max({part.energy}({texels}).rgb, 0.0) * ({seen});")
    return "\n".join(["    {", *(f"        {line}" for line in lines), "    }"])


def _without_comments(code: str) -> str:
    return re.sub(r"\n\s*\n+", "\n", re.sub(r"[ \t]*//[^\n]*", "", code))


def halves(texels: np.ndarray) -> str:
    """A texture as halves of floats, in base64."""
    return base64.b64encode(np.ascontiguousarray(texels, "<f2").tobytes()).decode()


# Modules of JavaScript -----------------------------------------------------------------------------------------------


def module(template: str, request: Request, made: Lit, around: Environment, maker: str, **own: str) -> Export:
    """A module by its template, which exports `code` and a `maker` of materials; it holds its textures, as halves of
    floats. `own` are fields of this template alone."""
    text = template.format(
        name=remark(title(request.material)),
        model=described(request.model),
        origin=origin(),
        title=_string(title(request.material)),
        code=_literal(made.code),
        frame=_literal(made.frame),
        environment=_literal(around.text),
        functions="".join(f"const {name} = `\n{_literal(text)}\n`;\n" for name, text in around.functions.items()),
        unpacked=_UNPACKED,
        textures="".join(
            _stored(name, texels) for name, texels in {"vt_parts": around.texture, **made.textures}.items()
        ),
        **own,
    )
    facts = facts_of(made.shader, made.language, request.folder)
    return Export(text, facts={**facts, "exports": [maker, "code"]})


def _stored(name: str, texels: np.ndarray) -> str:
    """A texture as an entry of an object, with width, height and data."""
    return f"  {name}: [{texels.shape[1]}, {texels.shape[0]}, '{halves(texels)}'],\n"


def _literal(text: str) -> str:
    """A text within a template literal."""
    return text.replace("\\", "\\\\").replace("`", "\\`").replace("${", "\\${").strip("\n")


def _string(text: str) -> str:
    """A string of JavaScript, without trigraphs for those who read it as C."""
    return json.dumps(text, ensure_ascii=False).replace("?", "\\u003f")


_FRAME = """\
// Columns are the tangent, the bitangent, and the normal outwards, in the engine's coordinates; of a normal, a place
// and its texture coordinate. hand is -1 where coordinates are left-handed
mat3 vt_frame_of(vec3 n, vec3 p, vec2 uv, float hand) {{
    vec3 t = vec3(0.0);
{tangent}    if (dot(t, t) < 1e-20) {{
        t = cross(mix(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), step(abs(n.y), 0.9)), n);
    }}
    t = normalize(t);
    return mat3(t, hand * cross(n, t), n);
}}
"""

_TANGENT = """\
    // Along the first texture coordinate
    vec3 px = dFdx(p);
    vec3 py = dFdy(p);
    vec2 u = dFdx(uv);
    vec2 v = dFdy(uv);
    t = (px * v.y - py * u.y) * sign(u.x * v.y - u.y * v.x);
    t -= dot(t, n) * n;
"""

_ENVIRONMENT = """\
// The material's parts by the environment: of each its energy, and its blurs. Of a blur how far it leaves beyond the
// mirror's direction, in the plane of incidence and beside it; root of alpha; share. They are sums of what texels hold
uniform highp sampler2D vt_parts;

vec4 vt_texel(vec2 texel) {{
    return textureLod(vt_parts, texel / vec2(textureSize(vt_parts, 0)), 0.0);
}}

{functions}
vec3 vt_light(vec4 blur, vec3 wi, vec2 plane, float side) {{
    vec4 ray = vt_ray(blur, wi, plane, side);
    return blur.w * vt_blurred(ray.xyz, ray.w);
}}

// Light from wi by the environment that vt_blurred gives
vec3 vt_environment(vec3 wi) {{
    vec2 plane = vt_plane(wi);
    vec3 sum = vec3(0.0);
{stacks}
    return sum;
}}
"""

_PLACE = """\
// Where parts for light from wi lie: over the cosine, over the azimuth from an axis, and whether from below
vec3 vt_place(vec3 wi, vec2 axis) {{
{azimuth}    return vec3(sqrt(abs(wi.z)), azimuth, 1.0 - step(0.0, wi.z));
}}
"""

_AZIMUTH = """\
    vec2 turned = vec2(dot(axis, wi.xy), axis.x * wi.y - axis.y * wi.x);
    vec2 twice = vec2(turned.x * turned.x - turned.y * turned.y + 1e-15, 2.0 * turned.x * turned.y);
    float along = twice.x / (abs(twice.x) + abs(twice.y));
    float azimuth = 0.25 * mix(3.0 + along, 1.0 - along, step(0.0, twice.y));
"""

_AT = """\
// The place in texels; of rows the nodes over the cosine and the azimuth, less 1, rows to that from below, the first
vec2 vt_at(vec4 rows, vec3 place) {
    return vec2(0.5 + rows.x * place.x, 0.5 + rows.y * place.y + rows.z * place.z + rows.w);
}
"""

_INCIDENCE = """\
// The direction of the plane of incidence along the surface
vec2 vt_plane(vec3 wi) {
    float sine2 = dot(wi.xy, wi.xy);
    return mix(vec2(1.0, 0.0), wi.xy / sqrt(max(sine2, 1e-12)), step(1e-12, sine2));
}
"""

_RAY = """\
// The direction that a blur sees, on a side of the view's, and the root of alpha
vec4 vt_ray(vec4 blur, vec3 wi, vec2 plane, float side) {
    vec2 across = vec2(plane.x * blur.x - plane.y * blur.y, plane.y * blur.x + plane.x * blur.y) - wi.xy;
    float up = sqrt(max(1.0 - dot(across, across), 0.0));
    return vec4(across, side * sign(wi.z) * up, blur.z);
}
"""

#: Functions by name, in GLSL, each of which calls those before it: how much a rectangle lights a blur.
RECTANGLE = {
    "vt_edge": """\
// What the edge between two directions adds to the light of a polygon that shines with 2 pi (Lambert's formula)
float vt_edge(vec3 a, vec3 b) {
    vec3 n = cross(a, b);
    float sine = length(n);
    float angle = acos(clamp(dot(a, b), -1.0, 1.0));
    return n.z * mix(1.0, angle / max(sine, 1e-6), step(0.02, sine));
}
""",
    "vt_edge_above": """\
// The same, where what lies below the horizon is brought up to it
float vt_edge_above(vec3 a, vec3 b) {
    vec3 cut = mix(a, b, clamp(a.z / (a.z - b.z + 1e-20), 0.0, 1.0));
    vec3 up = vec3(1.0, 1.0, 0.0);
    vec3 first = normalize(max(a, a * up));
    vec3 last = normalize(max(b, b * up));
    vec3 between = normalize(max(cut, cut * up));
    return vt_edge(first, between) + vt_edge(between, last);
}
""",
    "vt_rectangle": """\
// The share that a rectangle has of the lobe of GGX whose normal, view and mirror direction w agree, nearly that of a
// linearly transformed cosine (Heitz, Dupuy, Hill and Neubelt, doi.org/10.1145/2897824.2925895). It shines to the side
// of -cross(u, v), by halves of its sides
float vt_rectangle(vec3 w, vec3 middle, vec3 u, vec3 v, float roughness) {
    float alpha = max(roughness * roughness, 1e-3);
    float stretch = 2.0 * alpha / (1.0 + pow(alpha, 1.25));
    vec3 t = normalize(cross(mix(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), step(abs(w.y), 0.9)), w));
    mat3 to_cosine = transpose(mat3(t, cross(w, t), stretch * w));
    vec3 a = to_cosine * (middle + u + v);
    vec3 b = to_cosine * (middle - u + v);
    vec3 c = to_cosine * (middle - u - v);
    vec3 d = to_cosine * (middle + u - v);
    float sum = vt_edge_above(a, b) + vt_edge_above(b, c) + vt_edge_above(c, d) + vt_edge_above(d, a);
    return step(0.0, dot(cross(u, v), middle)) * max(sum, 0.0) / 6.2831853;
}
""",
}

_UNPACKED = """\
/** The textures of the module: names with width, height and halves of floats. */
function unpacked() {
  return Object.entries(stored).map(([name, [width, height, data]]) => {
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    return [name, width, height, new Uint16Array(bytes.buffer)];
  });
}
"""
