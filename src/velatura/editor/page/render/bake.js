// The lobes of a uniform material over direction, as texels: worked out by a tape, read by the shader.

import { Tape } from './tape.js';

export class Bake {
  /** `baked` as call("shader") has it; `tables` by name, each {array, shape}. */
  constructor(baked, tables) {
    const [width, turns = 1] = baked.nodes;
    Object.assign(this, { baked, tables, sides: baked.sides, nodes: width * turns, width });
    this.height = (baked.outputs.length / 4) * baked.sides * turns;
    const along = (f) => Float64Array.from({ length: this.nodes }, (_, i) => f(i));
    this.place = {
      'place.x': along((i) => (i % width) / (width - 1)),
      'place.y': turns > 1 ? along((i) => Math.floor(i / width) / (turns - 1)) : 0,
    };
    this.texels = new Float32Array(4 * this.width * this.height);
  }

  /** The texels for the values of a material, by their place in its struct: of each, all nodes side by side. */
  draw(values) {
    const { nodes, sides, texels } = this;
    const inputs = Object.fromEntries(Object.entries(values).map(([place, value]) => [`m.${place}`, value]));
    for (let side = 0; side < sides; side++) {
      const given = { ...inputs, ...this.place, 'place.z': side };
      this.tape ??= new Tape(this.baked, this.tables, given);
      this.tape.run(given, (columns, first, end) => {
        columns.forEach((column, k) => {
          const step = column.length > 1 ? 1 : 0;
          let o = 4 * (nodes * ((k >> 2) * sides + side) + first) + (k & 3);
          for (let i = first, p = 0; i < end; i++, p += step, o += 4) texels[o] = column[p];
        });
      });
    }
    return texels;
  }
}
