"""A material as engines light it in real time: what its modules and shaders for them share.

Lights are met by `vt_eval`, environments by the parts of `velatura.shader.prefiltered`; directions are in the frame of
`vt_frame_of`.
"""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from velatura.errors import InvalidInput, remark
from velatura.exports.request import Export, Request, origin
from velatura.exports.shader import facts_of
from velatura.model.variance import Isotropic
from velatura.shader import Shader, prefiltered, shader
from velatura.shader.closures import shares
from velatura.shader.material import title
from velatura.shader.prefiltered import Prefiltered
from velatura.shader.printers.c_like import CLike
from velatura.shader.printers.glsl import Glsl
from velatura.shader.program import PREFIX, described
from velatura.shader.recorder import recording
from velatura.stack import Material, Varying


@dataclass(frozen=True)
class Environment:
    """The parts of all stacks of a material: code in GLSL ES, which calls vt_blurred(direction, root of alpha), and its
    texture vt_parts, (height, width, 4)."""

    text: str
    texture: np.ndarray

    @property
    def bare(self) -> Environment:
        """The same without comments."""
        return replace(self, text=_without_comments(self.text))


@dataclass(frozen=True)
class Lit:
    """A material in an engine: its shader; code of the model in a language, and of the frame in GLSL; textures by name,
    of shape (height, width, 4); whether both of its sides are seen."""

    shader: Shader
    code: str
    frame: str
    textures: Mapping[str, np.ndarray]
    two_sided: bool

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
        made.text.replace(printer.first_lines, "", 1),
        _FRAME.format(tangent=_TANGENT if brushed else ""),
        {} if made.columns is None else {f"{prefix}_baked": made.columns},
        any(stack.transmits for stack in stacks),
    )


def environment(request: Request) -> Environment:
    """The light of a material without textures by an engine's environment."""
    stacks = zip(shares(request.material), request.material.leaves())
    parts = [
        (share, prefiltered.prefiltered(Material.of(stack), request.model)) for share, (_, stack) in stacks if share
    ]
    widest = max(found.shape[0] for _, found in parts)
    lines, texels, first = [], [], 0
    for share, found in parts:
        own = prefiltered.texture(found)
        lines += list(_part_lines(share, found, first))
        texels.append(np.pad(own, ((0, 0), (0, widest - own.shape[1]), (0, 0))))
        first += len(own)
    texture = np.concatenate(texels)
    azimuths = any(len(found.shape) > 1 for _, found in parts)
    code = _ENVIRONMENT.format(parts="\n".join(lines), azimuth=_AZIMUTH if azimuths else "")
    return Environment(code, texture)


def _part_lines(share: float, found: Prefiltered, first: int) -> Iterator[str]:
    """Statements that add up the parts of a stack whose lines begin at a number."""
    turns = (*found.shape, 1)[1]
    height = turns * sum(1 + blurs.shape[2] for blurs in found.blurs)
    sides = len(found.energy)

    def texel(line: int) -> str:
        above = f"{first + turns * line}.5"
        chosen = f"(wi.z < 0.0 ? {first + turns * line + height}.5 : {above})" if sides > 1 else above
        place = f"vec2(0.5 + {found.shape[0] - 1}.0 * column, {chosen}" + (
            f" + azimuth * {turns - 1}.0)" if turns > 1 else ")"
        )
        return f"vt_texel({place})"

    line = 0
    for passes, blurs in zip(found.passes, found.blurs):
        side = "-wi.z" if passes else "wi.z"
        seen = [f"vt_blur({texel(line + 1 + k)}, wi, plane, {side})" for k in range(blurs.shape[2])]
        yield f"    sum += {share:.6f} * {texel(line)}.rgb * ({' + '.join(seen)});"
        line += 1 + blurs.shape[2]


def _without_comments(code: str) -> str:
    return re.sub(r"\n\s*\n+", "\n", re.sub(r"[ \t]*//[^\n]*", "", code))


