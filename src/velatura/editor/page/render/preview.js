// The preview: surfaces drawn once for a view, all around them lit once, and lit again whenever a value
// changes.

import { COARSE, coarsening, spreading, surroundings } from './glsl/preview.glsl.js';
import { raster, rasterVertex } from './glsl/raster.glsl.js';

const SEEN = ['RGBA16F', 'RGBA16F', 'RG32F'];

/** What a camera sees of a scene; kept until either changes. */
export class Preview {
  constructor(device) {
    this.device = device;
  }

  async compile() {
    const { device } = this;
    [this.program, this.surroundings, this.coarsening, this.spreading] = await Promise.all([
      device.program(raster, rasterVertex),
      ...[surroundings, coarsening, spreading].map((text) => device.program(text)),
    ]);
  }

  setScene(scene) {
    const { gl } = this.device;
    this.delete();
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    const tangents = new Float32Array((4 * scene.tangents.length) / 3);
    scene.materials.forEach((material, i) => {
      tangents.set(scene.tangents.subarray(3 * i, 3 * i + 3), 4 * i);
      tangents[4 * i + 3] = material;
    });
    this.buffers = [
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
    this.buffers.push(indices);
    this.count = scene.triangles.length;
    this.outdated = true;
  }

  setSize(width, height) {
    const { device } = this;
    device.free(this.seen, this.coarse, this.coarseLight);
    this.seen = device.target(width, height, SEEN, true);
    const size = [width, height].map((length) => Math.ceil(length / COARSE));
    this.coarse = device.target(...size, SEEN);
    this.coarseLight = device.target(...size, ['RGBA16F']);
    this.outdated = true;
  }

  /** Draws what is seen, after `outdated` was set. */
  update(projection) {
    if (!this.outdated) return;
    this.outdated = false;
    this.draw(projection);
    this.device.draw(this.coarsening, named(this.seen), this.coarse);
  }

  /** Draws all around the object. */
  drawSurroundings(uniforms, target) {
    this.device.draw(this.surroundings, { ...uniforms, ...named(this.seen) }, target);
  }

  /** Draws the object by a program into its surroundings; in fewer pixels where it has to be `quick`. */
  drawObject(program, uniforms, target, quick) {
    const { device, seen, coarse, coarseLight } = this;
    if (!quick) return device.draw(program, { ...uniforms, ...named(seen), seen_every: 1 }, target);
    device.draw(program, { ...uniforms, ...named(coarse), seen_every: COARSE }, coarseLight);
    const own = { coarse_light: coarseLight.textures[0], coarse_normal: coarse.textures[0] };
    return device.draw(this.spreading, { ...own, ...named(seen) }, target);
  }

  /** Draws a pixel by a program that is to draw the object. */
  warm(program, uniforms) {
    const { device, coarse } = this;
    const pixel = device.target(1, 1, ['RGBA16F']);
    device.draw(program, { ...uniforms, ...named(coarse), seen_every: COARSE }, pixel);
    device.free(pixel);
  }

  draw(projection) {
    const { gl } = this.device;
    this.device.use(this.program, { camera_projection: projection });
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.seen.handle);
    gl.viewport(0, 0, this.seen.width, this.seen.height);
    gl.enable(gl.DEPTH_TEST);
    [0, 1, 2].forEach((i) => gl.clearBufferfv(gl.COLOR, i, [0, 0, 0, 0]));
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    gl.bindVertexArray(this.array);
    gl.drawElements(gl.TRIANGLES, this.count, gl.UNSIGNED_INT, 0);
  }

  delete() {
    const { gl } = this.device;
    this.buffers?.forEach((buffer) => gl.deleteBuffer(buffer));
    if (this.array) gl.deleteVertexArray(this.array);
  }
}

function named({ textures: [normal, tangent, uv] }) {
  return { seen_normal: normal, seen_tangent: tangent, seen_uv: uv };
}
