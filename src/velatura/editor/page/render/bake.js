// The lobes of a uniform material over direction, as texels: worked out by a tape, read by the shader.

import { Tape } from './tape.js';

export class Bake {
  width; // of the texture: cosines
  height;
  #baked;
  #tables;
  #turns; // azimuths
  #fine; // grids
  #coarse;
  #texels;
  #tape = null;

  /** `baked` as call("shader") has it; `tables` by name, each {array, shape}. */
  constructor(baked, tables) {
    const [width, turns = 1] = baked.nodes;
    this.#baked = baked;
    this.#tables = tables;
    this.#turns = turns;
    this.width = width;
    this.height = (baked.outputs.length / 4) * baked.sides * turns;
    this.#fine = grid(width, turns, 1);
    this.#coarse = turns > 1 ? grid(width, turns, 2) : this.#fine;
    this.#texels = new Float32Array(4 * this.width * this.height);
  }

  /**
   * The texels for the values of a material, by their place in its struct, and its `films`, if any: of each, all nodes side by side. A `coarse`
   * answer takes half of the cosines and of the azimuths, and what is between them from these.
   */
  draw(values, coarse = false, films = null) {
    const texels = this.#texels, nodes = this.width * this.#turns, { sides } = this.#baked;
    const { at, place } = coarse ? this.#coarse : this.#fine;
    const inputs = Object.fromEntries(Object.entries(values).map(([name, value]) => [`m.${name}`, value]));
    for (let side = 0; side < sides; side++) {
      const given = { ...inputs, ...place, 'place.z': side, ...(films && { vt_films: films }) };
      this.#tape ??= new Tape(this.#baked, this.#tables, given);
      this.#tape.run(given, (columns, first, end) => {
        columns.forEach((column, k) => {
          const step = column.length > 1 ? 1 : 0, begin = 4 * nodes * ((k >> 2) * sides + side) + (k & 3);
          for (let i = first, p = 0; i < end; i++, p += step) texels[begin + 4 * at[i]] = column[p];
        });
      });
    }
    if (at.length < nodes) this.#fill();
    return texels;
  }

  /** Interpolates every second node: first along lines, then between lines. */
  #fill() {
    const texels = this.#texels, turns = this.#turns, line = 4 * this.width;
    const between = (first, end, by) => {
      for (let i = first; i < end; i++) texels[i] = 0.5 * (texels[i - by] + texels[i + by]);
    };
    for (let begin = 0; begin < texels.length; begin += line * turns) {
      for (let y = 0; y < turns; y += 2)
        for (let x = 4; x < line; x += 8) between(begin + y * line + x, begin + y * line + x + 4, 4);
      for (let y = 1; y < turns; y += 2) between(begin + y * line, begin + (y + 1) * line, line);
    }
  }
}

/** Every node, or every second, over cosine and azimuth: their numbers, and what a tape is given of them. */
function grid(width, turns, every) {
  const [columns, rows] = [width, turns].map((count) => Math.ceil(count / every));
  const along = (f) => Float64Array.from({ length: columns * rows }, (_, i) => f(i % columns, Math.floor(i / columns)));
  const place = {
    'place.x': along((x) => (every * x) / (width - 1)),
    'place.y': turns > 1 ? along((x, y) => (every * y) / (turns - 1)) : 0,
  };
  return { at: Int32Array.from(along((x, y) => every * (y * width + x))), place };
}
