// Tapes: recordings of a model by Python, run one step after another on arrays of numbers.
//
// A value is {channels, count, wide}: an array for each channel, of `count` numbers or of one. Inputs of many numbers
// are gone through in blocks, so that all data stay in the cache; values that do not depend on them are computed once.

const BLOCK = 512; // numbers

/** What is written to o[i] for i below n, of arguments that go on by s, t and u: 1, or 0 where they are one number. */
const LOOPS = {
  add(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = a[p] + b[q];
  },
  subtract(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = a[p] - b[q];
  },
  multiply(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = a[p] * b[q];
  },
  divide(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = a[p] / b[q];
  },
  minimum(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = a[p] < b[q] ? a[p] : b[q];
  },
  maximum(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = a[p] > b[q] ? a[p] : b[q];
  },
  power(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = a[p] ** b[q];
  },
  arctan2(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = Math.atan2(a[p], b[q]);
  },
  less(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = a[p] < b[q] ? 1 : 0;
  },
  greater(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = a[p] > b[q] ? 1 : 0;
  },
  at_most(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = a[p] <= b[q] ? 1 : 0;
  },
  at_least(o, n, a, s, b, t) {
    for (let i = 0, p = 0, q = 0; i < n; i++, p += s, q += t) o[i] = a[p] >= b[q] ? 1 : 0;
  },
  select(o, n, a, s, b, t, c, u) {
    for (let i = 0, p = 0, q = 0, r = 0; i < n; i++, p += s, q += t, r += u) o[i] = a[p] ? b[q] : c[r];
  },
  mean(o, n, a, s, b, t, c, u) {
    for (let i = 0, p = 0, q = 0, r = 0; i < n; i++, p += s, q += t, r += u) o[i] = (a[p] + b[q] + c[r]) / 3;
  },
  colour(o, n, a, s) {
    for (let i = 0, p = 0; i < n; i++, p += s) o[i] = a[p];
  },
  negative(o, n, a, s) {
    for (let i = 0, p = 0; i < n; i++, p += s) o[i] = -a[p];
  },
  absolute(o, n, a, s) {
    for (let i = 0, p = 0; i < n; i++, p += s) o[i] = Math.abs(a[p]);
  },
  sqrt(o, n, a, s) {
    for (let i = 0, p = 0; i < n; i++, p += s) o[i] = a[p] > 0 ? Math.sqrt(a[p]) : 0;
  },
  exp(o, n, a, s) {
    for (let i = 0, p = 0; i < n; i++, p += s) o[i] = Math.exp(a[p]);
  },
  log(o, n, a, s) {
    for (let i = 0, p = 0; i < n; i++, p += s) o[i] = Math.log(a[p]);
  },
  sin(o, n, a, s) {
    for (let i = 0, p = 0; i < n; i++, p += s) o[i] = Math.sin(a[p]);
  },
  cos(o, n, a, s) {
    for (let i = 0, p = 0; i < n; i++, p += s) o[i] = Math.cos(a[p]);
  },
};
LOOPS.both = LOOPS.multiply; // of conditions, which are 1 where they hold, and else 0

const DETAILED = ['component', 'texels', 'value', 'film']; // steps that have a detail before their arguments

export class Tape {
  /**
   * @param {{inputs: string[], constants: Array, steps: Array, outputs: number[]}} tape as call("shader") has it
   * @param {object} tables by name, each {array, shape}
   * @param {object} inputs by name: arrays of as many numbers each, numbers, or colours as arrays of three; as `vt_films`
   *   tables of thin films by name, each {array, shape}; later runs have inputs of the same form
   */
  constructor({ inputs, constants, steps, outputs }, tables, given) {
    this.tables = tables;
    const own = ([name, { array, shape }]) => [name, { array: Float64Array.from(array), shape }];
    this.films = Object.fromEntries(Object.entries(given.vt_films ?? {}).map(own));
    this.spare = []; // arrays of a block that are no longer read
    this.inputs = inputs.map((name) => [name, valueOf(given[name])]);
    this.values = [...this.inputs.map(([, value]) => value), ...constants.map(valueOf)];
    this.first = this.values.length;
    const freed = lastUses(steps, outputs, this.first);
    this.steps = steps.map((step, k) => {
      const planned = this.planned(step);
      this.values.push(planned.value);
      for (const old of freed[k].map((x) => this.values[x])) if (old.count > 1) this.spare.push(...old.channels);
      return planned;
    });
    this.outputs = outputs;
    this.once = this.steps.filter(({ value }) => value.count === 1).flatMap(({ calls }) => calls);
    this.known = new Map(); // calls for every block, by how choices that are the same for all numbers come out
  }

