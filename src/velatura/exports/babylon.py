"""A material as a module for Babylon.js: a function that makes a PBRMaterial with a plugin, which lights it.

The engine's own loop over lights, its shadows and its environment stay; the plugin takes the place of the functions
that light meets. Its code is that of `velatura.exports.real_time`.
"""

from __future__ import annotations

import hashlib

from velatura.exports import real_time
from velatura.exports.request import Export, Request
from velatura.shader.printers.glsl import Glsl


def write(request: Request) -> Export:
    """The module; it holds its textures, as halves of floats.

    Raises:
        InvalidInput: a material with textures.
    """
    made, around = real_time.lit(request, Glsl(half=True)).bare, real_time.environment(request).bare
    code = made.code + made.frame + around.text
    return real_time.module(
        _MODULE,
        request,
        made,
        around,
        "layeredMaterial",
        digest=hashlib.sha256(code.encode()).hexdigest()[:16],
        culled=str(not made.two_sided).lower(),
        rectangle="\n".join(real_time.RECTANGLE.values()),
        above="" if made.two_sided else "\n    vt_wi = normalize(vec3(vt_wi.xy, max(vt_wi.z, 1e-3)));",
    )


_MODULE = """\
// {name}, by the model {model}; a material for Babylon.js.
// {origin}
//
//     import {{ layeredMaterial }} from './FILE.js';
//     mesh.material = layeredMaterial(BABYLON, scene);
//
// BABYLON is what `import * as BABYLON from '@babylonjs/core'` gives, or the global of babylon.js. The material meets
// the lights, shadows, fog and image processing of a scene, and its environmentTexture, a prefiltered cube. Brushed
// layers follow the texture coordinates. Light that passes comes from the environment behind, not from other
// objects; hemispheric lights act as directional ones, and textures of area lights are left out.

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

/** The light of a rectangle in place of an environment's. */
const rectangle = `
{rectangle}
`;

const definitions = `
${{code}}
${{frame}}
mat3 vt_frame;

VtMaterial vt_seen;
VtLobes vt_seen_lobes;
vec3 vt_wi;

vec3 vt_direct(preLightingInfo light, vec3 colour) {{
    return light.attenuation * colour * vt_eval(vt_seen, vt_seen_lobes, vt_wi, light.L * vt_frame);
}}
#define computeDiffuseLighting(light, colour) vec3(0.0)
#define computeSpecularLighting(light, n, f0, f, roughness, colour) vt_direct(light, colour)

#if defined(REFLECTION) && defined(REFLECTIONMAP_3D) && defined(LODBASEDMICROSFURACE)
#define VT_SKY
vec3 vt_sky_blurred(vec3 w, float roughness) {{
    vec3 seen = vec3(reflectionMatrix * vec4(vt_frame * w, 0.0));
    #ifdef INVERTCUBICMAP
    seen.y = -seen.y;
    #endif
    #ifdef REFLECTIONMAP_OPPOSITEZ
    seen.z = -seen.z;
    #endif
    float alpha = roughness * roughness, width = vReflectionMicrosurfaceInfos.x;
    #ifdef LINEARSPECULARREFLECTION
    float lod = getLinearLodFromRoughness(width, roughness);
    #else
    float lod = getLodFromAlphaG(width, max(alpha, 1e-4));
    #endif
    lod = max(lod * vReflectionMicrosurfaceInfos.y + vReflectionMicrosurfaceInfos.z, 0.0);
    vec4 light = sampleReflectionLod(reflectionSampler, seen, lod);
    #ifdef RGBDREFLECTION
    light.rgb = fromRGBD(light);
    #endif
    #ifdef GAMMAREFLECTION
    light.rgb = toLinearSpace(light.rgb);
    #endif
    // The last levels are of a few texels; the widest blur is the irradiance
    #ifdef USESPHERICALFROMREFLECTIONMAP
    light.rgb = mix(light.rgb, max(computeEnvironmentIrradiance(seen), 0.0), smoothstep(0.4, 0.8, alpha));
    #endif
    return light.rgb * vReflectionInfos.x * vReflectionColor;
}}
#endif

#if defined(AREALIGHTUSED) && defined(AREALIGHTSUPPORTED)
#define VT_RECTANGLES
${{rectangle}}
struct VtRectangle {{ vec3 middle; vec3 u; vec3 v; }};
VtRectangle vt_lit_by;
bool vt_by_rectangle = false;
#endif

#if defined(VT_SKY) || defined(VT_RECTANGLES)
vec3 vt_blurred(vec3 w, float roughness) {{
    #ifdef VT_RECTANGLES
    if (vt_by_rectangle) {{
        return vec3(vt_rectangle(vt_frame * w, vt_lit_by.middle, vt_lit_by.u, vt_lit_by.v, roughness));
    }}
    #endif
    #ifdef VT_SKY
    return vt_sky_blurred(w, roughness);
    #else
    return vec3(0.0);
    #endif
}}

${{environment}}
#endif

#ifdef VT_RECTANGLES
preLightingInfo vt_area(vec3 p, vec4 light, vec3 u, vec3 v) {{
    preLightingInfo info;
    vt_lit_by = VtRectangle(light.xyz - p, u, v);
    vt_by_rectangle = true;
    info.areaLightDiffuse = vt_environment(vt_wi);
    vt_by_rectangle = false;
    return info;
}}
#define computeAreaPreLightingInfo(a, b, view, n, p, light, u, v, roughness) vt_area(p, light, u, v)
#define computeAreaPreLightingInfoWithTexture(a, b, c, view, n, p, light, u, v, roughness) vt_area(p, light, u, v)
#define computeAreaSpecularLighting(light, colour, f0, f90) (colour * light.areaLightDiffuse)
#endif
`;

const beforeLights = `
{{
    vec2 uv = vec2(0.0);
    #ifdef MAINUV1
    uv = vMainUV1;
    #endif
    #ifdef VT_LEFT
    vt_frame = vt_frame_of(normalize(vNormalW), vPositionW, uv, -1.0);
    #else
    vt_frame = vt_frame_of(normalize(vNormalW), vPositionW, uv, 1.0);
    #endif
    vt_wi = viewDirectionW * vt_frame;{above}
    vt_seen = vt_material(uv);
    vt_seen_lobes = vt_lobes(vt_seen, vt_wi);
}}
`;

const composition = `
finalDiffuse = finalAmbient = vec3(0.0);
#ifdef REFLECTION
finalIrradiance = finalRadianceScaled = vec3(0.0);
#ifdef VT_SKY
finalRadianceScaled = vt_environment(vt_wi) * vLightingIntensity.z;
#endif
#endif
`;

/** A material of layers, with the parameters of a PBRMaterial that are not of its surface. */
export function layeredMaterial(BABYLON, scene, name = {title}) {{
  const material = new BABYLON.PBRMaterial(name, scene, true);
  material.metallic = 0;
  material.roughness = 1;
  material.brdf.useEnergyConservation = false;
  material.backFaceCulling = {culled};
  const textures = unpacked().map(([name, width, height, halves]) => [
    name,
    new BABYLON.RawTexture(
      halves, width, height, BABYLON.Constants.TEXTUREFORMAT_RGBA, scene, false, false,
      BABYLON.Constants.TEXTURE_BILINEAR_SAMPLINGMODE, BABYLON.Constants.TEXTURETYPE_HALF_FLOAT,
    ),
  ]);

  class Layers extends BABYLON.MaterialPluginBase {{
    constructor() {{
      super(material, 'Layers', 200, {{ VT_LEFT: false }}, true, true);
    }}

    // Programs are kept by this name
    getClassName() {{
      return 'Layers{digest}';
    }}

    prepareDefinesBeforeAttributes(defines) {{
      defines._needUVs = true;
      defines.MAINUV1 = true;
    }}

    prepareDefines(defines, scene) {{
      defines.VT_LEFT = !scene.useRightHandedSystem;
    }}

    getSamplers(samplers) {{
      samplers.push(...textures.map(([name]) => name));
    }}

    bindForSubMesh(buffer) {{
      for (const [name, texture] of textures) buffer.setTexture(name, texture);
    }}

    getActiveTextures(active) {{
      active.push(...textures.map(([, texture]) => texture));
    }}

    dispose() {{
      for (const [, texture] of textures) texture.dispose();
    }}

    getCustomCode(shader) {{
      if (shader !== 'fragment') return null;
      return {{
        CUSTOM_FRAGMENT_DEFINITIONS: definitions,
        CUSTOM_FRAGMENT_BEFORE_LIGHTS: beforeLights,
        CUSTOM_FRAGMENT_BEFORE_FINALCOLORCOMPOSITION: composition,
      }};
    }}
  }}
  new Layers();
  return material;
}}

{unpacked}
const stored = {{
{textures}}};
"""
