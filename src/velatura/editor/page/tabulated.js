// Solutions between those that Python has worked out along each value of a material (velatura/editor/tabulated.py).

import { decode } from './arrays.js';

const CHANNELS = 3;
const LEAST = 1e-3; // factor of a change
const REACH = 0.02; // of the products of how far each two values move, in lengths of their axes: the greatest sum
const FAINT = 1e-4; // energies that weigh nothing
const HALF_TURN = 180; // degrees, after which brushed materials look alike

/** The place of a value on an axis, from 0 to 1; null where it is beyond. */
function placeOf({ root, low, high, spreads, names: [name] }, value) {
  const turned = name.endsWith('rotation') ? value - HALF_TURN * Math.round(value / HALF_TURN) : value;
  const at = root ? Math.sqrt(turned) : turned, place = ((spreads ? Math.max(at, low) : at) - low) / (high - low); // facets are never smoother
  return place >= -1e-6 && place <= 1 + 1e-6 ? Math.min(Math.max(place, 0), 1) : null;
}

/** A row of a table at a place from 0 to 1, linearly between rows. */
function rowAt({ array, shape: [count, width] }, place) {
  const at = place * (count - 1), k = Math.min(Math.floor(at), count - 2), t = at - k;
  return Array.from({ length: width }, (_, j) => (1 - t) * array[k * width + j] + t * array[(k + 1) * width + j]);
}

/** The coordinate of each channel on an axis, or the one of all, of a material by its flat values; null where names differ. */
function valuesOf({ names, times, colour }, values, own) {
  const [first, ...others] = names.map((name) => values[name]);
  if (first === undefined || others.some((other) => other !== first)) return null;
  const by = times ? values[times] / own[times] : 1;
  return colour ? Array.from({ length: CHANNELS }, (_, k) => by * ([first].flat()[k] ?? first)) : [by * first];
}

/** The change of a table's rows between two places of each channel: a list for each channel, and the mean of these for all. */
function differences(table, before, after) {
  const each = after.map((place, k) => {
    const start = rowAt(table, before[k]);
    return rowAt(table, place).map((x, j) => x - start[j]);
  });
  const mean = each[0].map((_, j) => each.reduce((sum, x) => sum + x[j], 0) / each.length);
  return { each: Array.from({ length: CHANNELS }, (_, k) => each[k] ?? each[0]), mean };
}

/** What moves on each axis: `[axis, changes of shares, changes of numbers]`; null where an axis ends before it, or where several move far. */
function movesOf(axes, own, values) {
  const moves = [], ways = [];
  for (const axis of axes) {
    const [before, after] = [own, values].map((each) => valuesOf(axis, each, own));
    if (!before || !after) return null;
    if (String(before) === String(after)) continue;
    const places = [before, after].map((each) => each.map((x) => placeOf(axis, x)));
    if (places.flat().includes(null)) return null;
    ways.push(Math.max(...places[0].map((place, k) => Math.abs(places[1][k] - place))));
    moves.push([axis, differences(axis.shares, ...places), differences(axis.numbers, ...places)]);
  }
  const sum = ways.reduce((all, way) => all + way, 0), squares = ways.reduce((all, way) => all + way * way, 0);
  return (sum * sum - squares) / 2 <= REACH ? moves : null;
}

/** A table of a file with its arrays decoded, and the flat names of the values that it `follows`. */
export const read = (table) => ({
  ...table,
  axes: table.axes.map((axis) => ({ ...axis, shares: decode(axis.shares), shapes: decode(axis.shapes), numbers: decode(axis.numbers) })),
  follows: new Set(table.axes.flatMap(({ names, times }) => [...names, times])),
});

/**
 * The solution of a material with flat `values`, by the `table` and the solution {texels, remainder, layout} of one with `own`
 * values; null where it is beyond.
 */
export function interpolated(table, solution, own, values) {
  const moves = movesOf(table.axes, own, values);
  if (!moves) return null;
  const { texels, remainder, layout } = Object.fromEntries(Object.entries(solution).map(([name, x]) => [name, decode(x)]));
  const colours = diffuse(table, moves, remainder.array), numbers = layout.array.slice();
  for (const [, , { mean }] of moves) numbers.forEach((_, k) => (numbers[k] += mean[mean.length - numbers.length + k]));
  return {
    texels: { array: columns(table, moves, texels), shape: texels.shape },
    remainder: { ...remainder, array: colours },
    layout: { ...layout, array: numbers },
  };
}

/**
 * The colours of diffuse light after some moves, each of which makes others of them alone: roughness adds the difference; other
 * moves scale each part as a whole, and divide it anew.
 */
function diffuse({ floors }, moves, before) {
  const per = before.length / floors.length, found = before.slice();
  const sizeOf = (colours, floor) => colours.reduce((sum, x) => sum + Math.abs(x), floor);
  floors.forEach((floor, part) => {
    for (let k = 0; k < CHANNELS; k++) {
      const places = Array.from({ length: per / CHANNELS }, (_, j) => part * per + CHANNELS * j + k);
      const own = places.map((place) => before[place]), size = sizeOf(own, floor);
      const alone = ([, , { each }]) => places.map((place) => before[place] + each[k][place]);
      const [spread, others] = [true, false].map((spreads) => moves.filter(([axis]) => axis.spreads === spreads).map(alone));
      let colours = own.map((x, j) => spread.reduce((sum, each) => sum + each[j] - x, x));
      for (const each of others) {
        const now = sizeOf(colours, floor), then = sizeOf(each, floor);
        colours = colours.map((x, j) => (x + now * (each[j] / then - own[j] / size)) * (then / size));
      }
      places.forEach((place, j) => (found[place] = colours[j]));
    }
  });
  return found;
}

