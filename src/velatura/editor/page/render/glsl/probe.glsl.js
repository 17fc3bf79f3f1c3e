// The lobes of a material, read for plots.

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
