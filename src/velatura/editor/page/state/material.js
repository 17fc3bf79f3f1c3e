// A material: layers of the state from and to the document of a file, their flat values, and their shape.

/** Layers with identities, from the document of a file. */
export function layersOf(material) {
  return material.layers.map((entry, index) => {
    const [[kind, keys]] = Object.entries(entry);
    return { id: index + 1, kind, enabled: true, keys: keys ?? {} };
  });
}

/** The layers that count. */
export const enabled = (state) => state.layers.filter((layer) => layer.enabled);

/** The document that a file would hold; layers that are off are not in it. */
export function documentOf(state) {
  const { name, source, exterior, thin } = state;
  return {
    ...(name && { name }),
    ...(source && { source }),
    ...(exterior !== 1 && { exterior }),
    ...(thin && { thin }),
    layers: enabled(state).map(({ kind, keys }) => ({ [kind]: keys })),
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
  const values = { exterior: state.exterior };
  enabled(state).forEach(({ kind, keys }, index) => {
    for (const [key, value] of numbersOf(keys, schema[kind], names)) values[`layer${index}_${key}`] = value;
  });
  return values;
}

/** The numbers of a layer, as [key, value], by the kinds of its parameters in the schema. */
function numbersOf(keys, parameters, names) {
  const found = Object.entries(parameters).flatMap(([key, { kind, default: standard }]) => {
    const value = keys[key] ?? standard;
    if (kind === 'films' || kind === 'pigments') return [];
    if (key === 'g' && keys.phase !== undefined) return []; // that asymmetry Python knows
    if (key.startsWith('sigma_') && keys.pigments !== undefined) return []; // these, too
    if (kind === 'pair') return axes(value).map((one, axis) => [`${key}_${'uv'[axis]}`, one]);
    if (kind !== 'index') return [[key, value]];
    return keys.conductor === 'mirror' ? [] : [[key, indices(keys.conductor ?? value, key, names)]];
  });
  return found.filter(([, value]) => typeof value === 'number' || Array.isArray(value));
}

/** The two of a pair; a locked one has the same twice. */
export const axes = (pair) => (Array.isArray(pair) ? pair : [pair, pair]);

/** Whether an interface has any films, and one that absorbs. */
function films({ films = [] }) {
  const thick = films.filter(({ thickness_nm: thickness }) => thickness !== 0);
  return [thick.length > 0, thick.some(({ k = 0 }) => [k].flat().some((channel) => channel !== 0))];
}

/** What decides about the code of a shader, as text; two states of one pattern differ in numbers alone. */
export function pattern(state) {
  const shape = (value) => {
    if (Array.isArray(value)) return value.length === 2 ? value.map(shape) : 0;
    return value !== null && typeof value === 'object' ? value : 0;
  };
  const layers = enabled(state).map(({ kind, keys }) => [
    kind === 'interface' ? (isOpaque({ kind, keys }) ? keys.conductor === 'mirror' : 'dielectric') : kind,
    Object.entries(keys)
      .filter(([key, value]) => key !== 'films' && typeof shape(value) === 'object')
      .map(([key, value]) => [key, shape(value)]),
    films(keys), // of which code knows no more
    keys.phase ?? 0, // whose asymmetry Python knows
    keys.pigments ?? 0,
  ]);
  return JSON.stringify([state.thin, layers]);
}
