// Objects of the user's own: glTF and OBJ files, brought to the stage's size.

import { Box3, Mesh, Vector3 } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
import { toCreasedNormals } from 'three/addons/utils/BufferGeometryUtils.js';

const HEIGHT = 2; // of the stage's own objects, at most
const DIAGONAL = 2.7; // of the box around it, at most, so that the camera sees all of it
const VIEW = { origin: [0, 2.6, 7.2], target: [0, 1, 0], fov: 19.5 };
const CREASE = Math.PI / 6; // between faces, from which on an edge without normals is sharp

/**
 * {parts, view} from a file .glb, .gltf (with nothing beside it) or .obj; it stands on the floor, y up. Its
 * own materials are left out. `plinth` is the part that it stands on, if any.
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
    if (child instanceof Mesh) meshes.push(part(child));
  });
  if (meshes.length === 0) throw new Error(`${file.name}: there is no surface in it`);
  stand(meshes);
  return { parts: [...meshes, ...plinth], view: VIEW };
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

function part(mesh) {
  const placed = mesh.geometry.clone().applyMatrix4(mesh.matrixWorld);
  const geometry = placed.attributes.normal ? placed : toCreasedNormals(placed, CREASE);
  const { position, normal, uv } = geometry.attributes;
  const index = geometry.index?.array ?? Uint32Array.from({ length: position.count }, (_, i) => i);
  return {
    role: 'object',
    positions: numbers(position, 3),
    normals: numbers(normal, 3),
    uv: uv ? numbers(uv, 2) : new Float32Array(2 * position.count),
    triangles: Uint32Array.from(index),
  };
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
