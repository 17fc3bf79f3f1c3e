"""A material as a module for three.js: a class of materials that lights, shadows and environments of a scene meet.

Lights are met by `vt_eval`, environments by the parts of `velatura.shader.prefiltered`. The class is a ShaderMaterial
that the renderer treats as its own physical ones: it gets the environment of the scene, prefiltered.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from velatura.errors import InvalidInput, remark
from velatura.exports.request import Export, Request, origin
from velatura.exports.shader import facts_of
from velatura.model.variance import Isotropic
from velatura.shader import prefiltered, shader
from velatura.shader.closures import shares
from velatura.shader.material import title
from velatura.shader.prefiltered import ROUND, Prefiltered
from velatura.shader.printers.glsl import Glsl
from velatura.shader.program import described
from velatura.shader.recorder import recording
from velatura.stack import Material, Varying

MOST_TAPS = 9  # along the longer axis of a part
DENSITY = 3.4  # taps in a width of the blur


class Environment(NamedTuple):
    """The parts of all stacks of a material: code in GLSL ES, and its texture (height, width, 4)."""

    text: str
    texture: np.ndarray


def write(request: Request) -> Export:
    """The module; it holds its textures, as halves of floats.

    Raises:
        InvalidInput: a material with textures.
    """
    varying = [address.name for address, value in request.material.values() if isinstance(value, Varying)]
    if varying:
        raise InvalidInput(f"{varying[0]}: {request.to} is written of uniform materials, without textures")
    printer = Glsl(half=True)
    made = shader(request.material, request.model, printer=printer, baking=True)
    around = environment(request)
    textures = {"vt_parts": around.texture}
    if made.columns is not None:
        textures["vt_baked"] = made.columns
    stacks = [stack for _, stack in request.material.leaves()]
    brushed = any(recording.variance(stack) is not Isotropic for stack in stacks)
    text = _MODULE.format(
        name=remark(title(request.material)),
        model=described(request.model),
        origin=origin(),
        title=_string(title(request.material)),
        sided="DoubleSide" if any(stack.transmits for stack in stacks) else "FrontSide",
        turned=int(brushed),
        code=_template(made.text.replace(Glsl.first_lines, "", 1)),
        environment=_template(around.text),
        textures="".join(f"  {name}: {_stored(texels)},\n" for name, texels in textures.items()),
    )
    return Export(
        text, facts={**facts_of(made, printer.language, request.folder), "exports": ["LayeredMaterial", "code"]}
    )


def environment(request: Request) -> Environment:
    """Light of a material without textures by an engine's environment."""
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
    return Environment(_ENVIRONMENT.format(parts="\n".join(lines)), np.concatenate(texels))


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


def _stored(texels: np.ndarray) -> str:
    """A texture as the arguments that make it."""
    data = base64.b64encode(np.ascontiguousarray(texels, "<f2").tobytes()).decode()
    return f"[{texels.shape[1]}, {texels.shape[0]}, '{data}']"


def _template(text: str) -> str:
    """A text within a template literal."""
    return text.replace("\\", "\\\\").replace("`", "\\`").replace("${", "\\${").strip("\n")


def _string(text: str) -> str:
    """A string of JavaScript, without trigraphs for those who read it as C."""
    return json.dumps(text, ensure_ascii=False).replace("?", "\\u003f")


_ENVIRONMENT = """\
// The material's parts by the environment: of each its energy, where it leaves, root of alpha, and shape
uniform highp sampler2D vt_parts;

vec4 vt_part_node(int line, int x, int y) {{ return texelFetch(vt_parts, ivec2(x, line + y), 0); }}

vec4 vt_part_line(int line, ivec2 nodes, vec2 place) {{
    vec2 position = place * vec2(nodes - 1);
    ivec2 node = min(ivec2(position), max(nodes - 2, 0)), next = min(node + 1, nodes - 1);
    vec2 upper = position - vec2(node);
    vec4 a = mix(vt_part_node(line, node.x, node.y), vt_part_node(line, next.x, node.y), upper.x);
    vec4 b = mix(vt_part_node(line, node.x, next.y), vt_part_node(line, next.x, next.y), upper.x);
    return mix(a, b, upper.y);
}}

// A part on the side of the surface where it leaves, by blurs side by side
vec3 vt_part(int line, ivec2 nodes, vec3 wi, float side, int taps) {{
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

_MODULE = """\
// {name}, by the model {model}; a material for three.js.
// {origin}
//
//     import {{ LayeredMaterial }} from './FILE.js';
//     mesh.material = new LayeredMaterial();
//
// It meets the lights, shadows and fog of a scene, and scene.environment or its own envMap. Brushed layers follow the
// texture coordinates. Light that passes comes from the environment behind, not from other objects; area lights and
// light maps are not met. For WebGLRenderer.

import {{
  DataTexture, DoubleSide, Euler, FrontSide, HalfFloatType, RGBAFormat, ShaderLib, ShaderMaterial, UniformsUtils,
}} from 'three';

/** The model's functions, in GLSL ES 3.00. */
export const code = `
{code}
`;

