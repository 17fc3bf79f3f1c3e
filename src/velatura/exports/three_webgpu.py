"""A material as a module for three.js's WebGPURenderer: a class of node materials that lights, shadows and environments
of a scene meet.

Functions in WGSL are nodes of TSL: the model's, which a LightingModel calls for each light, and those of
`velatura.exports.real_time`, which say where a part sees the environment. The engine's own nodes sample it.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

from velatura.exports import real_time
from velatura.exports.request import Export, Request
from velatura.shader.printers.wgsl import Wgsl


@dataclass(frozen=True)
class Tsl(Wgsl):
    """WGSL whose functions are given the texture, since the engine says where it is bound."""

    def texture(self, name: str, place: int) -> str:
        return ""


def write(request: Request) -> Export:
    """The module; it holds its textures, as halves of floats.

    Raises:
        InvalidInput: a material with textures.
    """
    printer = Tsl(half=True)
    made, around = real_time.lit(request, printer), real_time.environment(request)
    texture = made.texture
    argument = f"{texture}: texture_2d<f32>"
    functions = {name: printer.spelled(text) for name, text in around.functions.items()}
    return real_time.module(
        _MODULE,
        request,
        replace(made, code=made.handed(made.code, argument), frame=printer.spelled(made.frame)),
        replace(around, functions=functions),
        "LayeredMaterial",
        sided="DoubleSide" if made.two_sided else "FrontSide",
        declared=f"{argument}, " if texture else "",
        lobes=made.handed("vt_lobes(vt_material(uv), wi)", argument),
        value=made.handed("vt_eval(vt_material(uv), lobes, wi, wo)", argument),
        given=f"{texture}: textures.{texture}, " if texture else "",
        stacks="".join(f"  {_listed(leaf)},\n" for leaf in around.stacks),
        rectangle=printer.spelled("\n".join(real_time.RECTANGLE.values())),
    )


def _listed(leaf: real_time.Leaf) -> str:
    """A stack in JavaScript, with its functions."""
    parts = ", ".join(f"[{part.side}, {part.energy}, [{', '.join(part.blurs)}]]" for part in leaf.parts)
    return f"[{json.dumps(leaf.axis)}, {json.dumps(leaf.rows)}, [{parts}]]"


_MODULE = """\
// {name}, by the model {model}; a material for three.js with WebGPU.
// {origin}
//
//     import {{ LayeredMaterial }} from './FILE.js';
//     mesh.material = new LayeredMaterial();
//
// It meets the lights, shadows and fog of a scene, and scene.environment or its own envMap or envNode. Brushed layers
// follow the texture coordinates. Light that passes comes from the environment behind, not from other objects; light
// maps are not met. For WebGPURenderer, where it has WebGPU.

import {{
  DataTexture, DoubleSide, Euler, FrontSide, HalfFloatType, LightingModel, LightingNode, LinearFilter, NodeMaterial,
  RGBAFormat,
}} from 'three/webgpu';
import {{
  cameraWorldMatrix, faceDirection, float, isolate, materialEnvIntensity, normalView, pmremTexture, positionView,
  positionViewDirection, texture, uv, vec2, vec3, vec4, wgsl, wgslFn,
}} from 'three/tsl';

/** The model's functions, in WGSL. */
export const code = `
{code}
`;

/** The frame of the surface, in which the model's directions are. */
const vt_frame_of = `
{frame}
`;

/** Where parts of the material see an environment. */
{functions}
/** How much a rectangle lights a blur, in place of an environment. */
const vt_rectangle = `
{rectangle}
`;

const model = wgsl(code);
const rectangleOf = wgslFn(
  `fn vt_share(w: vec3f, middle: vec3f, u: vec3f, v: vec3f, roughness: f32) -> f32 {{
    return vt_rectangle(w, middle, u, v, roughness);
  }}`,
  [wgsl(vt_rectangle)],
);
const frameOf = wgslFn(vt_frame_of), placeOf = wgslFn(vt_place), at = wgslFn(vt_at);
const planeOf = wgslFn(vt_plane), rayOf = wgslFn(vt_ray);
const lobesOf = wgslFn(
  `fn vt_lobes_at({declared}uv: vec2f, wi: vec3f) -> VtLobes {{
    return {lobes};
  }}`,
  [model],
);
const valueOf = wgslFn(
  `fn vt_value({declared}uv: vec2f, lobes: VtLobes, wi: vec3f, wo: vec3f) -> vec3f {{
    return {value};
  }}`,
  [model],
);

/**
 * The stacks: where azimuths begin; rows of texels; of each part the side that it leaves on, its energy and its blurs,
 * by these texels.
 */
const stacks = [
{stacks}];

