// A material: layers of the state from and to the document of a file, their flat values, and their shape.
//
// The layers of the state are those of a stack. In a mixture this is the chosen one: `parts` is the tree of all, whose
// nodes are stacks {id, weight, covers, name, source, thin, layers} or mixtures {id, weight, covers, name, source, parts}, and
// `part` the id of the chosen stack, whose node has the layers of the moment when it was chosen. The last weight among siblings is
// null: what the others leave.

import { coefficientsOf, isKnown } from './pigments.js';

/** Layers with identities, from the document of a stack; the first is numbered `first`. */
export function layersOf(material, first = 1) {
  return material.layers.map((entry, index) => {
    const [[kind, keys]] = Object.entries(entry);
    return { id: first + index, kind, enabled: true, keys: keys ?? {} };
  });
}

/** What the state has of the document of a file: `{name, source, exterior, thin, layers, parts, part}`. */
export function stateOf(material) {
  const { name = '', source = '', mix } = material, exterior = exteriorOf(material);
  if (!mix) return { name, source, exterior, thin: material.thin ?? false, layers: layersOf(material), parts: null, part: null };
  const parts = nodesOf(mix, 0), [{ id, thin, layers }] = stacksOf(parts);
  return { name, source, exterior, thin, layers, parts, part: id };
}

/** The nodes of the parts that a mixture's document lists; ids of parts and layers come after `last`. */
export function nodesOf(mix, last) {
  let count = last;
  const nodeOf = ({ weight = null, covers = '', material }) => {
    const node = { id: ++count, weight, covers, name: material.name ?? '', source: material.source ?? '' };
    if (material.mix) return { ...node, parts: material.mix.map(nodeOf) };
    const layers = layersOf(material, count + 1);
    count += layers.length;
    return { ...node, thin: material.thin ?? false, layers };
  };
  return mix.map(nodeOf);
}

/** The index above a material, which is that of all parts of a mixture. */
export const exteriorOf = ({ mix, exterior = 1 }) => (mix ? exteriorOf(mix[0].material) : exterior);

/** The nodes of a tree that are stacks. */
export const stacksOf = (parts) => parts.flatMap((node) => (node.parts ? stacksOf(node.parts) : [node]));

/** The node of the chosen part; null of a stack. */
export const chosenPart = ({ parts, part }) => (parts ? stacksOf(parts).find(({ id }) => id === part) : null);

/** The tree of a mixture with the layers of the state in the place of those of the chosen part; null of a stack. */
export function treeOf({ parts, part, thin, layers }) {
  const filled = (node) => {
    if (node.parts) return { ...node, parts: node.parts.map(filled) };
    return node.id === part ? { ...node, thin, layers } : node;
  };
  return parts ? parts.map(filled) : null;
}

/** What each part of a mixture covers of an object, by name, '' for nothing; null where none covers any. */
export const coversOf = ({ parts }) => (parts?.some(({ covers }) => covers) ? parts.map(({ covers }) => covers) : null);

/** The stacks of a material, one or those of a mixture, with how their flat names begin: `{id, prefix, thin, layers}`. */
export function leavesOf(state) {
  const within = (parts, begin) =>
    parts.flatMap((node, k) => {
      const prefix = `${begin}part${k}_`;
      return node.parts ? within(node.parts, prefix) : [{ ...node, prefix }];
    });
  const { thin, layers } = state;
  return state.parts ? within(treeOf(state), '') : [{ id: null, prefix: '', thin, layers }];
}

/** The number of the chosen stack among all. */
export const chosenOf = (state) => leavesOf(state).findIndex(({ id }) => id === (state.part ?? null));

/** The layers that count. */
export const enabled = (state) => state.layers.filter((layer) => layer.enabled);

/** The document that a file would hold; layers that are off are not in it. */
export function documentOf(state) {
  const { name, source, exterior } = state;
  const named = (node) => ({ ...(node.name && { name: node.name }), ...(node.source && { source: node.source }) });
  const written = (node) =>
    node.parts ? { ...named(node), mix: node.parts.map(part) } : { ...named(node), ...stackOf({ ...node, exterior }) };
  const part = (node) => ({
    ...(node.weight !== null && { weight: node.weight }),
    material: written(node),
    ...(node.covers && { covers: node.covers }),
  });
  return written({ name, source, ...(state.parts ? { parts: treeOf(state) } : state) });
}

/** The document of the chosen stack, without a name. */
export function stackOf({ exterior, thin, layers }) {
  return {
    ...(exterior !== 1 && { exterior }),
    ...(thin && { thin }),
    layers: enabled({ layers }).map(({ kind, keys }) => ({ [kind]: keys })),
  };
}

/** What a layer is: an interface `dielectric`, `metal` (by name), `custom` (eta and k) or `mirror`, else its kind. */
export function variantOf({ kind, keys }) {
  if (kind !== 'interface') return kind;
  const metal = metalOf(keys);
  if (metal !== undefined) return metal === 'mirror' ? 'mirror' : 'metal';
  return keys.k === undefined ? 'dielectric' : 'custom';
}

/** Whether a layer lies below all others, at all values. */
export const isBase = ({ kind }) => kind === 'diffuse';

/** The name of a metal, which may be that of a page of refractiveindex.info for eta and k alike; else undefined. */
export function metalOf({ conductor, eta, k }) {
  const page = pageOf(eta);
  return conductor ?? (page === pageOf(k) ? page : undefined);
}

/** The page of refractiveindex.info that an index is read from. */
export const pageOf = (value) => value?.refractiveindex;

export const isOpaque = (layer) =>
  isBase(layer) || (layer.kind === 'interface' && variantOf(layer) !== 'dielectric');

