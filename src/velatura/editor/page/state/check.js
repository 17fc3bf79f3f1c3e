// Whether a document is a material, by the parameters that the session declares.

import { pageOf } from './material.js';
import { objection } from './range.js';

const SEVERAL = { pair: 2, colour: 3, index: 3 }; // numbers that a parameter may have

/** Raises Error in one line where a document holds what no material has, or what needs Python. */
export function check(material, session) {
  const { schema } = session;
  const { layers, mix, ...whole } = Object(material);
  if (mix !== undefined) throw new Error('mixtures need Python: velatura edit');
  if (!Array.isArray(layers) || !layers.length) throw new Error('layers: must hold at least one layer');
  checkKeys('', whole, schema.material, session);
  layers.forEach((entry, index) => {
    const [[kind, keys] = [], ...others] = Object.entries(Object(entry));
    if (others.length || !Object.hasOwn(schema, kind) || kind === 'material')
      throw new Error(`layer ${index}: must be one of interface, medium, diffuse with its keys`);
    checkKeys(`layer ${index} (${kind}): `, keys ?? {}, schema[kind], session);
  });
}

function checkKeys(where, keys, declared, session) {
  for (const [key, value] of Object.entries(keys)) {
    if (!Object.hasOwn(declared, key)) throw new Error(`${where}${key}: is not a key here`);
    const wrong = refusal(value, declared[key], session.names);
    if (wrong) throw new Error(`${where}${key}: ${wrong}`);
    if (declared[key].kind === 'films') checkFilms(`${where}${key}: `, value, session);
  }
}

function checkFilms(where, films, session) {
  films.forEach((film, k) => {
    for (const key of ['eta', 'thickness_nm'])
      if (Object(film)[key] === undefined) throw new Error(`${where}film ${k}: ${key}: missing`);
    checkKeys(`${where}film ${k}: `, film, session.schema.film, session);
  });
}

function refusal(value, spec, names) {
  const { kind, options } = spec;
  if (kind === 'flag') return typeof value === 'boolean' ? '' : 'must be true or false';
  if (kind === 'text') return typeof value === 'string' ? '' : 'must be text';
  if (kind === 'films') {
    if (!Array.isArray(value)) return 'must be a list of films';
    return value.length > spec.most ? `must be at most ${spec.most} films` : '';
  }
  if (kind === 'phase') return 'phase functions need Python';
  if (kind === 'pigments') return 'pigments need Python';
  if (kind === 'choice') return options.includes(value) ? '' : `must be one of ${options.join(', ')}`;
  if (kind === 'index' && Object.hasOwn(names.pages, pageOf(value) ?? '')) return '';
  if (value !== null && typeof value === 'object' && !Array.isArray(value)) return 'textures and spectra need Python';
  if (kind === 'index' && typeof value === 'string')
    return [names.dielectrics, names.conductors].some((known) => Object.hasOwn(known, value)) ? '' : `${value} is not a known name`;
  if (Array.isArray(value) && value.length !== SEVERAL[kind]) return `must not be ${value.length} numbers`;
  return [value].flat().map((number) => objection(number, spec)).find(Boolean) ?? '';
}
