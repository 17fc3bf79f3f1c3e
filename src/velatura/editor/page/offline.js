// The page without a server: answers that Python has worked out once (velatura/editor/offline.py), and what the page
// itself can say. It knows the same verbs as connection.js; what it lacks needs Python.

import { decode } from './arrays.js';
import { Offline, Refused } from './connection.js';
import { textOf, unpacked } from './packing.js';
import { Recent } from './recent.js';
import { check } from './state/check.js';
import { flat, stateOf, variantOf } from './state/material.js';
import { contentsOf } from './state/picture.js';
import { interpolated, read as readTable } from './tabulated.js';

const KEPT = 64; // answers
const WIDTH = 1024; // texels in a line of tables
const KINDS = { metal: 'conductor', custom: 'conductor' }; // where Python's names differ from those of variants
const OFFERED = new Set(['glsl']); // what is there besides verbs
const PYTHON = 'Needs Python: velatura edit';

/** The texels of a table: the channels of each node filled up to whole texels; a single one is packed (`texels_of` in Python). */
function texelsOf({ array, shape }) {
  const channels = shape.at(-1), size = channels === 1 ? array.length : channels, whole = 4 * Math.ceil(size / 4);
  const found = new Float32Array((array.length / size) * whole);
  for (let node = 0; node * size < array.length; node++) found.set(array.subarray(node * size, (node + 1) * size), node * whole);
  return found;
}

/** A client of the files in a folder: `call(verb, body)`, and `lacks(name)`, why a verb or another thing is not there, or ''. */
export async function connectFiles(folder) {
  const kept = new Recent(KEPT);
  const load = (name, read = (answer) => answer) => kept.once(name, () => fetched(`${folder}${name}.pack`).then(read));
  const session = await load('session');
  const { orders } = session;
  // Presets whose values may move: their names, order of layers, values, and what else they have
  const followed = session.presets
    .filter(({ followed: names }) => names?.length)
    .map(({ name, followed: names, material }) => ({
      name,
      names,
      order: orderOf(material),
      values: flat(stateOf(material), session),
      others: othersOf(material),
    }));

  /** The name of a material's order of layers. Raises Refused where there is no material of that order. */
  function orderOf(material) {
    const { layers, thin } = read(material);
    const kinds = layers.map((layer) => KINDS[variantOf(layer)] ?? variantOf(layer));
    const pane = thin ? ['thin'] : [];
    const refusal = orders[[...kinds, ...pane].join('-')] ?? 'So many layers need Python: velatura edit.';
    if (refusal) throw refused(refusal);
    const brushed = layers.some(({ keys }) => Array.isArray(keys.alpha)) ? ['brushed'] : [];
    return [...kinds, ...brushed, ...pane].join('-');
  }

  /** A document as the state has it. Raises Refused where it is no material. */
  function read(material) {
    try {
      check(material, session);
    } catch ({ message }) {
      throw refused(message);
    }
    return stateOf(material);
  }

  /** The shader of a material by stored solutions, where its model is solved; else in closed form, as it is for `coarse`. */
  async function shader({ material, model, switches = {}, coarse = false }) {
    if (Object.keys(switches).length) throw refused('Switches of a model need Python: velatura edit.');
    const order = orderOf(material), films = filmsOf(material);
    const found = films ? await load(coated(model, films, order)) : await plain(model, order);
    if (found.refused) throw refused(found.refused);
    const solved = found.closed_form && !coarse && (await solvedAs(material, model, order));
    return solved || { ...found, values: contentsOf(found, read(material), session).values };
  }

  /** A preset as it was solved, or what lies between solutions of one; null of other materials. */
  async function solvedAs(material, model, order) {
    const preset = session.presets.find((known) => isSame(known.material, material));
    if (preset) return load(`solved/${model}/${preset.name}`);
    const state = read(material), values = flat(state, session), others = othersOf(material);
    const near = followed
      .filter((known) => known.order === order && known.others === others)
      .map((known) => ({ ...known, moved: movedOf(known.values, values) }))
      .filter(({ moved, names }) => moved.every((name) => names.includes(name)))
      .sort((a, b) => a.moved.length - b.moved.length);
    for (const { name, values: own, moved } of near) {
      const [solved, table] = await Promise.all([load(`solved/${model}/${name}`), load(`tabulated/${model}/${name}`, readTable)]);
      const follows = moved.every((value) => table.follows.has(value));
      const solution = follows && interpolated(table, solved.solution, own, values);
      if (solution) return { ...solved, values: contentsOf(solved, state, session).values, solution, interpolated: true };
    }
    return null;
  }

  /** The shader of an order of layers, whose lines it has in common with others. */
  async function plain(model, order) {
    const [found, lines] = await Promise.all([load(`shader/${model}/${order}`), load(`lines/${model}`)]);
    return { ...found, text: textOf(found.text, lines) };
  }

  /** The name of a material in closed form that has the films of a preset. Raises Refused where none has them. */
  function coated(model, films, order) {
    const preset = session.presets.find((known) => filmsOf(known.material) === films);
    if (!preset) throw refused('Films, and indices beside them, need Python: velatura edit.');
    return `films/${model}/${preset.name}${order.includes('brushed') ? '-brushed' : ''}`;
  }

  /** Tables one after another, in the lines of a texture. */
  async function tables({ key }) {
    const parts = await Promise.all(key.split(',').map((name) => load(`table/${name}`)));
    const texels = parts.map(({ table }) => texelsOf(decode(table)));
    const height = Math.ceil(texels.reduce((sum, { length }) => sum + length, 0) / (4 * WIDTH));
    const array = new Float32Array(4 * WIDTH * height);
    let begin = 0;
    for (const each of texels) {
      array.set(each, begin);
      begin += each.length;
    }
    return { texture: { array, shape: [height, WIDTH, 4] } };
  }

  /** The shader in closed form, with the values of the material in the place of those that it was printed with. */
  async function written({ material, model, to }) {
    if (filmsOf(material)) throw refused('Films need Python: velatura edit.');
    const { lines, texts } = await load(`${to}/${model}`);
    const { text, tables: key, costs } = texts[orderOf(material)];
    const values = flat(read(material), session);
    const put = (line, begin, place) => `${begin}${literal(values[place.replace('.', '_')], line.includes('vec3'))};`;
    const beside = key && { '.tables.bin': (await tables({ key })).texture };
    const written = textOf(text, lines);
    const filled = written.replace(/^( *m\.([\w.]+) = ).*;$/gm, put);
    return { text: filled, ending: `.${to}`, beside: beside ?? {}, costs };
  }

  const file = (verb) => ({ name }) => load(`${verb}/${name}`);
  const answers = {
    session: async () => session,
    shader,
    tables,
    table: file('table'),
    object: file('object'),
    environment: file('environment'),
    async read({ text, file = 'the text' }) {
      const material = parsed(text, file);
      orderOf(material);
      return { material };
    },
    write: async ({ material }) => ({ text: `${JSON.stringify(material, null, 2)}\n`, ending: 'json' }),
    export: written,
  };
  return {
    async call(verb, body = {}) {
      if (!answers[verb]) throw refused(PYTHON);
      return answers[verb](body);
    },
    lacks: (name) => (answers[name] || OFFERED.has(name) ? '' : PYTHON),
  };
}

