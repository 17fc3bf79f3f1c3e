// Commands: pure functions from a state to the next, each with the title that undo shows.

import { besideOf, isPaired, slotBeside } from './compared.js';
import { documentOf, enabled, indices, isBase, isOpaque, layersOf, leavesOf, metalOf, stateOf, variantOf } from './material.js';
import { coefficientsOf, pigmentOf } from './pigments.js';
import { titled } from './store.js';

/** The keys of the state that undo leaves alone. */
export const OUTSIDE = ['camera', 'disk'];

const VIEW = {
  object: 'ball',
  environment: 'studio',
  rotation: 0,
  exposure: 0,
  transform: 'soft',
  lights: [],
  mode: 'single',
  other: null,
  split: 0.5,
  lobe: null,
  tiles: [],
};

/** The state that a material opens in. */
export function initial(material, session, place = {}) {
  const blank = {
    model: session.default_model,
    switches: {},
    view: VIEW,
    camera: null,
    document: 0,
    disk: {},
  };
  return openMaterial(blank, material, place);
}

// Files ----------------------------------------------------------------------------------------------

export const openMaterial = titled(
  'open a material',
  (state, material, { file = null, version = null, imported = null, model = null, switches = {}, view = {} } = {}) => {
    const document = Math.max(0, ...Object.keys(state.disk).map(Number)) + 1;
    const taken = setMaterial(state, material);
    const opened = { ...taken, ...(model && { model, switches }), view: { ...taken.view, ...view }, document };
    return { ...opened, disk: { ...state.disk, [document]: { file, version, imported, text: textOf(opened) } } };
  },
);

/** The disk now holds this material under that name. */
export const saved = titled('save', (state, material, file, version) => ({
  ...state,
  disk: { ...state.disk, [state.document]: { ...placeOf(state), file, version, text: JSON.stringify(material) } },
}));

/** A file of the disk has another name now. */
export const fileRenamed = titled('rename a file', (state, from, to) => {
  const named = ([number, place]) => [number, place.file === from ? { ...place, file: to } : place];
  return { ...state, disk: Object.fromEntries(Object.entries(state.disk).map(named)) };
});

/**
 * Where the material lies on the disk: `{file, version}`, of nulls where it does not; `imported`: the `file` of another program that
 * it was read from, and what is `left` of that, in lines.
 */
export const placeOf = (state) => state.disk[state.document] ?? { file: null, version: null, imported: null, text: null };

/** Whether the material differs from what was opened or saved. */
export const isChanged = (state) => placeOf(state).text !== textOf(state);

const textOf = (state) => JSON.stringify(documentOf(state));

// The material ---------------------------------------------------------------------------------------

/** Puts another material in the place of the one that is there. */
export const setMaterial = titled('change the material', (state, material) => ({
  ...state,
  ...stateOf(material),
  view: { ...state.view, lobe: null },
}));

/** Goes back to what a snapshot has kept. */
export const goBack = titled('go back', (state, kept) => ({
  ...state,
  ...kept,
  view: { ...state.view, lobe: null },
}));

export const rename = titled('rename', (state, name) => ({ ...state, name }));
export const setExterior = titled('change the exterior', (state, exterior) => ({ ...state, exterior }));
export const setThin = titled('change the thickness of the pane', (state, thin) => ({ ...state, thin }));

// Layers ---------------------------------------------------------------------------------------------

const changed = (state, id, change) => ({
  ...state,
  layers: state.layers.map((layer) => (layer.id === id ? { ...layer, ...change(layer) } : layer)),
});

const freshId = (state) => Math.max(0, ...leavesOf(state).flatMap(({ layers }) => layers.map(({ id }) => id))) + 1;

function inserted(state, layer, index) {
  return { ...state, layers: [...state.layers.slice(0, index), layer, ...state.layers.slice(index)] };
}

/**
 * Adds a layer at the place `at` among all, or where it makes sense: a coat on top, a medium between interfaces, a base
 * below everything. A new interface has an index that differs from those of its neighbours.
 */