/** The sum of the parts, by the light that each blur sees: a node of its ray, whose last component is a roughness. */
function seen(wi, blurred) {{
  const plane = planeOf({{ wi }}).toVar(), sum = vec3(0).toVar();
  const {{ width, height }} = textures.vt_parts.value.image, size = vec2(width, height);
  for (const [axis, rows, parts] of stacks) {{
    const place = placeOf({{ wi, axis: vec2(...axis) }}).toVar();
    const texel = (row) => textures.vt_parts.sample(at({{ rows: vec4(...row), place }}).div(size)).level(0);
    const given = Object.fromEntries(rows.map((row, k) => [`t${{k}}`, texel(row).toVar()]));
    for (const [side, energy, blurs] of parts) {{
      const light = vec3(0).toVar();
      for (const each of blurs) {{
        const blur = wgslFn(each)(given).toVar(), ray = rayOf({{ blur, wi, plane, side: float(side) }}).toVar();
        light.addAssign(blurred(ray).mul(blur.w));
      }}
      sum.addAssign(wgslFn(energy)(given).rgb.max(0).mul(light));
    }}
  }}
  return sum;
}}

/** Lights by the model; directions are in the frame of the surface. */
class Layers extends LightingModel {{
  start(builder) {{
    const twoSided = builder.material.side === DoubleSide;
    const normal = twoSided ? normalView.mul(faceDirection) : normalView; // outwards
    this.frame = frameOf({{ n: normal, p: positionView, uv: uv(), hand: float(1) }}).toVar();
    const wi = this.within(positionViewDirection).toVar();
    if (!twoSided) wi.z.assign(wi.z.max(1e-3));
    this.wi = wi.normalize().toVar();
    if (builder.lightsNode.hasLights) {{
      this.lobes = lobesOf({{ {given}uv: uv(), wi: this.wi }}).toVar();
    }}
    super.start(builder);
  }}

  within(direction) {{
    return this.frame.transpose().mul(direction);
  }}

  direct({{ lightDirection, lightColor, reflectedLight }}) {{
    const wo = this.within(lightDirection);
    const value = valueOf({{ {given}uv: uv(), lobes: this.lobes, wi: this.wi, wo }});
    reflectedLight.directSpecular.addAssign(lightColor.mul(value));
  }}

  directRectArea({{ lightColor, lightPosition, halfWidth, halfHeight, reflectedLight }}) {{
    const rectangle = {{ middle: lightPosition.sub(positionView), u: halfWidth, v: halfHeight }};
    const light = seen(this.wi, (ray) => rectangleOf({{ w: this.frame.mul(ray.xyz), roughness: ray.w, ...rectangle }}));
    reflectedLight.directSpecular.addAssign(lightColor.mul(light));
  }}

  indirect({{ context }}) {{
    context.reflectedLight.indirectSpecular.addAssign(context.radiance);
  }}
}}

/** Light by an environment, by nodes of which others ask a direction and a roughness. */
class Surroundings extends LightingNode {{
  constructor(sky) {{
    super();
    this.sky = sky;
  }}

  setup({{ context }}) {{
    const {{ frame, wi }} = context.lightingModel;
    const light = seen(wi, (ray) => {{
      const direction = frame.mul(ray.xyz).transformDirection(cameraWorldMatrix).toVar();
      const found = this.sky.context({{ getUV: () => direction, getTextureLevel: () => ray.w }});
      return isolate(found); // or the engine would take it for that of the last blur
    }});
    context.radiance.addAssign(light.mul(materialEnvIntensity));
  }}
}}

/**
 * A material of layers; takes the parameters of a NodeMaterial and of envMap, envMapIntensity and envMapRotation.
 * Another envMap shows after needsUpdate = true.
 */
export class LayeredMaterial extends NodeMaterial {{
  static get type() {{
    return 'LayeredMaterial';
  }}

  constructor(parameters = {{}}) {{
    super();
    this.envMap = null;
    this.envMapRotation = new Euler();
    this.envMapIntensity = 1;
    this.name = {title};
    this.side = {sided};
    this.lights = true;
    this.setValues(parameters);
  }}

  /** The engine keeps programs, with their textures, by this. */
  customProgramCacheKey() {{
    return [super.customProgramCacheKey(), model.id, this.envMap?.uuid].join();
  }}

  setupEnvironment(builder) {{
    const sky = this.envNode ?? (this.envMap ? texture(this.envMap) : builder.environmentNode);
    return sky ? new Surroundings(sky.isTextureNode ? pmremTexture(sky.value) : sky) : null;
  }}

  setupLightingModel() {{
    return new Layers();
  }}
}}

{unpacked}
const stored = {{
{textures}}};

/** The textures, which all materials share. */
const textures = Object.fromEntries(
  unpacked().map(([name, width, height, halves]) => {{
    const made = new DataTexture(halves, width, height, RGBAFormat, HalfFloatType);
    made.minFilter = made.magFilter = LinearFilter;
    made.needsUpdate = true;
    return [name, texture(made)];
  }}),
);
"""
