"""A material as a module for three.js: a class of materials that lights, shadows and environments of a scene meet.

The class is a ShaderMaterial that the renderer treats as its own physical ones: it gets the environment of the scene,
prefiltered. Its code is that of `velatura.exports.real_time`.
"""

from __future__ import annotations

from velatura.exports import real_time
from velatura.exports.request import Export, Request
from velatura.shader.printers.glsl import Glsl


def write(request: Request) -> Export:
    """The module; it holds its textures, as halves of floats.

    Raises:
        InvalidInput: a material with textures.
    """
    made, around = real_time.lit(request, Glsl(half=True)), real_time.environment(request)
    sided = "DoubleSide" if made.two_sided else "FrontSide"
    rectangle = "\n".join(real_time.RECTANGLE.values())
    return real_time.module(_MODULE, request, made, around, "LayeredMaterial", sided=sided, rectangle=rectangle)


_MODULE = """\
// {name}, by the model {model}; a material for three.js.
// {origin}
//
//     import {{ LayeredMaterial }} from './FILE.js';
//     mesh.material = new LayeredMaterial();
//
// It meets the lights, shadows and fog of a scene, and scene.environment or its own envMap. Brushed layers follow the
// texture coordinates. Light that passes comes from the environment behind, not from other objects; light maps are not
// met. For WebGLRenderer.

import {{
  DataTexture, DoubleSide, Euler, FrontSide, HalfFloatType, LinearFilter, RGBAFormat, ShaderLib, ShaderMaterial,
  UniformsUtils,
}} from 'three';

/** The model's functions, in GLSL ES 3.00. */
export const code = `
{code}
`;

/** The frame of the surface, in which the model's directions are. */
const frame = `
{frame}
`;

/** What it makes of an environment, by vt_blurred(direction, root of alpha). */
const environment = `
{environment}
`;

/** Light of rectangles in place of an environment's. */
const rectangles = `
{rectangle}
vec3 vt_rectangles(vec3 w, vec3 p, float roughness) {{
    vec3 light = vec3(0.0);
    for (int i = 0; i < NUM_RECT_AREA_LIGHTS; i++) {{
        RectAreaLight each = rectAreaLights[i];
        light += each.color * vt_rectangle(w, each.position - p, each.halfWidth, each.halfHeight, roughness);
    }}
    return light;
}}
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

${{frame}}
mat3 vt_frame;

#ifdef USE_ENVMAP
mat3 vt_sky; // from the frame to the environment's

vec3 vt_sky_blurred(vec3 w, float roughness) {{
    #ifdef ENVMAP_TYPE_PMREM
    // The level of the first of four neighbours, which read one level together
    float level = roughnessToMip(roughness);
    vec2 odd = mod(floor(gl_FragCoord.xy), 2.0);
    level = floor(8.0 * (level - odd.x * dFdx(level) - odd.y * dFdy(level)) + 0.5) / 8.0;
    return envMapIntensity * textureLod(envMap, vt_sky * w, level).rgb;
    #else
    vec3 seen = vt_frame * w; // before r187
    return getIBLRadiance(seen, seen, roughness);
    #endif
}}
#endif

#if NUM_RECT_AREA_LIGHTS > 0
${{rectangles}}
#endif

#if defined(USE_ENVMAP) || NUM_RECT_AREA_LIGHTS > 0
vec3 vt_blurred(vec3 w, float roughness) {{
    vec3 light = vec3(0.0);
    #ifdef USE_ENVMAP
    light += vt_sky_blurred(w, roughness);
    #endif
    #if NUM_RECT_AREA_LIGHTS > 0
    light += vt_rectangles(vt_frame * w, -vViewPosition, roughness);
    #endif
    return light;
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

void main() {{
    #include <clipping_planes_fragment>
    #include <logdepthbuf_fragment>
    #include <normal_fragment_begin>
    #ifdef DOUBLE_SIDED
    vt_frame = vt_frame_of(normal * faceDirection, -vViewPosition, vtUv, 1.0);
    #else
    vt_frame = vt_frame_of(normal, -vViewPosition, vtUv, 1.0);
    #endif
    ReflectedLight reflectedLight = ReflectedLight(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    VtSeen material;
    material.wi = (isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(vViewPosition)) * vt_frame;
    #ifndef DOUBLE_SIDED
    material.wi.z = max(material.wi.z, 1e-3);
    #endif
    material.wi = normalize(material.wi);
    material.material = vt_material(vtUv);
    #if NUM_DIR_LIGHTS + NUM_POINT_LIGHTS + NUM_SPOT_LIGHTS > 0
    material.lobes = vt_lobes(material.material, material.wi);
    #endif
    #include <lights_fragment_begin>
    vec3 light = reflectedLight.directSpecular;
    #ifdef USE_ENVMAP
    vt_sky = envMapRotation * transpose(mat3(viewMatrix)) * vt_frame;
    #endif
    #if defined(USE_ENVMAP) || NUM_RECT_AREA_LIGHTS > 0
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
    unpacked().map(([name, width, height, halves]) => {{
      const texture = new DataTexture(halves, width, height, RGBAFormat, HalfFloatType);
      texture.minFilter = texture.magFilter = LinearFilter;
      texture.needsUpdate = true;
      return [name, texture];
    }}),
  );
  return made;
}}

{unpacked}
const stored = {{
{textures}}};
"""
