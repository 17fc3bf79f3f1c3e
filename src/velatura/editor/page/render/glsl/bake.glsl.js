// The lobes over direction: drawn once for all that read them, and read for plots.

/** Draws `count` texels of every node at once, from the `first` on. */
export const bake = (baking, count) => `#version 300 es
${baking}
uniform int first;
${each(count, (k) => `layout(location = ${k}) out vec4 baked_${k};`)}

void main() {
  vec4 texels[VT_TEXELS] = vt_bake_node(ivec2(gl_FragCoord.xy));
  ${each(count, (k) => `baked_${k} = texels[min(first + ${k}, VT_TEXELS - 1)];`)}
}
`;

const each = (count, f) => Array.from({ length: count }, (_, k) => f(k)).join('\n');

/**
 * Two rows of pixels for each lobe and azimuth: energy and alpha_u, then alpha_v and rotation; cosines along
 * x.
 */
export const probe = (shader, places) => `#version 300 es
${shader.text}
uniform float cosines[${PROBED}];
uniform float azimuths[${PROBED}];
out vec4 probed;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float z = cosines[pixel.x], r = sqrt(1.0 - z * z), phi = azimuths[pixel.y / ${2 * places.length}];
  VtLobes l = vt_lobes(vt_material(vec2(0.5)), vec3(r * cos(phi), r * sin(phi), z));
  switch (pixel.y % ${2 * places.length}) {
${places.map(cases).join('\n')}
  }
}
`;

/** Most cosines, and azimuths. */
export const PROBED = 64;

const cases = (place, k) => `\
  case ${2 * k}: probed = vec4(l.${place}.energy, l.${place}.alpha_u); break;
  case ${2 * k + 1}: probed = vec4(l.${place}.alpha_v, l.${place}.rotation, 0.0, 0.0); break;`;