/** The texels of a solution after some moves. */
function columns({ rows, chances, sides, nodes: [cosines, azimuths = 1] }, moves, { array }) {
  if (!moves.length) return array;
  const found = array.slice(), lines = sides * azimuths, [, , , few, turns] = moves[0][0].shapes.shape;
  const across = stencil(few, cosines), around = stencil(turns, azimuths);
  const change = new Float64Array(sides * few * turns), base = change.slice(), along = new Float64Array(few);
  const left = new Float64Array(lines * cosines).fill(1); // by chances

  /** The number of the first channel of a row. */
  const placed = ({ place }) => (place >> 2) * 4 * lines * cosines + (place & 3);

  /** Where the values of a row are: `[array, the first, step]`. */
  const rowIn = (row) => (row.place === null ? [left, 0, 1] : [found, placed(row), 4]);

  /** Calls with the number of each node on each side, in order, and that of its channel for a row. */
  function eachNode(row, act) {
    for (let k = 0, at = placed(row); k < lines * cosines; k++, at += 4) act(k, at);
  }

  /** Takes the values of a row at the nodes of shapes, or beside them. */
  function sample(row) {
    const [values, begin, step] = rowIn(row);
    for (let side = 0, j = 0; side < sides; side++)
      for (let i = 0; i < few; i++)
        for (let turn = 0; turn < turns; turn++, j++) {
          const line = side * azimuths + nearest(turn, turns, azimuths);
          const node = line * cosines + nearest(i, few, cosines);
          base[j] = values[begin + step * node] * (row.weight === null ? 1 : array[placed(rows[row.weight]) + 4 * node]);
        }
  }

  for (const row of chances) eachNode(rows[row], (k, at) => (left[k] -= found[at]));
  for (let k = 0; k < left.length; k++) left[k] = Math.max(left[k], 0);
  const numbers = [...rows.keys()].sort((a, b) => (rows[a].weight !== null) - (rows[b].weight !== null)); // weights first
  for (const number of numbers) {
    const row = rows[number];
    if (row.power) sample(row);
    changed(moves, row, number * change.length, rows.length * change.length, base, change);
    if (change.every((x) => x === 0) && row.weight === null) continue;
    const [values, begin, step] = rowIn(row);
    const further = row.weight === null ? 0 : placed(rows[row.weight]) - begin; // its weight
    for (let line = 0, k = begin; line < lines; line++) {
      const [j, t] = around[line % azimuths], first = Math.floor(line / azimuths) * few * turns + j;
      for (let i = 0; i < few; i++) {
        const at = first + i * turns;
        along[i] = t ? (1 - t) * change[at] + t * change[at + 1] : change[at];
      }
      for (let node = 0; node < cosines; node++, k += step) {
        const [i, s] = across[node];
        const by = s ? (1 - s) * along[i] + s * along[i + 1] : along[i];
        if (row.weight === null) values[k] = after(row, values[k], by);
        else values[k] = after(row, values[k] * array[k + further], by) / Math.max(found[k + further], FAINT);
      }
    }
  }
  // Chances, and what they leave, sum up to 1
  const sums = left.slice();
  for (const row of chances) eachNode(rows[row], (k, at) => (sums[k] += found[at]));
  for (const row of chances) eachNode(rows[row], (k, at) => (found[at] /= sums[k]));
  return found;
}

/**
 * The change of a row by some moves, at each node of shapes, where it has `base` values: a difference, or the logarithm of a factor.
 * Factors multiply; but where roughness of several interfaces makes something wider, or brighter, what each adds does.
 */
function changed(moves, { channel, power, floor, unit }, begin, step, base, found) {
  const own = new Float64Array(found.length), more = new Float64Array(found.length);
  found.fill(0);
  for (const [{ shapes, spreads }, { each, mean }] of moves) {
    const shares = channel === null ? mean : each[channel];
    own.fill(0);
    shares.forEach((share, k) => {
      for (let j = 0, at = k * step + begin; j < own.length; j++, at++) own[j] += unit * share * shapes.array[at];
    });
    for (let j = 0; j < own.length; j++) {
      const by = power ? power * Math.log(Math.max(1 + own[j] / (Math.max(base[j], 0) + floor), LEAST)) : own[j];
      if (power && spreads && (power > 1 || by > 0)) more[j] += Math.expm1(by);
      else found[j] += by;
    }
  }
  for (let j = 0; j < own.length; j++) if (more[j]) found[j] += Math.log(Math.max(1 + more[j], LEAST ** power));
}

/** A value of a row after a change. */
function after({ power, floor, most }, value, change) {
  return power ? Math.min(Math.max((value + floor) * Math.exp(change / power) - floor, 0), most) : value + change;
}

const nearest = (k, few, many) => (few > 1 ? Math.round((k * (many - 1)) / (few - 1)) : 0);

/** For each of some places, the node of fewer that lies below, and the share of the next one. */
function stencil(few, many) {
  return Array.from({ length: many }, (_, k) => {
    const at = many > 1 ? (k * (few - 1)) / (many - 1) : 0, node = Math.min(Math.floor(at), Math.max(few - 2, 0));
    return [node, at - node];
  });
}