const refused = (message) => new Refused(message, 422);

/** What is in a file of an answer. */
async function fetched(address) {
  const response = await fetch(address).catch(() => {
    throw new Offline();
  });
  if (!response.ok) throw new Error(`${address}: not found`);
  return unpacked(await response.arrayBuffer());
}

function parsed(text, file) {
  try {
    return JSON.parse(text);
  } catch {
    throw refused(`${file}: is not JSON, and YAML needs Python: velatura edit`);
  }
}

/** Whether two documents are one material, but for its name. */
function isSame(a, b) {
  const what = ({ layers, exterior = 1, thin = false }) => JSON.stringify([layers, exterior, thin]);
  return what(a) === what(b);
}

/** All that the films of a material depend on, as text; '' without any. */
function filmsOf({ layers, exterior = 1, thin = false }) {
  const parts = layers.map((entry) => {
    const [[kind, keys]] = Object.entries(entry), { eta, k, conductor, films } = keys ?? {};
    return [kind, eta, k, conductor, films];
  });
  return parts.some(([, , , , films]) => films?.length) ? JSON.stringify([exterior, thin, parts]) : '';
}

/** What a material has besides numbers, as text. */
const othersOf = ({ layers }) =>
  JSON.stringify(layers.map((entry) => Object.values(entry)).map(([keys]) => [keys?.films ?? [], keys?.phase, keys?.pigments ?? []]));

/** The flat names of values that differ between two materials of one order. */
function movedOf(before, after) {
  const colour = (value) => String(Array.isArray(value) ? value : [value, value, value]);
  return Object.keys({ ...before, ...after }).filter((name) => colour(before[name]) !== colour(after[name]));
}

/** A number, or a colour, as GLSL has it. */
function literal(value, wide) {
  const number = (x) => (/[.e]/.test(x) ? String(x) : `${x}.0`);
  if (!wide) return number(value);
  return `vec3(${[value].flat().map(number).join(', ')})`;
}
