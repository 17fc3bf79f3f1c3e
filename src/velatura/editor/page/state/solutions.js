// Solutions of a material while a value moves: those that Python has worked out, and between and beyond them.

import { decode } from '../arrays.js';

const CLOSE = 0.02; // mean relative error of a solution that is not seen while it moves
const FAINT = 0.1; // numbers whose error counts by half as much
const FURTHER = 1.5; // times as far as one that was close may the next one lie
const BEYOND = 2; // distances of two solutions, by which others may lie beyond them
const LINE = 1e-6; // distance from a line over that along it, of values that lie on it
const KEPT = 32; // solutions

const minus = (a, b) => a.map((x, k) => x - b[k]);
const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);

/** Numbers from a (0) to b (1), or beyond, where none changes its sign but between two of different ones. */
const between = (a, b, t) =>
  a.map((x, k) => {
    const found = x + t * (b[k] - x);
    return found * x < 0 && x * b[k] >= 0 ? 0 : found;
  });

/** Mean difference of a solution from the true one, relative to this; of several parts the largest. */
function errorOf(found, truth) {
  const ofTexels = (name) => {
    const { array } = truth[name], other = found[name].array;
    return array.reduce((sum, x, k) => sum + Math.abs(other[k] - x) / (Math.abs(x) + FAINT), 0) / array.length;
  };
  return Math.max(...Object.keys(truth).filter((name) => name.endsWith('texels')).map(ofTexels));
}

/** The layouts of all parts, as text. */
const layoutsOf = ({ solution }) =>
  String(Object.entries(solution).flatMap(([name, { array }]) => (name.endsWith('layout') ? [...array] : [])));

/** Contents as call("values") has them, from those of a (0) to those of b (1); null where they are not alike. */
function mixed(a, b, t) {
  if (a.films || b.films || layoutsOf(a) !== layoutsOf(b)) return null;
  const entry = ([name, { array, shape }]) => [name, { array: between(array, b.solution[name].array, t), shape }];
  const value = ([name, x]) => [name, Array.isArray(x) ? between(x, b.values[name], t) : x + t * (b.values[name] - x)];
  return {
    ...a,
    values: Object.fromEntries(Object.entries(a.values).map(value)),
    solution: Object.fromEntries(Object.entries(a.solution).map(entry)),
  };
}

/** Solutions of one drag, in which values move along a line. */
export class Solutions {
  #known = []; // {at: numbers, contents}
  #reach = 0; // how far from a known one others are close

  clear() {
    this.#known = [];
    this.#reach = 0;
  }

  /** Takes contents as call("values") has them, of a material with these numbers, and returns them decoded. */
  add(answer, at) {
    const decoded = Object.entries(answer.solution ?? {}).map(([name, x]) => [name, decode(x)]);
    const contents = { ...answer, solution: answer.solution && Object.fromEntries(decoded) };
    if (!contents.solution) return contents;
    const found = this.foresee(at);
    if (found?.distance) {
      const { distance } = found, error = errorOf(found.contents.solution, contents.solution);
      this.#reach = error < CLOSE ? Math.max(this.#reach, FURTHER * distance) : distance / 2;
    }
    this.#known.push({ at, contents });
    if (this.#known.length > KEPT) this.#known.shift();
    return contents;
  }

  /**
   * Contents for a material with these numbers: `{contents, distance, close}`, from the nearest ones on their line; null
   * where there are none. They are `close` where others as far from known ones were.
   */
  foresee(at) {
    const known = this.#known.filter((each) => each.at.length === at.length);
    if (!known.length) return null;
    const ways = known.map((each) => minus(at, each.at)), lengths = ways.map((way) => Math.sqrt(dot(way, way)));
    const k = lengths.indexOf(Math.min(...lengths)), nearest = known[k], distance = lengths[k];
    if (distance === 0) return { contents: nearest.contents, distance, close: true };
    // The other one, by its place on the line from the nearest one (0) over these values (1)
    const places = known.map((each) => {
      const way = minus(each.at, nearest.at), place = dot(way, ways[k]) / distance ** 2;
      const off = minus(way, ways[k].map((x) => place * x));
      return dot(off, off) <= LINE ** 2 * dot(way, way) ? place : 0;
    });
    const ahead = Math.min(...places.filter((place) => place >= 1)), behind = Math.max(...places.filter((place) => place < 0));
    const place = Number.isFinite(ahead) ? ahead : behind;
    if (!Number.isFinite(place) || (place < 0 && -place * BEYOND < 1)) return null;
    const contents = mixed(nearest.contents, known[places.indexOf(place)].contents, 1 / place);
    return contents && { contents, distance, close: distance <= this.#reach };
  }
}
