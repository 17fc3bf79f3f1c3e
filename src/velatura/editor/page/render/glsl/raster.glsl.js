// Attributes of the pixels, for the preview: material, normal, tangent, texture coordinates.

export const rasterVertex = /* glsl */ `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent; // and material: 0 of what is grey, else the number of the object's part, from 1 on
layout(location = 3) in vec2 uv;
uniform mat4 camera_projection;
out vec3 to_normal;
out vec4 to_tangent;
out vec2 to_uv;

void main() {
  to_normal = normal;
  to_tangent = tangent;
  to_uv = uv;
  gl_Position = camera_projection * vec4(position, 1.0);
}
`;

export const raster = /* glsl */ `#version 300 es
precision highp float;
in vec3 to_normal;
in vec4 to_tangent;
in vec2 to_uv;
layout(location = 0) out vec4 seen_normal; // and 1 on the object, 2 around it; 0 is the background
layout(location = 1) out vec4 seen_tangent; // and the number of the object's part
layout(location = 2) out vec2 seen_uv;

void main() {
  seen_normal = vec4(normalize(to_normal), to_tangent.w > 0.5 ? 1.0 : 2.0);
  seen_tangent = vec4(normalize(to_tangent.xyz), to_tangent.w - 1.0);
  seen_uv = to_uv;
}
`;
