// The canvas: one picture or several, each a preview, a sum of paths or in between; and the truth in the place of one.

import { decoded } from '../state/colours.js';
import { blending, display, metering } from './glsl/display.glsl.js';

const FIRST = 4; // samples from which on they are shown
const PARTS = [16, 9]; // of a picture, in which differences are summed
const AROUND = 2; // pixels to each side whose light is averaged
const TRUSTED = 16; // samples from which on the preview shows through no more

const PLAIN = { split: 1, difference: false, photographed: false, corner: [0, 0] }; // one picture that fills its target

/** Whether a slot has paths enough to be judged by them alone. */
export const isTrusted = ({ samples }) => samples >= TRUSTED;

export class Screen {
  truth = null; // in the place of slot b: {width, height, data, samples, texture}
  photograph = null; // in its place, too: {image, texture}
  #device;
  #blending = null;
  #display = null;
  #displayed = ''; // the view transform that was asked for last
  #sums = null;

  constructor(device) {
    this.#device = device;
  }

  /** Compiles what it takes to show light by a view transform. */
  async compile(displayed) {
    this.#displayed = displayed;
    const [shown, blended] = await Promise.all([display(displayed), blending].map((text) => this.#device.program(text)));
    this.#blending = blended;
    if (this.#displayed === displayed) this.#display = shown;
  }

  get ready() {
    return this.#display !== null;
  }

  /** Takes a picture {width, height, data: RGB, linear, from the upper left, samples}, stretched to a size; or null. */
  setTruth(truth, { width, height }) {
    this.#device.free(this.truth?.texture);
    const texels = truth?.data && stretched(truth, width, height);
    this.truth = truth && { ...truth, texels, texture: texels && this.#device.texture('RGBA32F', width, height, texels) };
  }

  /** Takes a photograph, an ImageBitmap, which lies in the middle of a size as large as it has room; or null. */
  setPhotograph(image, { width, height }) {
    this.#device.free(this.photograph?.texture);
    this.photograph = image && { image, texture: this.#device.image(fitted(image, width, height), 'linear') };
  }

  /** Draws the slots that are seen, by the settings of the view. */
  paint(slots, { mode, split, exposure }) {
    const [a, b] = this.#pictures(slots);
    const photographed = this.photograph !== null;
    const shown = { ...PLAIN, exposure, photographed, split: mode === 'split' ? split : 1, difference: mode === 'difference' };
    this.#device.draw(this.#display, { picture_a: a, picture_b: b, ...shown }, null);
  }

  /** Draws slots side by side: `tiles` of {slot, corner}, in pictures of a size. */
  paintTiles(tiles, { width, height }, { exposure }) {
    this.#device.clear({ handle: null }, 0);
    for (const { slot, corner } of tiles) {
      const texture = this.#textureOf(slot), [x, y] = corner;
      const shown = { ...PLAIN, exposure, corner, picture_a: texture, picture_b: texture };
      this.#device.draw(this.#display, shown, null, { columns: [x, x + width], rows: [y, y + height] });
    }
  }

  /** The mean absolute difference in luminance of the two slots that are seen. */
  async difference(slots, { exposure }) {
    const program = await this.#device.program(metering);
    const [a, b] = this.#pictures(slots);
    this.#sums ??= this.#device.target(...PARTS, ['RGBA32F']);
    this.#device.draw(program, { picture_a: a, picture_b: b, exposure, parts: PARTS }, this.#sums);
    const found = await this.#device.readLater(this.#sums);
    const total = (channel) => found.reduce((sum, x, index) => sum + (index % 4 === channel ? x : 0), 0);
    return total(0) / total(1);
  }

  /**
   * The mean linear light of a few pixels around one of a slot, or on the right of what is in its place: of a photograph as it is,
   * else exposed. Null beside a photograph.
   */
  lightAt(slot, { x, y, isRight, exposure }) {
    const target = slot.samples < FIRST ? slot.preview : slot.sum, { width, height } = target;
    const [left, below] = [Math.max(x - AROUND, 0), Math.max(y - AROUND, 0)];
    const part = { x: left, y: below, width: Math.min(2 * AROUND + 1, width - left), height: Math.min(2 * AROUND + 1, height - below) };
    if (isRight && this.photograph) return meanOf(linear(fitted(this.photograph.image, width, height), part), 1);
    if (isRight && this.truth?.texels) return meanOf(within(this.truth.texels, width, part), 2 ** exposure);
    return meanOf(this.#device.read(target, part), 2 ** exposure);
  }

  #pictures(slots) {
    const [a, b = a] = slots.map((slot) => this.#textureOf(slot));
    return [a, this.photograph?.texture ?? this.truth?.texture ?? b];
  }

  /** Draws one picture as the canvas would show it. */
  expose(texture, exposure, target) {
    this.#device.draw(this.#display, { ...PLAIN, exposure, picture_a: texture, picture_b: texture }, target);
  }

  #textureOf(slot) {
    const [preview, sum] = [slot.preview.textures[0], slot.sum.textures[0]];
    if (slot.samples < FIRST) return preview;
    if (isTrusted(slot)) return sum;
    const trust = slot.samples / (slot.samples + 2);
    this.#device.draw(this.#blending, { picture: preview, sum, trust }, slot.spare);
    return slot.spare.textures[0];
  }
}

/** The mean of colours by their weights in A, times a factor; null where they have none. */
function meanOf(texels, factor) {
  const total = (channel) => texels.reduce((sum, x, index) => sum + (index % 4 === channel ? x : 0), 0);
  return total(3) > 0 ? [0, 1, 2].map((channel) => (factor * total(channel)) / total(3)) : null;
}

/** A part of texels in rows of a width. */
function within(texels, width, part) {
  const row = (_, k) => [...texels.subarray(4 * ((part.y + k) * width + part.x), 4 * ((part.y + k) * width + part.x + part.width))];
  return Array.from({ length: part.height }, row).flat();
}

/** The linear light of the bytes of a part of a canvas, times their opacity, and that. */
function linear(canvas, { x, y, width, height }) {
  const { data } = canvas.getContext('2d').getImageData(x, y, width, height);
  return Array.from(data, (byte, k) => (data[k | 3] / 255) * (k % 4 === 3 ? 1 : decoded(byte / 255)));
}

/** A canvas with an image in its middle, from the lower row on. */
function fitted(image, width, height) {
  const canvas = new OffscreenCanvas(width, height), context = canvas.getContext('2d');
  const scale = Math.min(width / image.width, height / image.height), [w, h] = [scale * image.width, scale * image.height];
  context.translate(0, height);
  context.scale(1, -1);
  context.drawImage(image, (width - w) / 2, (height - h) / 2, w, h);
  return canvas;
}

/** An RGB picture as RGBA of another size, from the lower row on; pixels stay pixels. */
function stretched({ width, height, data }, columns, rows) {
  const found = new Float32Array(4 * columns * rows);
  for (let y = 0; y < rows; y++) {
    const row = Math.floor(((rows - 1 - y) * height) / rows);
    for (let x = 0; x < columns; x++) {
      const from = 3 * (row * width + Math.floor((x * width) / columns));
      found.set([data[from], data[from + 1], data[from + 2], 1], 4 * (y * columns + x));
    }
  }
  return found;
}
