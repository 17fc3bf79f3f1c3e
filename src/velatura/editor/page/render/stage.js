// The object and the light around it, on the device.

import { cameraUniforms } from './camera.js';
import { NODES_WIDTH, TRIANGLES_WIDTH, forPaths } from './scene.js';

export class Stage {
  #device;
  #scene = null; // the object, as buildScene has it
  #nodes = null; // of the hierarchy over it, and its triangles, once paths are wanted
  #triangles = null;
  #traversal = null;
  #radiance = null; // with the density of the cells of the environment
  #steps = null; // sums of these densities
  #blurred = null;
  #irradiance = null;

  constructor(device) {
    this.#device = device;
  }

  get hasObject() {
    return this.#scene !== null;
  }

  get hasLight() {
    return this.#radiance !== null;
  }

  /** Takes an object as buildScene has it. */
  setObject(scene) {
    this.#device.free(this.#nodes, this.#triangles);
    this.#scene = scene;
    this.#nodes = this.#triangles = this.#traversal = null;
  }

  #layOut() {
    const device = this.#device;
    const { nodes, packed, count, grid } = forPaths(this.#scene);
    this.#nodes = device.texture('RGBA32UI', NODES_WIDTH, nodes.length / (4 * NODES_WIDTH), nodes);
    this.#triangles = device.texture('RGBA32F', TRIANGLES_WIDTH, packed.length / (4 * TRIANGLES_WIDTH), packed);
    this.#traversal = {
      scene_nodes: this.#nodes,
      scene_triangles: this.#triangles,
      scene_count: count,
      grid_origin: grid.origin,
      grid_scale: grid.scale,
    };
    return this.#traversal;
  }

  /** Takes light as prepare of environment.js makes it ready. */
  setLight({ width, height, light, steps, blurred, irradiance }) {
    const device = this.#device;
    device.free(this.#radiance, this.#steps, this.#blurred);
    this.#radiance = device.texture('RGBA32F', width, height, light);
    this.#steps = device.texture('R32F', width + 1, height - 1, steps);
    const soft = { filter: 'LINEAR', wrap: 'REPEAT', mipmaps: true };
    this.#blurred = device.texture(device.soft, width, height, blurred, soft);
    this.#irradiance = irradiance;
  }

  /** The device has lost the object, and all else; nothing is to be drawn. */
  lose() {
    this.#scene = null;
  }

  /** The uniforms of both, for a picture from a camera, with the light turned by `rotation` degrees. */
  uniforms(camera, { width, height }, rotation) {
    const turn = (rotation * Math.PI) / 180;
    return {
      ...cameraUniforms(camera, width, height),
      environment_picture: this.#radiance,
      environment_steps: this.#steps,
      environment_blurred: this.#blurred,
      environment_turn: [Math.cos(turn), Math.sin(turn)],
      irradiance: this.#irradiance,
    };
  }

  /** The same for paths; the first call for an object builds the hierarchy over it. */
  pathUniforms(camera, size, rotation) {
    return { ...this.uniforms(camera, size, rotation), ...(this.#traversal ?? this.#layOut()) };
  }
}
