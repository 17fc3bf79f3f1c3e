// The ray through a point of the picture.

export const camera = /* glsl */ `
uniform vec3 camera_origin;
// Right, up and ahead; the first two span the picture's half width and height at distance 1
uniform mat3 camera_axes;
uniform vec2 picture_size;

vec3 camera_ray(vec2 at) {
  vec2 on_film = 2.0 * at / picture_size - 1.0;
  return normalize(camera_axes * vec3(on_film, 1.0));
}
`;