/** Why a layer that is off cannot be turned on, '' where it can. */
export function objectionToEnabling(layers, index) {
  const on = (some) => layers.some((layer, at) => layer.enabled && some(layer, at));
  if (on((layer, at) => at < index && isOpaque(layer))) return 'Nothing shows below an opaque layer';
  const bare = layers[index].kind === 'medium' && !on(({ kind }, at) => at > index && kind !== 'medium');
  return bare ? 'An interface or a base must lie below a medium' : '';
}

/** How a message or a button calls a layer; `declared` are the layers of the session. */
export function layerName(layer, declared) {
  const { kind, keys } = layer;
  if (kind !== 'interface') return declared[kind].title;
  const metal = metalOf(keys);
  if (metal !== undefined) return metal;
  return typeof keys.eta === 'string' ? keys.eta : variantOf(layer) === 'custom' ? 'metal' : 'dielectric';
}

/** A number or three, where a name or a page may stand: indices of `names` ({dielectrics, conductors, pages}). */
export function indices(value, part, names) {
  if (Object.hasOwn(names.pages, pageOf(value) ?? '')) return names.pages[pageOf(value)][part];
  if (typeof value !== 'string') return value;
  return names.conductors[value]?.[part] ?? (part === 'eta' ? names.dielectrics[value] : 0);
}

/** Values by flat name, as Stack.flat() has them; what varies over the surface is left out. */
export function flat(state, { names, schema }) {
  const values = Object.fromEntries(weightsOf(treeOf(state) ?? []).filter(([, weight]) => typeof weight === 'number'));
  for (const { prefix, layers } of leavesOf(state)) {
    values[`${prefix}exterior`] = state.exterior;
    enabled({ layers }).forEach(({ kind, keys }, index) => {
      for (const [key, value] of ofLayer(keys, schema[kind], names)) values[`${prefix}layer${index}_${key}`] = value;
    });
  }
  return values;
}

/** The weights of a tree by flat name, but for the last among siblings: `[name, weight]`. */
export function weightsOf(parts, begin = '') {
  return parts.flatMap(({ weight, parts: within }, k) => {
    const prefix = `${begin}part${k}_`;
    return [...(weight === null ? [] : [[`${prefix}weight`, weight]]), ...weightsOf(within ?? [], prefix)];
  });
}

/** All numbers of a material, those of films and pigments as well, in one order for all of a pattern. */
export function numbersOf(state, session) {
  const within = (value) => (typeof value === 'object' ? Object.values(value ?? {}).flatMap(within) : [value].filter(Number.isFinite));
  const others = leavesOf(state).flatMap((leaf) => enabled(leaf).flatMap(({ keys }) => within([keys.films, keys.pigments])));
  return [...Object.values(flat(state, session)).flat(), ...others];
}

/** The numbers of a layer, as [key, value], by the kinds of its parameters in the schema. */
function ofLayer(keys, parameters, names) {
  const found = Object.entries(parameters).flatMap(([key, { kind, default: standard }]) => {
    const value = keys[key] ?? standard;
    if (kind === 'films' || kind === 'pigments') return [];
    if (key === 'g' && keys.phase !== undefined) return []; // that asymmetry Python knows
    if (key.startsWith('sigma_') && keys.pigments !== undefined) return ofPigments(keys, key);
    if (kind === 'pair') return axes(value).map((one, axis) => [`${key}_${'uv'[axis]}`, one]);
    if (kind !== 'index') return [[key, value]];
    return keys.conductor === 'mirror' ? [] : [[key, indices(keys.conductor ?? value, key, names)]];
  });
  return found.filter(([, value]) => typeof value === 'number' || Array.isArray(value));
}

/** A coefficient that pigments make, as [key, value], unless that takes Python. */
function ofPigments({ pigments, phase, g }, key) {
  const found = phase === undefined || key === 'sigma_a' ? coefficientsOf(pigments, g)[key] : undefined;
  return found === undefined ? [] : [[key, found]];
}

/** The two of a pair; a locked one has the same twice. */
export const axes = (pair) => (Array.isArray(pair) ? pair : [pair, pair]);

/** Whether an interface has any films, and one that absorbs. */
function films({ films = [] }) {
  const thick = films.filter(({ thickness_nm: thickness }) => thickness !== 0);
  return [thick.length > 0, thick.some(({ k = 0 }) => [k].flat().some((channel) => channel !== 0))];
}

/** The stacks of a material without their shares, as text. */
export const stacksAsText = (state) =>
  JSON.stringify([state.exterior, ...leavesOf(state).map((leaf) => [leaf.prefix, leaf.thin, enabled(leaf)])]);

/** What decides about the code of a shader, as text; two states of one pattern differ in numbers alone. */
export function pattern(state) {
  const shape = (value) => {
    if (Array.isArray(value)) return value.length === 2 ? value.map(shape) : 0;
    return value !== null && typeof value === 'object' ? value : 0;
  };
  const shapeOf = ({ kind, keys }) => [
    kind === 'interface' ? (isOpaque({ kind, keys }) ? keys.conductor === 'mirror' : 'dielectric') : kind,
    Object.entries(keys)
      .filter(([key, value]) => key !== 'films' && key !== 'pigments' && typeof shape(value) === 'object')
      .map(([key, value]) => [key, shape(value)]),
    films(keys), // of which code knows no more
    keys.phase ?? 0, // whose asymmetry Python knows
    (keys.pigments ?? []).filter((one) => !isKnown(one)),
    keys.pigments !== undefined,
  ];
  const stacks = leavesOf(state).map(({ prefix, thin, layers }) => [prefix, thin, enabled({ layers }).map(shapeOf)]);
  return JSON.stringify([stacks, weightsOf(treeOf(state) ?? []).map(([name, weight]) => [name, shape(weight)])]);
}
