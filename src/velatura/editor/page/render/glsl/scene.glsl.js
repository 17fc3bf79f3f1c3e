// Rays against the triangles of the scene, and the attributes of a hit.

import { NODES_WIDTH, TRIANGLES_WIDTH } from '../scene.js';

export const scene = /* glsl */ `
uniform highp usampler2D scene_nodes; // a texel each: bounds, and how many to skip, or triangles
uniform vec3 grid_origin; // of the bounds
uniform vec3 grid_scale;
uniform highp sampler2D scene_triangles; // eight texels each: corner, two edges, three normals, tangent
uniform int scene_count; // nodes of one ordering

uvec4 scene_node(int i) {
  return texelFetch(scene_nodes, ivec2(i & ${NODES_WIDTH - 1}, i >> ${Math.log2(NODES_WIDTH)}), 0);
}

vec4 scene_texel(int i) {
  ivec2 place = ivec2(i & ${TRIANGLES_WIDTH - 1}, i >> ${Math.log2(TRIANGLES_WIDTH)});
  return texelFetch(scene_triangles, place, 0);
}

struct Hit {
  float far; // distance
  int triangle; // -1 for none
  vec2 at; // barycentric, of the second and third corner
};

void scene_intersect(int triangle, vec3 origin, vec3 direction, inout Hit hit) {
  vec3 corner = scene_texel(8 * triangle).xyz;
  vec3 a = scene_texel(8 * triangle + 1).xyz, b = scene_texel(8 * triangle + 2).xyz;
  vec3 across = cross(direction, b), from = origin - corner;
  float scale = 1.0 / dot(a, across);
  float u = scale * dot(from, across);
  vec3 turned = cross(from, a);
  float v = scale * dot(direction, turned), far = scale * dot(b, turned);
  // Leave no gaps between neighbours
  bool inside = u >= -1e-6 && v >= -1e-6 && u + v <= 1.000001;
  if (inside && far > 0.0 && far < hit.far) hit = Hit(far, triangle, vec2(u, v));
}

// The nearest hit within reach, or any
Hit scene_trace(vec3 origin, vec3 direction, float reach, bool any_hit) {
  vec3 inverse = 1.0 / (grid_scale * mix(direction, vec3(1e-18), equal(direction, vec3(0.0))));
  vec3 from = grid_scale * (origin - grid_origin);
  Hit hit = Hit(reach, -1, vec2(0.0));
  ivec3 backwards = ivec3(lessThan(direction, vec3(0.0)));
  int node = (backwards.x + 2 * backwards.y + 4 * backwards.z) * scene_count, end = node + scene_count;
  while (node < end) {
    uvec4 packed = scene_node(node);
    vec3 a = (vec3(ivec3(packed.xyz & 0xffffu)) - from) * inverse;
    vec3 b = (vec3(ivec3(packed.xyz >> 16)) - from) * inverse;
    vec3 nearer = min(a, b), farther = max(a, b);
    float enters = max(max(nearer.x, nearer.y), max(nearer.z, 0.0));
    float leaves = min(min(farther.x, farther.y), farther.z);
    bool inside = leaves * 1.000001 >= enters && enters < hit.far, leaf = packed.w >= 0x80000000u;
    if (inside && leaf) {
      int first = int(packed.w & 0xffffffu), last = first + int((packed.w >> 24) & 0x7fu);
      for (int i = first; i < last; i++) scene_intersect(i, origin, direction, hit);
      if (any_hit && hit.triangle >= 0) break;
    }
    node += inside || leaf ? 1 : int(packed.w);
  }
  return hit;
}

struct Point {
  vec3 position;
  vec3 outwards; // of the triangle
  vec3 s; // the shading frame
  vec3 t;
  vec3 n;
  vec2 uv;
  int material;
};

Point scene_point(Hit hit) {
  int i = 8 * hit.triangle;
  vec4 corner = scene_texel(i), a = scene_texel(i + 1), b = scene_texel(i + 2);
  vec4 n0 = scene_texel(i + 3), n1 = scene_texel(i + 4), n2 = scene_texel(i + 5);
  vec4 tangent = scene_texel(i + 6);
  vec3 weights = vec3(1.0 - hit.at.x - hit.at.y, hit.at);
  Point point;
  point.position = corner.xyz + hit.at.x * a.xyz + hit.at.y * b.xyz;
  point.outwards = normalize(cross(a.xyz, b.xyz));
  point.n = normalize(weights.x * n0.xyz + weights.y * n1.xyz + weights.z * n2.xyz);
  point.s = normalize(tangent.xyz - point.n * dot(point.n, tangent.xyz));
  point.t = cross(point.n, point.s);
  point.uv = vec2(dot(weights, vec3(n0.w, n1.w, n2.w)), dot(weights, vec3(corner.w, a.w, b.w)));
  point.material = int(tangent.w);
  return point;
}

// A little off the surface, on the side of a direction
vec3 scene_leave(Point point, vec3 direction) {
  vec3 size = abs(point.position);
  float off = (1.0 + max(max(size.x, size.y), size.z)) * 9e-5;
  return point.position + (dot(point.outwards, direction) < 0.0 ? -off : off) * point.outwards;
}
`;
