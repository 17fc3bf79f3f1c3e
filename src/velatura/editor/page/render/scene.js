// Triangles and the hierarchy over them, laid out for the path tracer, and buffers for the preview.

import { BufferAttribute, BufferGeometry } from 'three';
import { MeshBVH, MeshBVHUniformStruct, SAH } from 'three-mesh-bvh';

export const NODES_WIDTH = 1024; // texels
export const TRIANGLES_WIDTH = 2048;
export const MAX_DEPTH = 6; // surfaces met by a path, and the light at last
export const GREY = 0; // the material of vertices of the plinth and the ground; the parts of the object are numbered from 1
const TEXELS = 8; // of a triangle
const MOST_TRIANGLES = 500_000;
const LEAF = 0xffff0000;
const GRID = 0xffff;

/**
 * One mesh of parts [{role, name, positions, normals, uv, triangles}].
 *
 * @returns {{positions, normals, tangents, uv, materials, triangles, names}} per vertex, but for `triangles` (three vertices
 *   each), and the `names` of the parts of the object.
 */
export function buildScene(parts) {
  const mesh = joined(parts);
  return { ...mesh, tangents: averaged(mesh, tangents(mesh)) };
}

/**
 * The textures of a mesh for ray tracing, which takes a moment; sorts its triangles.
 *
 * @returns {{nodes, packed, count, grid}} `nodes` and `packed` (RGBA, whole rows), the `count` of nodes and their `grid`.
 */
export function forPaths(mesh) {
  const bvh = hierarchy(mesh);
  return { ...bvh, packed: packed(mesh, tangents(mesh)) };
}

const isObject = ({ role }) => role === 'object';

/** The names of the parts of an object, each once; '' of an object without parts. */
export const namesOf = (parts) => [...new Set(parts.filter(isObject).map(({ name = '' }) => name))];

function joined(parts) {
  const total = (key) => parts.reduce((sum, part) => sum + part[key].length, 0);
  if (total('triangles') / 3 > MOST_TRIANGLES) {
    throw new Error(`the object has ${total('triangles') / 3} triangles, more than ${MOST_TRIANGLES}`);
  }
  const names = namesOf(parts);
  const mesh = {
    names,
    positions: new Float32Array(total('positions')),
    normals: new Float32Array(total('normals')),
    uv: new Float32Array(total('uv')),
    triangles: new Uint32Array(total('triangles')),
    materials: new Float32Array(total('positions') / 3),
  };
  let vertices = 0;
  let corners = 0;
  for (const part of parts) {
    mesh.positions.set(part.positions, 3 * vertices);
    mesh.normals.set(part.normals, 3 * vertices);
    mesh.uv.set(part.uv, 2 * vertices);
    const material = isObject(part) ? 1 + names.indexOf(part.name ?? '') : GREY;
    mesh.materials.fill(material, vertices, vertices + part.positions.length / 3);
    mesh.triangles.set(
      part.triangles.map((i) => i + vertices),
      corners,
    );
    vertices += part.positions.length / 3;
    corners += part.triangles.length;
  }
  return mesh;
}

/** Sorts the triangles, and lays the nodes out once for each octant that rays go to. */
function hierarchy(mesh) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(mesh.positions, 3));
  geometry.setIndex(new BufferAttribute(mesh.triangles, 1));
  const bvh = new MeshBVH(geometry, { strategy: SAH, targetLeafSize: 4 });
  const struct = new MeshBVHUniformStruct();
  struct.updateFrom(bvh);
  return threaded(struct.bvhBounds.image.data, struct.bvhContents.image.data);
}

/**
 * Nodes in the order in which a ray meets them, nearer child first: on a hit go on with the next one, on a
 * miss skip as many as the node says. No stack, which shaders have to keep in slow memory. A node is a texel:
 * x, y and z hold its bounds, rounded outwards to 16 bits of those of the scene; w a leaf's first triangle
 * with their number above 24 bits and the highest bit set, or what to skip.
 */
function threaded(bounds, contents) {
  const order = new Uint32Array(contents.length / 2);
  const skip = new Uint32Array(contents.length / 2);
  const count = walk(contents, 0, order, skip);
  const grid = gridOf(bounds);
  const rows = Math.ceil((8 * count) / NODES_WIDTH);
  const nodes = new Uint32Array(4 * NODES_WIDTH * rows);
  for (let octant = 0; octant < 8; octant++) {
    walk(contents, octant, order, skip);
    for (let k = 0; k < count; k++) {
      const i = order[k];
      const at = 4 * (octant * count + k);
      for (let c = 0; c < 3; c++) {
        const low = Math.floor((bounds[8 * i + c] - grid.origin[c]) * grid.scale[c]);
        const high = Math.ceil((bounds[8 * i + 4 + c] - grid.origin[c]) * grid.scale[c]);
        nodes[at + c] = Math.max(low, 0) | (Math.min(high, GRID) << 16);
      }
      const [first, second] = contents.subarray(2 * i, 2 * i + 2);
      nodes[at + 3] = first >= LEAF ? (0x80 | (first & 0x7f)) * 2 ** 24 + second : skip[k];
    }
  }
  return { nodes, count, grid };
}

