// The parts of a mixture: commands that choose, weigh, add, remove and reorder them, as pure functions.
//
// A command keeps the sum of the shares; where a mask is among the weights, what the last part covers is no number.

import { coversOf, exteriorOf, leavesOf, nodesOf, stacksOf, treeOf } from './material.js';
import { titled } from './store.js';

export const MOST = 16; // stacks of a material, as in Python

/** How a list or a message calls a part. */
export const partName = ({ name, parts }, index) => name || `${parts ? 'mixture' : 'part'} ${index}`;

/** The siblings of a node in a tree, itself included. */
export function siblingsOf(parts, id) {
  if (parts.some((node) => node.id === id)) return parts;
  for (const { parts: within } of parts) {
    const found = within && siblingsOf(within, id);
    if (found) return found;
  }
  return null;
}

/** The shares of siblings: weights, and what the last has, which is null where it is neither a number nor a mask. */
export function sharesOf(siblings) {
  const weights = siblings.slice(0, -1).map(({ weight }) => weight);
  return [...weights, restOf(weights)];
}

function restOf(weights) {
  if (weights.every((weight) => typeof weight === 'number')) return rounded(1 - total(weights));
  if (weights.length > 1) return null;
  const [mask] = weights;
  return { ...mask, scale: -(mask.scale ?? 1), offset: plain(1 - (mask.offset ?? 0)) };
}

const total = (weights) => weights.reduce((sum, weight) => sum + (typeof weight === 'number' ? weight : 0), 0);
const plain = (number) => Number(number.toPrecision(6));
const rounded = (share) => Math.max(0, plain(share));

/** The largest weight that a part can have beside the numbers of the others. */
export function mostOf(siblings, id) {
  const others = siblings.slice(0, -1).filter((node) => node.id !== id);
  return rounded(1 - total(others.map(({ weight }) => weight)));
}

/** Why a part cannot go to a place among its siblings; '' where it can. */
export function objectionTo(siblings, id, to) {
  const last = siblings.length - 1, from = siblings.findIndex((node) => node.id === id);
  if (from === to || (from !== last && to !== last) || sharesOf(siblings)[last] !== null) return '';
  return 'The last part has what masks leave, which is no weight of its own: give the others numbers, or keep it last.';
}

// The tree ---------------------------------------------------------------------------------------------

/** A tree with other siblings in the place of those of a node. */
function replaced(parts, id, change) {
  if (parts.some((node) => node.id === id)) return change(parts);
  return parts.map((node) => (node.parts ? { ...node, parts: replaced(node.parts, id, change) } : node));
}

/** Siblings with weights, the last of which goes. */
const weighed = (siblings, weights) =>
  siblings.map((node, k) => ({ ...node, weight: k < siblings.length - 1 ? weights[k] : null }));

/** Mixtures of one part give way to it. */
const simplified = (parts) =>
  parts.map((node) => {
    if (!node.parts) return node;
    const within = simplified(node.parts);
    return within.length > 1 ? { ...node, parts: within } : { ...within[0], weight: node.weight, covers: node.covers };
  });

/** The state with another tree, of which a stack is chosen. A tree of one part is that part. */
function withTree(state, tree, chosen) {
  const parts = simplified(tree), view = { ...state.view, lobe: null };
  if (parts.length > 1) {
    const { id, thin, layers } = stacksOf(parts).find((stack) => stack.id === chosen) ?? stacksOf(parts)[0];
    return { ...state, parts, part: id, thin, layers, view };
  }
  const [only] = parts, name = only.name || state.name, source = only.source || state.source;
  if (only.parts) return withTree({ ...state, name, source }, only.parts, chosen);
  return { ...state, name, source, parts: null, part: null, thin: only.thin, layers: only.layers, view };
}

const change = (state, id, siblings, chosen = state.part) =>
  withTree(state, replaced(treeOf(state), id, siblings), chosen);

/** The largest id of a part or a layer. */
function lastId(state) {
  const ids = (parts) => parts.flatMap(({ id, parts: within }) => [id, ...ids(within ?? [])]);
  return Math.max(0, ...ids(state.parts ?? []), ...leavesOf(state).flatMap(({ layers }) => layers.map(({ id }) => id)));
}

// Commands ---------------------------------------------------------------------------------------------

/** Shows the layers of a part. */
export const choosePart = titled('choose a part', (state, id) =>
  id === state.part ? state : withTree(state, treeOf(state), id),
);

export const renamePart = titled('rename a part', (state, id, name) =>
  change(state, id, (siblings) => siblings.map((node) => (node.id === id ? { ...node, name } : node))),
);

/** Gives a part a share, a number or a mask; numbers end where the others leave nothing. */
export const setWeight = titled('change the share of a part', (state, id, weight) =>
  change(state, id, (siblings) => {
    const given = typeof weight === 'number' ? Math.min(weight, mostOf(siblings, id)) : weight;
    return siblings.map((node) => (node.id === id ? { ...node, weight: given } : node));
  }),
);

/** Gives all parts the weights of another mixture of the same; those of mixtures within it stay. */
export const setWeights = titled('change the shares of parts', (state, { mix }) => ({
  ...state,
  parts: state.parts.map((node, k) => ({ ...node, weight: mix[k].weight ?? null })),
}));