  /**
   * Calls take(columns, first, end) with the outputs for the numbers from `first` to `end` of the inputs; a column has
   * a single number where it is the same for all of them.
   */
  run(inputs, take) {
    for (const [name, { array }] of Object.entries(this.films)) array.set(inputs.vt_films[name].array);
    const lengths = Object.values(inputs).filter((x) => x instanceof Float64Array).map(({ length }) => length);
    const total = Math.max(1, ...lengths); // also where the tape reads none of these
    for (const [name, { channels, count }] of this.inputs) {
      if (count === 1) channels.forEach((channel, c) => (channel[0] = channels.length > 1 ? inputs[name][c] : inputs[name]));
    }
    this.once.forEach(call);
    const calls = this.needed(), columns = this.outputs.map((k) => this.values[k].channels[0]);
    for (let first = 0; first < total; first += BLOCK) {
      const end = Math.min(first + BLOCK, total);
      for (const [name, { channels, count }] of this.inputs)
        if (count > 1) channels[0].set(inputs[name].subarray(first, end));
      calls.forEach(call);
      take(columns, first, end);
    }
  }

  /** The calls for every block, without those for branches that no number chooses. */
  needed() {
    const { steps, values, first } = this;
    const chosen = steps.map(({ op, args, value }) => {
      if (op !== 'select' || value.count === 1 || values[args[0]].count > 1) return null;
      const truths = values[args[0]].channels.map(([truth]) => truth);
      return truths.every((truth) => truth === truths[0]) ? args[truths[0] ? 1 : 2] : null;
    });
    const key = chosen.filter((k) => k !== null).join();
    if (!this.known.has(key)) {
      const read = new Set(this.outputs);
      for (let k = steps.length - 1; k >= 0; k--)
        if (read.has(first + k)) for (const x of chosen[k] === null ? steps[k].args : [chosen[k]]) read.add(x);
      const kept = steps.filter(({ value }, k) => value.count > 1 && read.has(first + k));
      this.known.set(
        key,
        kept.flatMap(({ calls }) => calls),
      );
    }
    return this.known.get(key);
  }

  /** A step with its value and the calls that work it out. */
  planned([op, ...args]) {
    const detail = DETAILED.includes(op) ? args.shift() : null;
    const given = args.map((k) => this.values[k]);
    const made = (value, calls) => ({ op, args, value, calls });
    if (op === 'component') return made({ ...given[0], channels: [given[0].channels[detail]], wide: false }, []);
    const count = Math.max(...given.map((x) => x.count));
    if (op === 'texels' || op === 'value') return made(...this.lookedUp(this.tables[detail], given, count));
    if (op === 'film') return made(...this.film(this.films[detail], given, count));
    if (op === 'mean') {
      const value = this.value(count, 1);
      return made(value, [loop(op, value, 0, [0, 1, 2].map((c) => [given[0], c]))]);
    }
    const wide = op === 'colour' || given.some((x) => x.wide);
    const value = this.value(count, wide ? 3 : 1, wide);
    const read = (c) => (op === 'colour' ? [[given[c], 0]] : given.map((x) => [x, x.wide ? c : 0]));
    return made(
      value,
      value.channels.map((_, c) => loop(op, value, c, read(c))),
    );
  }

  /** Multilinear interpolation: a value, and the calls for it. */
  lookedUp({ array, shape }, places, count) {
    const wide = places.some((x) => x.wide), value = this.value(count, wide ? 3 : shape.at(-1), wide);
    const colours = wide ? value.channels.map((channel) => [channel]) : [value.channels];
    const calls = colours.map((channels, c) => {
      const axes = places.map((x) => x.channels[x.wide ? c : 0]);
      return { f: shape.length > 3 ? space : plane, o: channels, n: count, a: array, s: shape, b: axes };
    });
    return [value, calls];
  }

  /** A table of films at a cosine, or at coordinates of direction and roughness: a colour, and the call for it. */
  film({ array, shape }, places, count) {
    const value = this.value(count, 3, true), axes = places.map((x) => x.channels[0]);
    return [value, [{ f: shape.length > 2 ? plane : line, o: value.channels, n: count, a: array, s: shape, b: axes }]];
  }

  value(count, channels, wide = false) {
    const taken = () => (count > 1 && this.spare.pop()) || new Float64Array(count);
    return { channels: Array.from({ length: channels }, taken), count, wide };
  }
}

