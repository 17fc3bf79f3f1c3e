// The environment: radiance from a direction, and directions drawn in proportion to it.

/**
 * An equirectangular picture: columns from -z over +x, their centres inside; rows from +y to -y, the poles on
 * rows.
 */
const MAPPING = /* glsl */ `
uniform vec2 environment_turn; // cosine and sine of its rotation about y

vec3 from_environment(vec3 d) {
  vec2 turn = environment_turn;
  return vec3(turn.x * d.x + turn.y * d.z, d.y, turn.x * d.z - turn.y * d.x);
}

vec3 to_environment(vec3 d) {
  vec2 turn = environment_turn;
  return vec3(turn.x * d.x - turn.y * d.z, d.y, turn.x * d.z + turn.y * d.x);
}

vec2 environment_uv(vec3 d) {
  vec3 w = to_environment(d);
  return vec2(fract(atan(w.x, -w.z) * 0.15915494), acos(clamp(w.y, -1.0, 1.0)) * 0.31830989);
}
`;

export const environment = /* glsl */ `
${MAPPING}
uniform highp sampler2D environment_picture; // radiance, and the density of the cell towards the next texels
// Running sums of a row's cells; in the last column those of the rows
uniform highp sampler2D environment_steps;

// Radiance, and the density of environment_sample
vec4 environment_eval(vec3 d) {
  ivec2 size = textureSize(environment_picture, 0);
  vec2 uv = environment_uv(d);
  float x = uv.x * float(size.x) - 0.5, y = uv.y * float(size.y - 1);
  ivec2 cell = ivec2(floor(x), min(int(y), size.y - 2));
  vec2 within = vec2(x, y) - vec2(cell);
  int left = (cell.x + size.x) % size.x, right = (cell.x + 1) % size.x;
  vec4 a = texelFetch(environment_picture, ivec2(left, cell.y), 0);
  vec3 b = texelFetch(environment_picture, ivec2(right, cell.y), 0).rgb;
  vec3 c = texelFetch(environment_picture, ivec2(left, cell.y + 1), 0).rgb;
  vec3 e = texelFetch(environment_picture, ivec2(right, cell.y + 1), 0).rgb;
  float sin_theta = sqrt(max(1.0 - d.y * d.y, 1e-12));
  return vec4(mix(mix(a.rgb, b, within.x), mix(c, e, within.x), within.y), a.a / (19.7392088 * sin_theta));
}

// The first of count sums along an axis that is above u, and how far u is on the way to it
vec2 environment_find(ivec2 start, ivec2 along, int count, float u) {
  int low = 0, high = count - 1;
  while (low < high) {
    int middle = (low + high) >> 1;
    if (texelFetch(environment_steps, start + middle * along, 0).r > u) high = middle;
    else low = middle + 1;
  }
  float end = texelFetch(environment_steps, start + low * along, 0).r;
  float begin = low > 0 ? texelFetch(environment_steps, start + (low - 1) * along, 0).r : 0.0;
  return vec2(float(low), clamp((u - begin) / max(end - begin, 1e-20), 0.0, 0.9999999));
}

vec3 environment_sample(vec2 u) {
  ivec2 cells = textureSize(environment_steps, 0) - ivec2(1, 0);
  vec2 row = environment_find(ivec2(cells.x, 0), ivec2(0, 1), cells.y, u.y);
  vec2 column = environment_find(ivec2(0, int(row.x)), ivec2(1, 0), cells.x, u.x);
  float phi = 6.2831853 * (column.x + column.y + 0.5) / float(cells.x);
  float theta = 3.14159265 * (row.x + row.y) / float(cells.y);
  return from_environment(vec3(sin(phi) * sin(theta), cos(theta), -cos(phi) * sin(theta)));
}
`;

export const blurredEnvironment = /* glsl */ `
${MAPPING}
uniform highp sampler2D environment_blurred; // radiance, with smaller and smaller pictures

// Radiance from a cone of a solid angle, from pictures that are blurred as much
vec3 environment_cone(vec3 d, float solid_angle) {
  vec2 size = vec2(textureSize(environment_blurred, 0));
  float sin_theta = sqrt(max(1.0 - d.y * d.y, 1e-4));
  float texels = solid_angle * size.x * size.y / (19.7392088 * sin_theta);
  return textureLod(environment_blurred, environment_uv(d), 0.5 * log2(max(texels, 1.0))).rgb;
}
`;