export const addLayer = titled('add a layer', (state, kind, keys = {}, at = null) => {
  const layer = { id: freshId(state), kind, enabled: true, keys };
  if (isBase(layer)) {
    const covered = state.layers.map((other) => (isOpaque(other) ? { ...other, enabled: false, waits: false } : other));
    return standing(inserted({ ...state, layers: covered }, layer, state.layers.length));
  }
  const index = at ?? (kind === 'interface' ? 0 : gap(state));
  const fresh = typeof keys.eta === 'number' ? { ...layer, keys: stepped(state, keys, index) } : layer;
  return standing(inserted(state, fresh, index));
});

const STEPS = [1.33, 1.7]; // indices of interfaces next to one of a fresh index
const STEP = 0.05; // of the index, which is seen

/** The keys of an interface whose index would be that of a neighbour: with another one, at the bottom the exterior's. */
function stepped({ layers, exterior }, keys, at) {
  const isInterface = (layer) => isWanted(layer) && layer.kind === 'interface';
  const next = [layers.slice(0, at).findLast(isInterface), layers.slice(at).find(isInterface)];
  const [above, below] = next.map((layer) => layer?.keys.eta);
  const differs = (eta) => [above, below].every((other) => !(Math.abs(eta - other) < STEP));
  const bottom = above !== undefined && !layers.slice(at).some(isWanted);
  const found = [...(bottom ? [exterior] : []), keys.eta, ...STEPS].find(differs);
  return { ...keys, eta: found };
}

/** Whether a layer is on, or is once it can stand. */
const isWanted = ({ enabled, waits }) => enabled || waits;

/**
 * Turns off what cannot stand: what lies below an opaque layer, and media above nothing. These wait, and are on again
 * once they can stand. What is opaque is no pane.
 */
function standing(state) {
  const covered = state.layers.findIndex((layer) => isWanted(layer) && isOpaque(layer));
  const last = covered >= 0 ? covered : state.layers.findLastIndex((layer) => isWanted(layer) && layer.kind !== 'medium');
  const put = ({ waits, ...layer }, index) => {
    if (!layer.enabled && !waits) return layer;
    return index <= last ? { ...layer, enabled: true } : { ...layer, enabled: false, waits: true };
  };
  return { ...state, thin: state.thin && covered < 0, layers: state.layers.map(put) };
}

/** The lowest place between two layers that can take a medium, or else the top. */
function gap({ layers }) {
  for (let index = layers.length - 1; index > 0; index--) {
    if (layers[index].kind !== 'medium' && layers[index - 1].kind === 'interface') return index;
  }
  return 0;
}

export const removeLayer = titled('remove a layer', (state, id) =>
  standing({ ...state, layers: state.layers.filter((layer) => layer.id !== id) }),
);

/** Moves a layer to the place `index` among all. */
export const moveLayer = titled('move a layer', (state, id, index) => {
  const from = state.layers.findIndex((layer) => layer.id === id);
  const place = Math.max(0, Math.min(state.layers.length - 1, index));
  if (from === place) return state;
  const rest = state.layers.filter((layer) => layer.id !== id);
  return standing(inserted({ ...state, layers: rest }, state.layers[from], place));
});

export const duplicateLayer = titled('duplicate a layer', (state, id) => {
  const index = state.layers.findIndex((layer) => layer.id === id);
  return standing(inserted(state, { ...state.layers[index], id: freshId(state) }, index));
});

export const enableLayer = titled('turn a layer on or off', (state, id, on) =>
  standing(changed(state, id, () => ({ enabled: on, waits: false }))),
);

export const setValue = titled('change a value', (state, id, key, value) =>
  changed(state, id, ({ keys }) => ({ keys: { ...keys, [key]: value } })),
);

/** Gives a medium a phase function, whose asymmetry takes the place of g; without one it is that of g. */
export const setPhase = titled('change a phase function', (state, id, phase) =>
  changed(state, id, ({ keys }) => {
    const others = Object.entries(keys).filter(([key]) => key !== 'g' && key !== 'phase');
    return { keys: Object.fromEntries(phase === undefined ? others : [...others, ['phase', phase]]) };
  }),
);

