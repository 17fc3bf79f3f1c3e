// The G-buffer of the preview: surfaces drawn once for a view, all around the object lit once, and the object lit
// again whenever a value changes.

import { Box3, Matrix4, Vector3, Vector4 } from 'three';

import { coarsening, spreading, surroundings } from './glsl/preview.glsl.js';
import { raster, rasterVertex } from './glsl/raster.glsl.js';
import { GREY } from './scene.js';

const SEEN = ['RGBA16F', 'RGBA16F', 'RG32F'];

/** What a camera sees of a scene; kept until either changes. */
export class GBuffer {
  #device;
  #raster = null; // programs
  #surroundings = null;
  #coarsening = null;
  #spreading = null;
  #array = null; // of vertices
  #buffers = [];
  #count = 0; // of vertices
  #corners = []; // of the box around the object
  #bounds = null; // of the object in the picture
  #seen = null; // targets
  #coarse = null; // targets of blocks of pixels, null where none were asked for
  #coarseLight = null;
  #block = 0; // their pixels along both axes
  #outdated = true;

  constructor(device) {
    this.#device = device;
  }

  /** The texture of the normals that are seen. */
  get normals() {
    return this.#seen.textures[0];
  }

  async compile() {
    const device = this.#device;
    [this.#raster, this.#surroundings, this.#coarsening, this.#spreading] = await Promise.all([
      device.program(raster, rasterVertex),
      ...[surroundings, coarsening, spreading].map((text) => device.program(text)),
    ]);
  }

  setScene(scene) {
    const { gl } = this.#device;
    this.#delete();
    this.#array = gl.createVertexArray();
    gl.bindVertexArray(this.#array);
    const tangents = new Float32Array((4 * scene.tangents.length) / 3);
    scene.materials.forEach((material, i) => {
      tangents.set(scene.tangents.subarray(3 * i, 3 * i + 3), 4 * i);
      tangents[4 * i + 3] = material;
    });
    this.#buffers = [
      [scene.positions, 3],
      [scene.normals, 3],
      [tangents, 4],
      [scene.uv, 2],
    ].map(([data, size], i) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, size, gl.FLOAT, false, 0, 0);
      return buffer;
    });
    const indices = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, scene.triangles, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    this.#buffers.push(indices);
    this.#count = scene.triangles.length;
    this.#corners = corners(scene);
    this.#outdated = true;
  }

  setSize(width, height) {
    const device = this.#device;
    device.free(this.#seen, this.#coarse, this.#coarseLight);
    this.#seen = device.target(width, height, SEEN, { depth: true });
    this.#coarse = this.#coarseLight = null;
    this.#outdated = true;
  }

  /** The camera is another one now. */
  outdate() {
    this.#outdated = true;
  }

  /** Draws the visible surfaces, if they have changed. */
  update(projection) {
    if (!this.#outdated) return;
    this.#outdated = false;
    this.#bounds = projected(this.#corners, projection);
    this.#draw(projection);
    if (this.#coarse) this.#coarsen();
  }

  /** What a pixel shows of the object: its normal, and the number of the part, from 0 on; null where it shows nothing of it. */
  at(x, y) {
    const [[nx, ny, nz, kind], [, , , part]] = this.#device.pixel(this.#seen, x, y);
    return kind === 1 ? { normal: [nx, ny, nz], part } : null;
  }

  /** Draws all around the object. */
  drawSurroundings(uniforms, target) {
    this.#device.draw(this.#surroundings, { ...uniforms, ...named(this.#seen) }, target);
  }

  /** Draws the object by a program into its surroundings; a `block` of pixels, along both axes, is one. */
  drawObject(program, uniforms, target, block) {
    const device = this.#device;
    const draw = (program, uniforms, target) => device.draw(program, uniforms, target, within(this.#bounds, target));
    if (block === 1) return draw(program, { ...uniforms, ...named(this.#seen), seen_every: 1 }, target);
    this.#setBlock(block);
    const light = this.#coarseLight;
    device.clear(light, 0);
    draw(program, { ...uniforms, ...named(this.#coarse), seen_every: block }, light);
    return draw(this.#spreading, { coarse_light: light.textures[0], seen_every: block, ...named(this.#seen) }, target);
  }

  /** Waits for the first pixel by a program that is to draw the object. */
  warm(program, uniforms) {
    return this.#device.warm(program, { ...uniforms, ...named(this.#seen), seen_every: 1 }, 'RGBA16F');
  }

  #setBlock(block) {
    if (this.#coarse && this.#block === block) return;
    const device = this.#device, { width, height } = this.#seen;
    device.free(this.#coarse, this.#coarseLight);
    const size = [width, height].map((length) => Math.ceil(length / block));
    this.#coarse = device.target(...size, SEEN);
    this.#coarseLight = device.target(...size, ['RGBA16F'], { filter: 'LINEAR' });
    this.#block = block;
    this.#coarsen();
  }

  #coarsen() {
    this.#device.draw(this.#coarsening, { ...named(this.#seen), seen_every: this.#block }, this.#coarse);
  }

  #draw(projection) {
    const { gl } = this.#device;
    this.#device.use(this.#raster, { camera_projection: projection });
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#seen.handle);
    gl.viewport(0, 0, this.#seen.width, this.#seen.height);
    gl.enable(gl.DEPTH_TEST);
    [0, 1, 2].forEach((i) => gl.clearBufferfv(gl.COLOR, i, [0, 0, 0, 0]));
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    gl.bindVertexArray(this.#array);
    gl.drawElements(gl.TRIANGLES, this.#count, gl.UNSIGNED_INT, 0);
  }

  #delete() {
    const { gl } = this.#device;
    this.#buffers.forEach((buffer) => gl.deleteBuffer(buffer));
    if (this.#array) gl.deleteVertexArray(this.#array);
  }
}

function named({ textures: [normal, tangent, uv] }) {
  return { seen_normal: normal, seen_tangent: tangent, seen_uv: uv };
}

/** The eight corners of the box around the object. */
function corners({ positions, materials }) {
  const box = new Box3(), point = new Vector3();
  materials.forEach((material, i) => material !== GREY && box.expandByPoint(point.fromArray(positions, 3 * i)));
  const { min, max } = box;
  return Array.from({ length: 8 }, (_, k) => [k & 1 ? min.x : max.x, k & 2 ? min.y : max.y, k & 4 ? min.z : max.z]);
}

/** Where corners are seen, as parts of the picture: its columns and rows, each from the first to the last. */
function projected(corners, projection) {
  const matrix = new Matrix4().fromArray(projection);
  const seen = corners.map((corner) => new Vector4(...corner, 1).applyMatrix4(matrix));
  if (seen.some(({ w }) => w <= 0)) return { columns: [0, 1], rows: [0, 1] }; // beside or behind the camera
  const extent = (axis) => {
    const places = seen.map((point) => 0.5 + (0.5 * point[axis]) / point.w);
    return [Math.min(...places), Math.max(...places)];
  };
  return { columns: extent('x'), rows: extent('y') };
}

/** The pixels of a target that a part of the picture has to do with. */
function within({ columns, rows }, { width, height }) {
  const pixels = ([first, last], count) => {
    const end = Math.min(Math.max(Math.ceil(last * count) + 1, 0), count);
    return [Math.min(Math.max(Math.floor(first * count) - 1, 0), end), end];
  };
  return { columns: pixels(columns, width), rows: pixels(rows, height) };
}
