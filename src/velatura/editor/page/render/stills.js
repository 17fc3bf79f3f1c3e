// Pictures that are read back from the device: the mean light of paths, and thumbnails of other materials.

import { Slot } from './slot.js';

/** Mean light of a sum of paths: {width, height, data: RGBA, linear, from the upper left}. */
export function radianceOf(device, sum) {
  const { width, height } = sum;
  const data = upright(device.read(sum), width, height);
  for (let i = 0; i < data.length; i += 4) {
    const weight = data[i + 3] || 1;
    data.set([data[i] / weight, data[i + 1] / weight, data[i + 2] / weight, 1], i);
  }
  return { width, height, data };
}

/** Small square pictures of other materials. */
export class Thumbnails {
  #device;
  #loader;
  #screen;
  #slot = null;

  constructor(device, loader, screen) {
    this.#device = device;
    this.#loader = loader;
    this.#screen = screen;
  }

  /** An ImageData of a material; `uniforms` are the stage's for that size. */
  async draw(shader, contents, { size, samples, exposure, uniforms }) {
    const device = this.#device;
    const slot = (this.#slot ??= new Slot(device, this.#loader));
    if (slot.pass?.width !== size) slot.setSize(size, size);
    await slot.setMaterial(shader, contents);
    await slot.warmPaths(uniforms);
    slot.samples = 0;
    while (slot.samples < samples) {
      slot.trace(uniforms);
      slot.add();
      await device.done();
    }
    const shown = device.target(size, size, ['RGBA32F']);
    this.#screen.expose(slot.sum.textures[0], exposure, shown);
    const pixels = upright(device.read(shown), size, size);
    device.free(shown);
    return new ImageData(
      Uint8ClampedArray.from(pixels, (value) => 255 * value),
      size,
      size,
    );
  }
}

/** Pixels from the upper row on. */
function upright(pixels, width, height) {
  const found = new Float32Array(pixels.length);
  for (let y = 0; y < height; y++) {
    found.set(pixels.subarray(4 * y * width, 4 * (y + 1) * width), 4 * (height - 1 - y) * width);
  }
  return found;
}