// Films of an interface, by their number from the top -------------------------------------------------

/** Changes the list of films of a layer; none is no key. */
const withFilms = (state, id, change) =>
  changed(state, id, ({ keys: { films = [], ...keys } }) => {
    const next = change(films);
    return { keys: next.length ? { ...keys, films: next } : keys };
  });

export const addFilm = titled('add a film', (state, id, film) => withFilms(state, id, (films) => [...films, film]));

export const removeFilm = titled('remove a film', (state, id, n) =>
  withFilms(state, id, (films) => films.filter((_, other) => other !== n)),
);

export const moveFilm = titled('move a film', (state, id, from, to) =>
  from === to ? state : withFilms(state, id, (films) => films.toSpliced(from, 1).toSpliced(to, 0, films[from])),
);

export const setFilm = titled('change a film', (state, id, n, key, value) =>
  withFilms(state, id, (films) => films.with(n, { ...films[n], [key]: value })),
);

// Pigments of a medium, by their number --------------------------------------------------------------

/** Adds a pigment; the first one stands for the absorption and scattering that the medium has, of `given` where it has none. */
export const addPigment = titled('add a pigment', (state, id, fresh, given) =>
  changed(state, id, ({ keys }) => {
    const { sigma_a: a = given.sigma_a, sigma_s: s = given.sigma_s, ...others } = keys;
    const first = keys.pigments ?? [pigmentOf(a, s, keys.g ?? given.g)];
    return { keys: { ...others, pigments: keys.pigments ? [...first, fresh] : first } };
  }),
);

/** Takes a pigment away; without any, the medium keeps the absorption and scattering of the last one. */
export const removePigment = titled('remove a pigment', (state, id, n) =>
  changed(state, id, ({ keys: { pigments, ...keys } }) => {
    const left = pigments.filter((_, other) => other !== n);
    return { keys: { ...keys, ...(left.length ? { pigments: left } : coefficientsOf(pigments, keys.g)) } };
  }),
);

export const setPigment = titled('change a pigment', (state, id, n, changes) =>
  changed(state, id, ({ keys }) => ({ keys: { ...keys, pigments: keys.pigments.with(n, { ...keys.pigments[n], ...changes }) } })),
);

// Kinds of layers ------------------------------------------------------------------------------------

/**
 * Makes an interface or a base `diffuse`, `dielectric`, `metal`, `custom` or `mirror`; indices that it has are kept. What
 * another kind takes that it has not is `fresh`, by the names of layers.
 */
export const setVariant = titled('change the kind of a layer', (state, id, variant, names, fresh) =>
  standing(
    changed(state, id, (layer) => {
      const next = become(variant, layer.kind, layer.keys, names, fresh);
      const isNew = variant === 'dielectric' && !['dielectric', 'custom'].includes(variantOf(layer)); // an index of no number before
      const others = { ...state, layers: state.layers.filter((other) => other !== layer) };
      return isNew ? { ...next, keys: stepped(others, next.keys, state.layers.indexOf(layer)) } : next;
    }),
  ),
);

function become(variant, kind, keys, names, fresh) {
  if (variantOf({ kind, keys }) === variant) return {};
  if (variant === 'diffuse') return { kind: 'diffuse', keys: fresh.diffuse };
  const own = kind === 'interface' ? keys : fresh.interface;
  const named = metalOf(own);
  const { eta, k } = named === undefined ? own : {};
  const metal = indicesOf(named === undefined || named === 'mirror' ? 'Al' : named, names);
  const index = {
    dielectric: () => ({ eta: typeof eta === 'string' && names.conductors[eta] ? 1.5 : (eta ?? 1.5) }),
    metal: () => metal,
    custom: () => ({
      eta: kind === 'interface' && eta !== undefined ? eta : rounded(indices(metal.conductor ?? metal.eta, 'eta', names)),
      k: k ?? rounded(indices(metal.conductor ?? metal.k, 'k', names)),
    }),
    mirror: () => ({ conductor: 'mirror' }),
  };
  return { kind: 'interface', keys: { ...index[variant](), ...surfaceOf(own) } };
}

