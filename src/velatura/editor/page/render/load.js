// Objects of the user's own: glTF and OBJ files, brought to the stage's size.

import { Box3, Mesh, Vector3 } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
import { toCreasedNormals } from 'three/addons/utils/BufferGeometryUtils.js';

import { MOST_PARTS } from './glsl/covering.glsl.js';

const HEIGHT = 2; // of the stage's own objects, at most
const DIAGONAL = 2.7; // of the box around it, at most, so that the camera sees all of it
const VIEW = { origin: [0, 2.6, 7.2], target: [0, 1, 0], fov: 19.5 };
const LETTERS = 60; // of the name of a part
const UNNAMED = 'Without a material';
const FURTHER = 'Further parts';
const CREASE = Math.PI / 6; // between faces, from which on an edge without normals is sharp

/**
 * {parts, view} from a file .glb, .gltf (with nothing beside it) or .obj; it stands on the floor, y up. Its
 * own materials are left out, but their names are those of its parts. `plinth` is the part that it stands on, if any.
 */
export async function loadObject(file, plinth = []) {
  let root;
  try {
    root = await read(file);
  } catch (error) {
    throw new Error(`${file.name}: not a readable object (${error.message ?? error})`, { cause: error });
  }
  const meshes = [];
  root?.updateMatrixWorld(true); // none where a file has no scene
  root?.traverse((child) => {
    if (child instanceof Mesh) meshes.push(...partsOf(child));
  });
  if (meshes.length === 0) throw new Error(`${file.name}: there is no surface in it`);
  stand(meshes);
  const parts = [...named(meshes).values()].flat();
  return { parts: [...parts, ...plinth], view: VIEW };
}

/**
 * Meshes by the names of the parts that they are of: of their materials, or where all have the same, their own. The last has
 * all whose names are too many.
 */
function named(meshes) {
  const [by] = ['material', 'mesh'].filter((key) => new Set(meshes.map(({ names }) => names[key])).size > 1);
  const found = new Map();
  for (const { names, ...mesh } of meshes) {
    const own = by ? names[by].slice(0, LETTERS) || UNNAMED : '';
    const name = found.has(own) || found.size < MOST_PARTS - 1 ? own : FURTHER;
    found.set(name, [...(found.get(name) ?? []), { ...mesh, name }]);
  }
  return found;
}

const HEAD = 20; // bytes of a .glb before its JSON
const LITTLE = true;

/** The numbers of `meshes` and `materials` that a .gltf or .glb declares. */
export async function contentsOf(file) {
  const bytes = await file.arrayBuffer();
  const isBinary = bytes.byteLength >= HEAD && new DataView(bytes).getUint32(0, LITTLE) === 0x46546c67;
  const text = isBinary ? bytes.slice(HEAD, HEAD + new DataView(bytes).getUint32(12, LITTLE)) : bytes;
  try {
    const { meshes, materials } = JSON.parse(new TextDecoder().decode(text));
    return { meshes: meshes?.length ?? 0, materials: materials?.length ?? 0 };
  } catch {
    throw new Error(`${file.name}: is not a file of glTF`);
  }
}

async function read(file) {
  if (/\.obj$/i.test(file.name)) return new OBJLoader().parse(await file.text());
  if (/\.(glb|gltf)$/i.test(file.name)) {
    return (await new GLTFLoader().parseAsync(await file.arrayBuffer(), '')).scene;
  }
  throw new Error('an object is a file .glb, .gltf or .obj');
}

/** The parts of a mesh: one, or one for each of its materials. */
function partsOf(mesh) {
  const placed = mesh.geometry.clone().applyMatrix4(mesh.matrixWorld);
  const geometry = placed.attributes.normal ? placed : toCreasedNormals(placed, CREASE);
  const { position, normal, uv } = geometry.attributes;
  const whole = {
    positions: numbers(position, 3),
    normals: numbers(normal, 3),
    uv: uv ? numbers(uv, 2) : new Float32Array(2 * position.count),
  };
  const part = ({ name }, arrays, triangles) => ({ role: 'object', names: { material: name, mesh: mesh.name }, ...arrays, triangles });
  const counted = (length) => Uint32Array.from({ length }, (_, i) => i);
  if (!Array.isArray(mesh.material)) {
    const index = geometry.index?.array;
    return [part(mesh.material, whole, index ? Uint32Array.from(index) : counted(position.count))];
  }
  // Of .obj, where each triangle has vertices of its own
  return geometry.groups.map(({ start, count, materialIndex }) => {
    const within = ([key, array]) => [key, array.slice((array.length / position.count) * start, (array.length / position.count) * (start + count))];
    return part(mesh.material[materialIndex], Object.fromEntries(Object.entries(whole).map(within)), counted(count));
  });
}

/** The numbers of an attribute, which may be interleaved or normalised integers. */
function numbers(attribute, size) {
  const found = new Float32Array(size * attribute.count);
  for (let i = 0; i < found.length; i++) found[i] = attribute.getComponent(Math.floor(i / size), i % size);
  return found;
}

function stand(meshes) {
  const box = new Box3();
  const point = new Vector3();
  for (const { positions } of meshes) {
    for (let i = 0; i < positions.length; i += 3) box.expandByPoint(point.fromArray(positions, i));
  }
  const size = box.getSize(new Vector3());
  const scale = Math.min(HEIGHT / size.y, DIAGONAL / size.length());
  const centre = box.getCenter(new Vector3());
  const foot = [centre.x, box.min.y, centre.z];
  for (const { positions } of meshes) {
    for (let i = 0; i < positions.length; i++) positions[i] = (positions[i] - foot[i % 3]) * scale;
  }
}
