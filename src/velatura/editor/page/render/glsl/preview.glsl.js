// The picture without paths: every lobe by a few directions, each looking into a blurred environment.

import { camera } from './camera.glsl.js';
import { covering } from './covering.glsl.js';
import { blurredEnvironment } from './environment.glsl.js';

const SAMPLES = 3; // of a lobe
const FEWER = 2; // where pixels are fewer, too
const LARGE = 0.2; // share of the energy up to which one sample of a lobe is enough

/** What lights the object of a material, as call("shader") has it. */
export const lighting = (shader) => `#version 300 es
${shader.text}
${camera}
${blurredEnvironment}
${covering(shader)}
${parts(shader)}
${OBJECT}`;

/**
 * The parts in the order in which vt_sample divides its first number among them, by energies, or by chances; those of a
 * stack of a mixture have its share.
 */
function parts({ parts }) {
  const assigned = [];
  for (const { place, share, shares } of parts) {
    const own = shares.map((_, k) => `shares[${assigned.length + k}]`);
    const each = shares.map((name, k) => `${own[k]} = whole(l.${place}${name}) + 3e-9;`);
    const scaled = own.map((name) => `${name} *= scale;`);
    if (share) each[each.length - 1] += ` scale = l.${share} / (${own.join(' + ')}); ${scaled.join(' ')}`;
    assigned.push(...each);
  }
  return `
const int PARTS = ${assigned.length};
float whole(vec3 energy) { return dot(energy, vec3(1.0)); }
float whole(float chance) { return chance; }
float[PARTS] part_shares(VtLobes l) {
  float shares[PARTS], scale;
  ${assigned.join('\n  ')}
  return shares;
}
`;
}

const OBJECT = /* glsl */ `
uniform highp sampler2D seen_normal;
uniform highp sampler2D seen_tangent;
uniform highp sampler2D seen_uv;
uniform int seen_every; // how many pixels of the picture, along both axes, are one that is seen
uniform highp sampler2D shade; // shadows, as learnt from paths of the same view
out vec4 radiance;

void main() {
  // Find the frame
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec3 ray = camera_ray(float(seen_every) * gl_FragCoord.xy);
  vec4 normal = texelFetch(seen_normal, pixel, 0);
  if (normal.w != 1.0) discard;
  vec4 tangent = texelFetch(seen_tangent, pixel, 0);
  vec3 n = normal.xyz, s = normalize(tangent.xyz - n * dot(n, tangent.xyz)), t = cross(n, s);
  vec3 wi = -vec3(dot(ray, s), dot(ray, t), dot(ray, n));
  wi = normalize(vec3(wi.xy, max(wi.z, 1e-3)));

  // Divide all numbers among the lobes
  VtMaterial m = vt_material(texelFetch(seen_uv, pixel, 0).xy);
  VtLobes l = on_part(vt_lobes(m, wi), int(tangent.w));
  float shares[PARTS] = part_shares(l);
  float total = 0.0, before = 0.0;
  for (int k = 0; k < PARTS; k++) total += shares[k];

  // Look where each of them goes
  vec3 light = vec3(0.0);
  for (int k = 0; k < PARTS; k++) {
    float share = shares[k] / total;
    int samples = share < ${LARGE} ? 1 : seen_every > 1 ? ${FEWER} : ${SAMPLES};
    float each = share / float(samples);
    for (int j = 0; j < samples; j++) {
      float u = (float(j) + 0.5) / float(samples);
      vec3 wo = vt_sample(m, l, wi, vec3(before + 0.5 * share, fract(0.5 + float(j) * 0.61803399), u));
      vec4 f = vt_eval_pdf(m, l, wi, wo);
      if (f.a > 0.0) {
        vec3 direction = s * wo.x + t * wo.y + n * wo.z;
        light += f.rgb * (each / f.a) * environment_cone(direction, each / f.a);
      }
    }
    before += share;
  }
  radiance = vec4(light * texelFetch(shade, seen_every * pixel, 0).rgb, 1.0);
}
`;

/** All around the object: the environment itself, and the grey plinth in it. */
export const surroundings = /* glsl */ `#version 300 es
precision highp float;
${camera}
${blurredEnvironment}
uniform highp sampler2D seen_normal;
uniform highp sampler2D shade;
uniform vec3 irradiance[9];
out vec4 radiance;

vec3 diffuse_light(vec3 d) {
  vec3 w = to_environment(d);
  vec3 sum = irradiance[0] + irradiance[1] * w.y + irradiance[2] * w.z + irradiance[3] * w.x;
  sum += irradiance[4] * w.x * w.y + irradiance[5] * w.y * w.z + irradiance[6] * (3.0 * w.z * w.z - 1.0);
  return sum + irradiance[7] * w.x * w.z + irradiance[8] * (w.x * w.x - w.y * w.y);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 normal = texelFetch(seen_normal, pixel, 0);
  if (normal.w == 1.0) discard;
  vec3 light;
  if (normal.w < 0.5) light = environment_cone(camera_ray(gl_FragCoord.xy), 0.0);
  else light = 0.18 * diffuse_light(normal.xyz);
  radiance = vec4(light * texelFetch(shade, pixel, 0).rgb, 1.0);
}
`;

/** What is seen of the object, in fewer pixels: of each block the first that shows it. */
export const coarsening = /* glsl */ `#version 300 es
precision highp float;
uniform highp sampler2D seen_normal;
uniform highp sampler2D seen_tangent;
uniform highp sampler2D seen_uv;
uniform int seen_every;
layout(location = 0) out vec4 coarse_normal;
layout(location = 1) out vec4 coarse_tangent;
layout(location = 2) out vec2 coarse_uv;

void main() {
  ivec2 first = seen_every * ivec2(gl_FragCoord.xy), last = textureSize(seen_normal, 0) - 1, found = first;
  for (int k = seen_every * seen_every - 1; k >= 0; k--) {
    ivec2 pixel = min(first + ivec2(k % seen_every, k / seen_every), last);
    if (texelFetch(seen_normal, pixel, 0).w == 1.0) found = pixel;
  }
  coarse_normal = texelFetch(seen_normal, found, 0);
  coarse_tangent = texelFetch(seen_tangent, found, 0);
  coarse_uv = texelFetch(seen_uv, found, 0).xy;
}
`;

/** Light of fewer pixels, spread over all: between the four around, as far as they show the object. */
export const spreading = /* glsl */ `#version 300 es
precision highp float;
uniform highp sampler2D coarse_light; // 0 where the object is not, in A, too
uniform highp sampler2D seen_normal;
uniform int seen_every;
out vec4 radiance;

void main() {
  if (texelFetch(seen_normal, ivec2(gl_FragCoord.xy), 0).w != 1.0) discard;
  vec4 light = texture(coarse_light, gl_FragCoord.xy / (float(seen_every) * vec2(textureSize(coarse_light, 0))));
  radiance = vec4(light.rgb / light.a, 1.0);
}
`;