def halves(texels: np.ndarray) -> str:
    """A texture as halves of floats, in base64."""
    return base64.b64encode(np.ascontiguousarray(texels, "<f2").tobytes()).decode()


# Functions that look a texture up, where they are defined, at the begin of a line, and where they are called
_READER = re.compile(r"(^\w+ )?\b(\w+_(?:column|baked_texel|lobes|energies))\(", re.MULTILINE)


def handed(code: str, texture: str, argument: str) -> str:
    """Code whose functions are given their texture, which they declare as an argument."""

    def given(found: re.Match[str]) -> str:
        return f"{found[1] or ''}{found[2]}({argument if found[1] else texture}, "

    return _READER.sub(given, code)


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
        unpacked=_UNPACKED,
        textures="".join(
            _stored(name, texels) for name, texels in {"vt_parts": around.texture, **made.textures}.items()
        ),
        **own,
    )
    facts = facts_of(made.shader, Glsl.language, request.folder)
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
mat3 vt_frame; // columns are the tangent, the bitangent, and the normal outwards, in the engine's coordinates

// Of a normal, a place and its texture coordinate; hand is -1 where coordinates are left-handed
mat3 vt_frame_of(vec3 n, vec3 p, vec2 uv, float hand) {{
    vec3 t = vec3(0.0);
{tangent}    if (dot(t, t) < 1e-20) t = abs(n.y) < 0.9 ? cross(vec3(0.0, 1.0, 0.0), n) : cross(vec3(1.0, 0.0, 0.0), n);
    t = normalize(t);
    return mat3(t, hand * cross(n, t), n);
}}
"""

_TANGENT = """\
    // Along the first texture coordinate
    vec3 px = dFdx(p), py = dFdy(p);
    vec2 u = dFdx(uv), v = dFdy(uv);
    t = (px * v.y - py * u.y) * sign(u.x * v.y - u.y * v.x);
    t -= dot(t, n) * n;
"""

_ENVIRONMENT = """\
// The material's parts by the environment: of each its energy, and its blurs. Of a blur how far it leaves beyond the
// mirror's direction, in the plane of incidence and beside it; root of alpha; share
uniform highp sampler2D vt_parts;

vec4 vt_texel(vec2 texel) {{
    return textureLod(vt_parts, texel / vec2(textureSize(vt_parts, 0)), 0.0);
}}

vec3 vt_blur(vec4 blur, vec3 wi, vec2 plane, float side) {{
    vec2 across = vec2(plane.x * blur.x - plane.y * blur.y, plane.y * blur.x + plane.x * blur.y) - wi.xy;
    float up = sqrt(max(1.0 - dot(across, across), 0.0));
    return blur.w * vt_blurred(vec3(across, side < 0.0 ? -up : up), blur.z);
}}

// Light from wi by the environment that vt_blurred gives
vec3 vt_environment(vec3 wi) {{
    float sine2 = dot(wi.xy, wi.xy), column = sqrt(abs(wi.z));
    vec2 plane = sine2 > 1e-12 ? wi.xy * inversesqrt(sine2) : vec2(1.0, 0.0);
{azimuth}    vec3 sum = vec3(0.0);
{parts}
    return sum;
}}
"""

_AZIMUTH = """\
    vec2 twice = vec2(wi.x * wi.x - wi.y * wi.y + 1e-15, 2.0 * wi.x * wi.y);
    float along = twice.x / (abs(twice.x) + abs(twice.y)), azimuth = 0.25 * (twice.y < 0.0 ? 3.0 + along : 1.0 - along);
"""

_UNPACKED = """\
/** The textures of the module: names with width, height and halves of floats. */
function unpacked() {
  return Object.entries(stored).map(([name, [width, height, data]]) => {
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    return [name, width, height, new Uint16Array(bytes.buffer)];
  });
}
"""