/** What it makes of an environment, by vt_blurred(direction, root of alpha). */
const environment = `
{environment}
`;

const vertexShader = `
varying vec3 vViewPosition;
varying vec2 vtUv;

#include <common>
#include <batching_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>

void main() {{
    vtUv = uv;
    #include <morphinstance_vertex>
    #include <batching_vertex>
    #include <beginnormal_vertex>
    #include <morphnormal_vertex>
    #include <skinbase_vertex>
    #include <skinnormal_vertex>
    #include <defaultnormal_vertex>
    #include <normal_vertex>
    #include <begin_vertex>
    #include <morphtarget_vertex>
    #include <skinning_vertex>
    #include <project_vertex>
    #include <logdepthbuf_vertex>
    #include <clipping_planes_vertex>
    vViewPosition = -mvPosition.xyz;
    #include <worldpos_vertex>
    #include <shadowmap_vertex>
    #include <fog_vertex>
}}
`;

const fragmentShader = `
varying vec3 vViewPosition;
varying vec2 vtUv;

#include <common>
#include <dithering_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <shadowmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>

${{code}}

mat3 vt_frame; // columns are the tangent, the bitangent, and the normal outwards, where the viewer sees them

#ifdef USE_ENVMAP
vec3 vt_blurred(vec3 w, float roughness) {{
    vec3 seen = vt_frame * w;
    return getIBLRadiance(seen, seen, roughness);
}}

${{environment}}
#endif

struct VtSeen {{
    VtMaterial material;
    VtLobes lobes;
    vec3 wi;
}};

void vt_direct(const in IncidentLight light, const in vec3 position, const in vec3 normal, const in vec3 view,
        const in vec3 coat, const in VtSeen seen, inout ReflectedLight reflected) {{
    reflected.directSpecular += light.color * vt_eval(seen.material, seen.lobes, seen.wi, light.direction * vt_frame);
}}
#define RE_Direct vt_direct

// The frame; the tangent lies along the first texture coordinate
mat3 vt_frame_of(vec3 n) {{
    vec3 t = vec3(0.0);
    #if {turned}
    vec3 p = -vViewPosition, px = dFdx(p), py = dFdy(p);
    vec2 u = dFdx(vtUv), v = dFdy(vtUv);
    t = (px * v.y - py * u.y) * sign(u.x * v.y - u.y * v.x);
    t -= dot(t, n) * n;
    #endif
    if (dot(t, t) < 1e-20) t = abs(n.y) < 0.9 ? cross(vec3(0.0, 1.0, 0.0), n) : cross(vec3(1.0, 0.0, 0.0), n);
    t = normalize(t);
    return mat3(t, cross(n, t), n);
}}

void main() {{
    #include <clipping_planes_fragment>
    #include <logdepthbuf_fragment>
    #include <normal_fragment_begin>
    #ifdef DOUBLE_SIDED
    vt_frame = vt_frame_of(normal * faceDirection);
    #else
    vt_frame = vt_frame_of(normal);
    #endif
    ReflectedLight reflectedLight = ReflectedLight(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    VtSeen material;
    material.wi = (isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(vViewPosition)) * vt_frame;
    #ifndef DOUBLE_SIDED
    material.wi.z = max(material.wi.z, 1e-3);
    #endif
    material.wi = normalize(material.wi);
    material.material = vt_material(vtUv);
    material.lobes = vt_lobes(material.material, material.wi);
    #include <lights_fragment_begin>
    vec3 light = reflectedLight.directSpecular;
    #ifdef USE_ENVMAP
    light += vt_environment(material.wi);
    #endif
    gl_FragColor = vec4(light, 1.0);
    #include <tonemapping_fragment>
    #include <colorspace_fragment>
    #include <fog_fragment>
    #include <dithering_fragment>
}}
`;

/** A material of layers; takes the parameters of a Material and of envMap, envMapIntensity and envMapRotation. */
export class LayeredMaterial extends ShaderMaterial {{
  constructor(parameters = {{}}) {{
    super();
    this.isMeshStandardMaterial = true; // the renderer gives it the environment of the scene
    this.envMap = null;
    this.envMapRotation = new Euler();
    this.envMapIntensity = 1;
    this.metalness = 0;
    this.roughness = 1;
    this.name = {title};
    this.side = {sided};
    this.lights = true;
    this.fog = true;
    this.vertexShader = vertexShader;
    this.fragmentShader = fragmentShader;
    this.uniforms = UniformsUtils.clone(ShaderLib.standard.uniforms);
    for (const [name, value] of Object.entries(textures())) this.uniforms[name] = {{ value }};
    this.setValues(parameters);
  }}
}}

let made;

/** The textures, which all materials share. */
function textures() {{
  made ??= Object.fromEntries(
    Object.entries(stored).map(([name, [width, height, data]]) => {{
      const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
      const texture = new DataTexture(new Uint16Array(bytes.buffer), width, height, RGBAFormat, HalfFloatType);
      texture.needsUpdate = true;
      return [name, texture];
    }}),
  );
  return made;
}}

const stored = {{
{textures}}};
"""