export const movePart = titled('move a part', (state, id, to) => {
  const siblings = siblingsOf(treeOf(state), id), from = siblings.findIndex((node) => node.id === id);
  const place = Math.max(0, Math.min(siblings.length - 1, to));
  if (from === place || objectionTo(siblings, id, place)) return state;
  const order = (list) => list.toSpliced(from, 1).toSpliced(place, 0, list[from]);
  return change(state, id, () => weighed(order(siblings), order(sharesOf(siblings))));
});

/** Halves a share between a part and a new one above it, where it is a number; a mask is that of both. */
const shared = (siblings, index, node) => {
  const shares = sharesOf(siblings), own = shares[index] ?? 0.5;
  const half = typeof own === 'number' ? rounded(own / 2) : own;
  return weighed(siblings.toSpliced(index, 0, node), shares.toSpliced(index, 1, half, half));
};

export const duplicatePart = titled('duplicate a part', (state, id) => {
  let last = lastId(state);
  const copied = (node) => {
    const own = { ...node, id: ++last };
    if (node.parts) return { ...own, parts: node.parts.map(copied) };
    return { ...own, layers: node.layers.map((layer) => ({ ...layer, id: ++last })) };
  };
  return change(state, id, (siblings) => {
    const index = siblings.findIndex((node) => node.id === id);
    return shared(siblings, index, copied(siblings[index]));
  });
});

/** Removes a part, whose share goes to the last one; a mixture of one part becomes a stack. */
export const removePart = titled('remove a part', (state, id) =>
  change(state, id, (siblings) => {
    const left = siblings.filter((node) => node.id !== id);
    return weighed(left, left.map(({ weight }) => weight));
  }),
);

/** Puts another material beside the chosen part, on half of its share; a stack becomes a mixture of both. */
export const mixWith = titled('mix with another material', (state, material) => {
  const own = lastId(state) + 1, [node] = nodesOf([{ weight: 0.5, material }], own), [{ id }] = stacksOf([node]);
  if (state.parts) {
    const place = (siblings) => siblings.findIndex((other) => other.id === state.part);
    return change(state, state.part, (siblings) => shared(siblings, place(siblings), node), id);
  }
  const { name, source, thin, layers } = state;
  const title = name && node.name ? `${name} with ${node.name}` : '';
  const parts = [node, { id: own, weight: null, covers: '', name, source, thin, layers }];
  return choosePart({ ...state, name: title, source: '', parts, part: own }, id);
});

// Parts of an object ------------------------------------------------------------------------------------

/** The node of the tree that covers a part of the object, by its name: else the last; null of a stack, or where none covers any. */
export function nodeCovering(state, name) {
  if (!coversOf(state)) return null;
  const tree = treeOf(state);
  return tree.find(({ covers }) => covers === name) ?? tree.at(-1);
}

/** How a list calls what covers a part of the object. */
export function coveringName(state, name) {
  const node = nodeCovering(state, name), tree = treeOf(state);
  return node?.covers === name ? partName(node, tree.indexOf(tree.find(({ id }) => id === node.id))) : 'as the rest';
}

/** Shows the layers of what covers a part of the object. */
export const chooseCovering = titled('choose a part', (state, name) => {
  const node = nodeCovering(state, name);
  if (!node || stacksOf([node]).some(({ id }) => id === state.part)) return state;
  return choosePart(state, stacksOf([node])[0].id);
});

/** Has a part of the mixture cover a part of the object, by its name, or none: ''. */
export const setCovers = titled('change what a part covers', (state, id, name) =>
  change(state, id, (siblings) =>
    siblings.map((node) => ({ ...node, covers: node.id === id ? name : node.covers === name ? '' : node.covers })),
  ),
);

/** Gives a part of the object, by its name, a material; the others keep theirs. */
export const cover = titled('give a part of the object a material', (state, name, material) => {
  const own = lastId(state) + 1, { name: title, source, thin, layers } = state, tree = treeOf(state);
  const [node] = nodesOf([{ weight: 0, material, covers: name }], own), [{ id }] = stacksOf([node]);
  const rest = { id: own, weight: null, covers: '', name: title, source, ...(tree ? { parts: tree } : { thin, layers }) };
  const before = coversOf(state) ? tree : [rest], place = before.findIndex(({ covers }) => covers === name);
  const after = place < 0 ? shared(before, before.length - 1, node) : before.with(place, { ...node, weight: before[place].weight });
  return withTree(coversOf(state) ? state : { ...state, source: '' }, after, id);
});

/** Why another material cannot be mixed with that of a state; '' where it can. */
export function objectionToMixing(state, material) {
  const count = stacksOf(nodesOf([{ material }], 0)).length + leavesOf(state).length;
  if (count > MOST) return `A mixture may have ${MOST} stacks at most, and this would be ${count}.`;
  const [above, own] = [state.exterior, exteriorOf(material)];
  return above === own ? '' : `The exterior of all parts is one: here ${above}, in ${material.name || 'that material'} ${own}.`;
}
