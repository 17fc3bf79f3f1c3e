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
from velatura.shader.prefiltered import ROUND, Prefiltered
from velatura.shader.printers.glsl import Glsl
from velatura.shader.program import described
from velatura.shader.recorder import recording
from velatura.stack import Material, Varying

MOST_TAPS = 9  # along the longer axis of a part
DENSITY = 3.4  # taps in a width of the blur


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
    """A material in an engine: its shader; code in GLSL of the model and of the frame; textures by name, of shape
    (height, width, 4); whether both of its sides are seen."""

    shader: Shader
    code: str
    frame: str
    textures: Mapping[str, np.ndarray]
    two_sided: bool

    @property
    def bare(self) -> Lit:
        """The same without comments, in which a preprocessor might read names of materials."""
        return replace(self, code=_without_comments(self.code), frame=_without_comments(self.frame))


def lit(request: Request, printer: Glsl) -> Lit:
    """The parts of a material that a module for an engine holds.

    Raises:
        InvalidInput: a material with textures.
    """
    varying = [address.name for address, value in request.material.values() if isinstance(value, Varying)]
    if varying:
        raise InvalidInput(f"{varying[0]}: {request.to} is written of uniform materials, without textures")
    made = shader(request.material, request.model, printer=printer, baking=True)
    stacks = [stack for _, stack in request.material.leaves()]
    brushed = any(recording.variance(stack) is not Isotropic for stack in stacks)
    return Lit(
        made,
        made.text.replace(printer.first_lines, "", 1),
        _FRAME.format(tangent=_TANGENT if brushed else ""),
        {} if made.columns is None else {"vt_baked": made.columns},
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
    code = _ENVIRONMENT.format(parts="\n".join(lines), round=ROUND, half=DENSITY / 2)
    return Environment(code, np.concatenate(texels))


def _part_lines(share: float, found: Prefiltered, first: int) -> Iterator[str]:
    """Statements that add up the parts of a stack whose lines begin at a number."""
    cosines, turns = (*found.shape, 1)[:2]
    sides, _, parts, numbers = found.rows.shape
    texels = numbers // 4
    for k, (passes, longer) in enumerate(zip(found.passes, found.elongation)):
        taps = min(1 + 2 * int(np.ceil(0.5 * DENSITY * longer)), MOST_TAPS) if longer > ROUND else 1
        side, above = "-side" if passes else "side", first + texels * k * turns
        line = f"side < 0.0 ? {above + texels * parts * turns} : {above}" if sides > 1 else f"{above}"
        where = "" if sides > 1 else "if (side > 0.0) "
        yield f"    {where}sum += {share:.6f} * vt_part({line}, ivec2({cosines}, {turns}), wi, {side}, {taps});"


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
// The material's parts by the environment: of each its energy, where it leaves, root of alpha, and shape
uniform highp sampler2D vt_parts;

vec4 vt_part_line(int line, ivec2 nodes, vec2 place) {{
    vec2 texel = place * vec2(nodes - 1) + vec2(0.5, float(line) + 0.5);
    return textureLod(vt_parts, texel / vec2(textureSize(vt_parts, 0)), 0.0);
}}

// A part on the side of the surface where it leaves, by blurs side by side
vec3 vt_part(int line, ivec2 nodes, vec3 wi, float side, int most) {{
    vec2 twice = vec2(wi.x * wi.x - wi.y * wi.y + 1e-15, 2.0 * wi.x * wi.y);
    float along = twice.x / (abs(twice.x) + abs(twice.y));
    vec2 place = vec2(sqrt(abs(wi.z)), 0.25 * (twice.y < 0.0 ? 3.0 + along : 1.0 - along));
    vec4 a = vt_part_line(line, nodes, place), b = vt_part_line(line + nodes.y, nodes, place);
    vec4 shape = vt_part_line(line + 2 * nodes.y, nodes, place);

    // The mean direction, and tangents about it (Duff et al. 2017)
    float sine = length(wi.xy);
    vec2 across = sine * vec2(a.w, b.x);
    vec3 w = vec3(across, side * sqrt(max(1.0 - dot(across, across), 0.0)));
    float c = -1.0 / (side + w.z), d = w.x * w.y * c;
    vec3 x = vec3(1.0 + side * w.x * w.x * c, side * d, -side * w.x), y = vec3(d, side + w.y * w.y * c, -w.y);

    // The longer axis
    float more = length(b.zw), cosine = more > 0.0 ? b.z / more : 1.0;
    vec2 turn = sqrt(max(0.5 + 0.5 * vec2(cosine, -cosine), vec2(0.0)));
    if (b.w < 0.0) turn.y = -turn.y;
    vec3 axis = turn.x * x + turn.y * y;
    float skew = dot(shape.xy, turn) / 6.0, growth = dot(shape.zw, turn);

    // From the plane of incidence
    vec2 plane = sine > 1e-6 ? wi.xy / sine : vec2(1.0, 0.0);
    w = vec3(plane.x * w.x - plane.y * w.y, plane.y * w.x + plane.x * w.y, w.z);
    axis = vec3(plane.x * axis.x - plane.y * axis.y, plane.y * axis.x + plane.x * axis.y, axis.z);

    // As many blurs as the axis is longer here; a blur's width to 10 %, of which details below .02 matter to no map
    float width = b.y * b.y * (0.42 - 1.22 * log(max(b.y, 1e-3))), longer = sqrt(more) / max(width, 0.02);
    int taps = longer > {round} ? min(1 + 2 * int(ceil({half} * longer)), most) : 1;
    vec3 sum = vec3(0.0);
    float whole = 0.0;
    for (int k = 0; k < taps; k++) {{
        // Places by a gamma distribution (Wilson and Hilferty 1931)
        float normal = taps > 1 ? 4.2 * float(k) / float(taps - 1) - 2.1 : 0.0, share = exp(-0.45 * normal * normal);
        float h = skew * (taps > 1 ? normal - skew : 0.0), at = (normal - skew) * (1.0 + h + h * h / 3.0);
        float p = taps > 1 ? clamp(sqrt(more) * at, -0.99, 0.99) : 0.0;
        vec3 tap = sqrt(1.0 - p * p) * w + p * axis;
        tap.z = side * max(side * tap.z, 0.0);
        float wider = taps > 1 ? sqrt(sqrt(clamp(1.0 + growth * at, 0.06, 16.0))) : 1.0;
        sum += share * vt_blurred(normalize(tap), min(b.y * wider, 1.0));
        whole += share;
    }}
    return a.rgb * sum / whole;
}}

// Light from wi by the environment that vt_blurred gives
vec3 vt_environment(vec3 wi) {{
    vec3 sum = vec3(0.0);
    float side = wi.z < 0.0 ? -1.0 : 1.0;
{parts}
    return sum;
}}
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
