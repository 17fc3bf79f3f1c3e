// Linear radiance as the screen shows it: exposure and a view transform; two materials side by side.

/** Luminance of the largest difference that the scale resolves, either way. */
export const LARGEST_DIFFERENCE = 0.25;

/** The program of a view transform, which is `displayed` in GLSL. */
export const display = (displayed) => /* glsl */ `#version 300 es
precision highp float;
uniform highp sampler2D picture_a;
uniform highp sampler2D picture_b;
uniform float exposure; // stops
uniform float split; // left of it a is shown, right of it b
uniform bool difference;
uniform bool photographed; // whether b is a photograph, which a screen shows as it is
uniform vec2 corner; // of the pictures on the target, the lower left one
out vec4 colour;

vec3 radiance(sampler2D picture) {
  vec4 sum = texelFetch(picture, ivec2(gl_FragCoord.xy - corner), 0);
  return exp2(exposure) * sum.rgb / max(sum.a, 1e-6);
}

${displayed}
void main() {
  if (difference) {
    // Blue where b is darker, red where it is brighter, white where both are the same
    vec3 luminance = vec3(0.2126, 0.7152, 0.0722);
    float x = dot(radiance(picture_b) - radiance(picture_a), luminance) / ${LARGEST_DIFFERENCE};
    vec3 end = x < 0.0 ? vec3(0.13, 0.4, 0.67) : vec3(0.7, 0.09, 0.17);
    colour = vec4(mix(vec3(0.97), end, min(abs(x), 1.0)), 1.0);
    return;
  }
  bool left = gl_FragCoord.x - corner.x < split * float(textureSize(picture_a, 0).x);
  if (photographed && !left) {
    colour = vec4(texelFetch(picture_b, ivec2(gl_FragCoord.xy - corner), 0).rgb, 1.0);
    return;
  }
  colour = vec4(displayed(max(left ? radiance(picture_a) : radiance(picture_b), 0.0)), 1.0);
}
`;

/** Sums of absolute differences of luminance over parts of the picture, and counts of their pixels. */
export const metering = /* glsl */ `#version 300 es
precision highp float;
uniform highp sampler2D picture_a;
uniform highp sampler2D picture_b;
uniform float exposure; // stops
uniform vec2 parts; // along both sides
out vec4 sum;

vec3 radiance(sampler2D picture, ivec2 pixel) {
  vec4 sum = texelFetch(picture, pixel, 0);
  return exp2(exposure) * sum.rgb / max(sum.a, 1e-6);
}

void main() {
  vec2 size = vec2(textureSize(picture_a, 0)) / parts, corner = floor(gl_FragCoord.xy) * size;
  float total = 0.0, count = 0.0;
  for (int y = int(corner.y); y < int(corner.y + size.y); y++) {
    for (int x = int(corner.x); x < int(corner.x + size.x); x++) {
      vec3 apart = radiance(picture_b, ivec2(x, y)) - radiance(picture_a, ivec2(x, y));
      total += abs(dot(apart, vec3(0.2126, 0.7152, 0.0722)));
      count += 1.0;
    }
  }
  sum = vec4(total, count, 0.0, 0.0);
}
`;

/**
 * Adds a pass to what was summed up: every sample to all pixels near it, by Mitsuba's Gaussian of half a
 * pixel.
 */
export const adding = /* glsl */ `#version 300 es
precision highp float;
uniform highp sampler2D before;
uniform highp sampler2D added;
uniform vec2 within; // where the samples lie in their pixels
out vec4 sum;

float gaussian(float x) {
  return max(exp(-2.0 * x * x) - exp(-8.0), 0.0);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(added, 0) - 1;
  sum = texelFetch(before, pixel, 0);
  float across[5];
  for (int i = 0; i < 5; i++) across[i] = gaussian(float(i) - 2.5 + within.x);
  for (int j = 0; j < 5; j++) {
    int y = pixel.y + j - 2;
    float along = y < 0 || y > last.y ? 0.0 : gaussian(float(j) - 2.5 + within.y);
    for (int i = 0; i < 5; i++) {
      int x = pixel.x + i - 2;
      float weight = x < 0 || x > last.x ? 0.0 : along * across[i];
      sum += weight * texelFetch(added, clamp(ivec2(x, y), ivec2(0), last), 0);
    }
  }
}
`;

/** The sum so far over the preview, which gives way as samples come. */
export const blending = /* glsl */ `#version 300 es
precision highp float;
uniform highp sampler2D picture;
uniform highp sampler2D sum;
uniform float trust;
out vec4 radiance;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 traced = texelFetch(sum, pixel, 0);
  radiance = vec4(mix(texelFetch(picture, pixel, 0).rgb, traced.rgb / max(traced.a, 1e-6), trust), 1.0);
}
`;

/**
 * By how much paths are darker than the preview, in luminance, since another colour may come next; the object's lights
 * may move, so that it only learns shadows.
 */
export const learning = /* glsl */ `#version 300 es
precision highp float;
uniform highp sampler2D sum;
uniform highp sampler2D picture;
uniform highp sampler2D shade; // that the picture has already
uniform highp sampler2D seen_normal;
out vec4 learnt;

void main() {
  // Average both over the neighbours of the same material, since paths are noisy
  ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(sum, 0) - 1;
  float material = texelFetch(seen_normal, pixel, 0).w;
  vec3 traced = vec3(0.0), plain = vec3(0.0);
  for (int k = 0; k < 25; k++) {
    ivec2 at = clamp(pixel + ivec2(k % 5, k / 5) - 2, ivec2(0), last);
    if (texelFetch(seen_normal, at, 0).w != material) continue;
    vec4 total = texelFetch(sum, at, 0);
    traced += total.rgb / max(total.a, 1e-6);
    plain += texelFetch(picture, at, 0).rgb / texelFetch(shade, at, 0).rgb;
  }
  vec3 luminance = vec3(0.2126, 0.7152, 0.0722);
  float share = dot(luminance, traced) / max(dot(luminance, plain), 1e-4);
  learnt = vec4(vec3(clamp(share, 0.02, material == 1.0 ? 1.0 : 2.0)), 1.0);
}
`;