/** A number, a colour as an array of three, or an array of floats of which a block is taken at a time. */
function valueOf(x) {
  if (x instanceof Float64Array) return { channels: [new Float64Array(BLOCK)], count: BLOCK, wide: false };
  return { channels: [x].flat().map((channel) => Float64Array.of(channel)), count: 1, wide: Array.isArray(x) };
}

const call = ({ f, o, n, a, s, b, t, c, u }) => f(o, n, a, s, b, t, c, u);

/** The call of a loop that fills a channel, from arguments with the channel of each. */
function loop(op, { channels, count }, channel, args) {
  const [a, b, c] = args.map(([x, k]) => x.channels[k]);
  const [s, t, u] = args.map(([x]) => (x.count > 1 ? 1 : 0));
  return { f: LOOPS[op], o: channels[channel], n: count, a, s, b, t, c, u };
}

/** By step: the values, no inputs among them, that are read there for the last time. */
function lastUses(steps, outputs, first) {
  const freed = steps.map(() => []);
  const last = new Map(outputs.map((k) => [k, Infinity]));
  for (let k = steps.length - 1; k >= 0; k--) {
    const [op, ...args] = steps[k];
    // A component shares the array of its colour
    const until = op === 'component' ? (last.get(first + k) ?? k) : k;
    for (const x of args.slice(DETAILED.includes(op) ? 1 : 0)) last.set(x, Math.max(last.get(x) ?? 0, until));
  }
  for (const [x, k] of last)
    if (x >= first && steps[x - first][0] !== 'component' && k < Infinity) freed[k].push(x);
  return freed;
}

/** A coordinate in units of nodes. */
const position = (x, nodes) => (x > 0 ? (x < 1 ? x : 1) : 0) * (nodes - 1);

/** The node before a position, of which there is one after. */
const before = (position, nodes) => (position < nodes - 1 ? position | 0 : nodes - 2);

/** All channels of the nodes of a line, between the two around each place. */
function line(channels, count, table, [nodes, width], [x]) {
  const s = x.length > 1 ? 1 : 0;
  for (let i = 0; i < count; i++) {
    const u = position(x[s * i], nodes), node = before(u, nodes), a = node * width;
    for (let c = 0; c < channels.length; c++)
      channels[c][i] = table[a + c] + (u - node) * (table[a + width + c] - table[a + c]);
  }
}

/** All channels of the nodes of a plane, between the four around each place. */
function plane(channels, count, table, [rows, columns, width], [y, x]) {
  const s = y.length > 1 ? 1 : 0, t = x.length > 1 ? 1 : 0;
  for (let i = 0; i < count; i++) {
    const v = position(y[s * i], rows), u = position(x[t * i], columns);
    const row = before(v, rows), column = before(u, columns);
    const dv = v - row, du = u - column;
    const a = (row * columns + column) * width, b = a + columns * width;
    for (let c = 0; c < channels.length; c++) {
      const above = table[a + c] + du * (table[a + width + c] - table[a + c]);
      const below = table[b + c] + du * (table[b + width + c] - table[b + c]);
      channels[c][i] = above + dv * (below - above);
    }
  }
}

/** Likewise in space, between two planes. */
function space(channels, count, table, [sheets, rows, columns, width], [z, y, x]) {
  const r = z.length > 1 ? 1 : 0, s = y.length > 1 ? 1 : 0, t = x.length > 1 ? 1 : 0;
  const step = columns * width, sheet = rows * step;
  for (let i = 0; i < count; i++) {
    const w = position(z[r * i], sheets), v = position(y[s * i], rows), u = position(x[t * i], columns);
    const high = before(w, sheets), row = before(v, rows), column = before(u, columns);
    const dw = w - high, dv = v - row, du = u - column;
    const a = ((high * rows + row) * columns + column) * width, b = a + sheet;
    const a00 = (1 - dw) * (1 - dv) * (1 - du), a01 = (1 - dw) * (1 - dv) * du;
    const a10 = (1 - dw) * dv * (1 - du), a11 = (1 - dw) * dv * du;
    const b00 = dw * (1 - dv) * (1 - du), b01 = dw * (1 - dv) * du, b10 = dw * dv * (1 - du), b11 = dw * dv * du;
    for (let c = 0; c < channels.length; c++) {
      const p = a + c, q = b + c;
      channels[c][i] =
        a00 * table[p] + a01 * table[p + width] + a10 * table[p + step] + a11 * table[p + step + width] +
        (b00 * table[q] + b01 * table[q + width] + b10 * table[q + step] + b11 * table[q + step + width]);
    }
  }
}
