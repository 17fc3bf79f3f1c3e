// One path through every pixel: the environment by visible normals and by itself, weighed by the power
// heuristic.

import { GREY, MAX_DEPTH } from '../scene.js';
import { camera } from './camera.glsl.js';
import { covering } from './covering.glsl.js';
import { environment } from './environment.glsl.js';
import { random } from './random.glsl.js';
import { scene } from './scene.glsl.js';

/** The fragment shader for a material, as call("shader") has it. */
export const tracer = (shader) => `#version 300 es
${shader.text}
${random}
${camera}
${environment}
${scene}
${covering(shader)}
${PATH}`;

const PATH = /* glsl */ `
uniform vec2 within; // the place within a pixel
out vec4 radiance;

// Value and density of a surface; the grey one reflects 18 percent, diffusely
vec4 surface_eval_pdf(int material, VtMaterial m, VtLobes l, vec3 wi, vec3 wo) {
  if (material != ${GREY}) return vt_eval_pdf(m, l, wi, wo);
  float cos_o = wi.z > 0.0 ? max(wo.z, 0.0) : 0.0;
  return vec4(vec3(0.18), 1.0) * cos_o / 3.14159265;
}

vec3 surface_sample(int material, VtMaterial m, VtLobes l, vec3 wi, vec3 u) {
  if (material != ${GREY}) return vt_sample(m, l, wi, u);
  float r = sqrt(u.y), phi = 6.2831853 * u.z;
  return vec3(r * cos(phi), r * sin(phi), sqrt(1.0 - u.y));
}

float weight(float a, float b) {
  return a * a / (a * a + b * b);
}

void main() {
  // Start at the same place within every pixel
  random_start(ivec2(gl_FragCoord.xy));
  vec3 origin = camera_origin, direction = camera_ray(floor(gl_FragCoord.xy) + within);

  // Follow it: at even steps to the next surface, at odd ones from there to the light
  vec3 found = vec3(0.0), carried = vec3(1.0), lit = vec3(0.0), wi;
  float density = -1.0;
  Point point;
  VtMaterial m;
  VtLobes l;
  for (int k = 0; k < ${2 * MAX_DEPTH - 1}; k++) {
    bool to_light = (k & 1) == 1;
    int dimension = 5 * (k >> 1);
    Hit hit = scene_trace(origin, direction, to_light && lit == vec3(0.0) ? 0.0 : 1e30, to_light);
    vec3 wo;
    vec4 light;
    if (to_light) {
      // Add the light that arrives, and sample the next direction
      if (hit.triangle < 0) found += lit;
      vec3 u = vec3(random_number(dimension + 2), random_pair(dimension + 3));
      wo = surface_sample(point.material, m, l, wi, u);
      direction = point.s * wo.x + point.t * wo.y + point.n * wo.z;
    } else {
      if (hit.triangle < 0) {
        light = environment_eval(direction);
        found += carried * light.rgb * (density < 0.0 ? 1.0 : weight(density, light.a));
        break;
      }
      if (k == ${2 * MAX_DEPTH - 2}) break;

      // Look at the surface, and draw a light
      point = scene_point(hit);
      wi = -vec3(dot(direction, point.s), dot(direction, point.t), dot(direction, point.n));
      if (point.material != ${GREY}) {
        m = vt_material(point.uv);
        l = on_part(vt_lobes(m, wi), point.material - 1);
      }
      direction = environment_sample(random_pair(dimension));
      light = environment_eval(direction);
      wo = vec3(dot(direction, point.s), dot(direction, point.t), dot(direction, point.n));
    }
    vec4 f = surface_eval_pdf(point.material, m, l, wi, wo);
    origin = scene_leave(point, direction);
    if (to_light) {
      if (!(f.a > 0.0)) break;
      carried *= f.rgb / f.a;
      density = f.a;
    } else lit = light.a > 0.0 ? carried * f.rgb * light.rgb * weight(light.a, f.a) / light.a : vec3(0.0);
  }
  radiance = vec4(found, 1.0);
}
`;