/** Where the bounds lie on a grid of 16 bits. */
function gridOf(bounds) {
  const origin = [...bounds.subarray(0, 3)];
  const scale = [0, 1, 2].map((c) => GRID / Math.max(bounds[4 + c] - bounds[c], 1e-6));
  return { origin, scale };
}

/** Depth first: fills `order` with nodes and `skip` with the sizes of their subtrees; how many there are. */
function walk(contents, octant, order, skip) {
  let count = 0;
  const visit = (i) => {
    const at = count++;
    order[at] = i;
    const first = contents[2 * i];
    if (first < LEAF) {
      const children = [i + 1, i + contents[2 * i + 1]];
      const backwards = (octant >> first) & 1;
      visit(children[backwards]);
      visit(children[1 - backwards]);
    }
    skip[at] = count - at;
  };
  visit(0);
  return count;
}

/**
 * dp/du of every triangle, of length 1; where texture coordinates are degenerate, any tangent (Duff et al.
 * 2017).
 */
function tangents({ positions, uv, triangles }) {
  const found = new Float32Array(triangles.length);
  const p = [0, 0, 0], q = [0, 0, 0]; // edges
  for (let k = 0; k < triangles.length; k += 3) {
    const i = triangles[k], a = triangles[k + 1], b = triangles[k + 2];
    for (let c = 0; c < 3; c++) {
      p[c] = positions[3 * a + c] - positions[3 * i + c];
      q[c] = positions[3 * b + c] - positions[3 * i + c];
    }
    const u0 = uv[2 * a] - uv[2 * i], v0 = uv[2 * a + 1] - uv[2 * i + 1];
    const u1 = uv[2 * b] - uv[2 * i], v1 = uv[2 * b + 1] - uv[2 * i + 1];
    const determinant = Math.fround(Math.fround(u0 * v1) - Math.fround(v0 * u1));
    if (determinant) for (let c = 0; c < 3; c++) p[c] = (v1 * p[c] - v0 * q[c]) / determinant;
    const [x, y, z] = determinant ? p : perpendicular(normalized(cross(p, q)));
    const length = Math.hypot(x, y, z) || 1;
    found[k] = x / length;
    found[k + 1] = y / length;
    found[k + 2] = z / length;
  }
  return found;
}

function perpendicular([x, y, z]) {
  const sign = z < 0 ? -1 : 1;
  const a = -1 / (sign + z);
  return [1 + sign * x * x * a, sign * x * y * a, -sign * x];
}

const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];

function normalized(v) {
  const length = Math.hypot(...v) || 1;
  return v.map((x) => x / length);
}

/** Tangents of vertices, for the preview. */
function averaged({ positions, triangles }, frames) {
  const sums = new Float32Array(positions.length);
  for (let corner = 0; corner < triangles.length; corner++) {
    const to = 3 * triangles[corner], from = corner - (corner % 3);
    for (let c = 0; c < 3; c++) sums[to + c] += frames[from + c];
  }
  return sums;
}

/**
 * What the path tracer reads of a triangle: corner, edges, normals, tangent; in w v, v, v, u, u, u and
 * material.
 */
function packed({ positions, normals, uv, materials, triangles }, frames) {
  const count = triangles.length / 3;
  const rows = Math.ceil((TEXELS * count) / TRIANGLES_WIDTH);
  const data = new Float32Array(4 * TRIANGLES_WIDTH * rows);
  for (let k = 0; k < count; k++) {
    const at = 4 * TEXELS * k;
    for (let corner = 0; corner < 3; corner++) {
      const i = triangles[3 * k + corner];
      for (let c = 0; c < 3; c++) {
        const from = corner ? positions[3 * triangles[3 * k] + c] : 0;
        data[at + 4 * corner + c] = positions[3 * i + c] - from;
        data[at + 4 * (corner + 3) + c] = normals[3 * i + c];
        data[at + 24 + c] = frames[3 * k + c];
      }
      data[at + 4 * corner + 3] = uv[2 * i + 1];
      data[at + 4 * (corner + 3) + 3] = uv[2 * i];
    }
    data[at + 27] = materials[triangles[3 * k]];
  }
  return data;
}