/** Puts another metal by name, or by the page of refractiveindex.info, in the place of the indices of an interface. */
export const setMetal = titled('change a metal', (state, id, name, names) =>
  changed(state, id, ({ keys }) => ({ keys: { ...indicesOf(name, names), ...surfaceOf(keys) } })),
);

/** The values of an interface but its indices. */
const surfaceOf = (keys) =>
  Object.fromEntries(Object.entries(keys).filter(([key]) => !['eta', 'k', 'conductor'].includes(key)));

/** The indices of a metal, as a file has them. */
function indicesOf(name, names) {
  const page = { refractiveindex: name };
  return name === 'mirror' || Object.hasOwn(names.conductors, name) ? { conductor: name } : { eta: page, k: page };
}

const rounded = (colour) => colour.map((channel) => Number(channel.toPrecision(4)));

// By appearance -------------------------------------------------------------------------------------

/** Takes the layers of another material; what is turned off stays, below where its place is gone. */
function withLayers(state, material) {
  const next = layersOf(material);
  const on = enabled(state);
  const alike = on.length === next.length && on.every(({ kind }, index) => kind === next[index].kind);
  if (alike) {
    const keys = new Map(on.map(({ id }, index) => [id, next[index].keys]));
    return { ...state, layers: state.layers.map((layer) => ({ ...layer, keys: keys.get(layer.id) ?? layer.keys })) };
  }
  const first = freshId(state);
  const fresh = next.map((layer, index) => ({ ...layer, id: first + index }));
  return { ...state, layers: [...fresh, ...state.layers.filter((layer) => !layer.enabled)] };
}

export const setAppearance = titled('change the appearance', withLayers);
export const setMember = titled('choose a member of the class', (...given) => withLayers(...given));
export const addCoat = titled('coat the material', (...given) => withLayers(...given));

// How it is shown ------------------------------------------------------------------------------------

export const setModel = titled('change the model', (state, model, switches) =>
  state.model === model && !switches ? state : { ...state, model, switches: switches ?? {} },
);

/** Sets a switch of the model, or takes it back to its default where the value is null. */
export const setSwitch = titled('change a switch of the model', (state, key, value) => {
  const { [key]: _, ...rest } = state.switches;
  return { ...state, switches: value === null ? rest : { ...rest, [key]: value } };
});

export const setView = titled('change the view', (state, changes) => ({
  ...state,
  view: { ...state.view, ...changes },
}));

/** Puts a material beside the open one: into slot B, as the model of the open one has it. */
export const compareWith = titled('compare with another material', (state, material, name) => {
  const { model, switches, view } = state;
  const other = { material, model, switches, title: `B: ${name}` };
  return { ...state, view: { ...view, mode: isPaired(view) ? view.mode : 'split', other } };
});

/** Keeps the material, to compare what it becomes with. */
export const pin = titled('pin the material', (state) => compareWith(state, documentOf(state), state.name || 'pinned'));

/** The pinned material in the place of the open one, which is pinned. */
export const swap = titled('swap A and B', (state) => {
  const { material, model, switches } = state.view.other;
  return { ...setMaterial(pin(state), material), model, switches };
});

/** Puts what a snapshot has kept beside the open material. */
export const putBeside = titled('put side by side', (state, kept, number = null) => {
  const slot = slotBeside(state);
  if (!slot) return state;
  const tiles = [...besideOf(state), { slot, number, kept }];
  return { ...state, view: { ...state.view, mode: 'tiles', tiles } };
});

export const takeAway = titled('take away', (state, slot) => {
  const tiles = besideOf(state).filter((tile) => tile.slot !== slot);
  return { ...state, view: { ...state.view, mode: tiles.length ? 'tiles' : 'single', tiles } };
});

export const setCamera = titled('move the camera', (state, camera) => ({ ...state, camera }));

/** The position of a layer among those that count, as messages of Python number them. */
export const numberOf = (state, id) => enabled(state).findIndex((layer) => layer.id === id);
