// A parameter of a layer: its name, the control for its kind, and its alternatives.

import { html, nothing } from 'lit-html';
import { axes, enabled, indices, isOpaque, metalOf, pageOf, variantOf } from '../state/material.js';
import { setMetal, setPhase, setValue } from '../state/commands.js';
import { channelsOf, colour, tint } from './colour.js';
import { dial, iconButton, menu, number, numberField, texture } from './controls.js';
import { films } from './films.js';
import { whole } from './scrubbing.js';
import { pigments } from './pigments.js';
import { chosen, dielectrics, metals } from './names.js';

const NAMES = {
  eta: 'Index',
  k: 'Extinction',
  conductor: 'Metal',
  alpha: 'Roughness',
  rotation: 'Rotation',
  depth: 'Depth',
  sigma_a: 'Absorption',
  sigma_s: 'Scattering',
  g: 'Forward (g)',
  phase: 'Phase function',
  pigments: 'Pigments',
  albedo: 'Albedo',
  films: 'Thin films',
  thickness_nm: 'Thickness',
  weight: 'Share',
  concentration: 'Concentration',
};
const SPANS = { eta: [1, 4], k: [0, 10] }; // where sliders for indices end; fields take any
const PLAIN = { number: 0, pair: 0.1, angle: 0, colour: 0.5, index: 1.5 }; // in place of a texture

const isTexture = (value) => value?.texture !== undefined;
const fileOf = (value) => (Array.isArray(value?.spectrum) ? 'a table' : value?.spectrum ?? pageOf(value));
const isMeasured = (value) => fileOf(value) !== undefined;
const isBrushing = (value) => value?.brushing !== undefined;

const INDICES = { dielectric: ['eta'], metal: ['conductor'], custom: ['eta', 'k'], mirror: [] };

/** Which parameters a layer shows: of the indices, an interface has those of its kind only. */
export function parametersOf(layer, schema) {
  const all = Object.keys(schema[layer.kind]);
  if (layer.kind === 'medium') return all.filter((key) => !unseen(layer.keys).includes(key));
  if (layer.kind !== 'interface') return all;
  const hidden = Object.values(INDICES).flat();
  return [...INDICES[variantOf(layer)], ...all.filter((key) => !hidden.includes(key))];
}

/** Whether a parameter is called by a word in small letters, or one within it is. */
export function isCalled(key, { kind }, schema, word) {
  const within = { films: schema.film, pigments: schema.pigment }[kind] ?? {};
  return [key, ...Object.keys(within)].flatMap((each) => [each, NAMES[each] ?? '']).some((name) => name.toLowerCase().includes(word));
}

/** Parameters of a medium that follow from others. */
function unseen({ phase, pigments }) {
  return [...(phase === undefined ? [] : ['g']), ...(pigments === undefined ? [] : ['sigma_a', 'sigma_s'])];
}

/** Whether a medium has a colour, which is that of its absorption: not where an image, a table or pigments have that. */
export function hasTint({ session }, layer) {
  if (layer.kind !== 'medium') return false;
  const { sigma_a: sigma, depth, pigments } = { ...standards(session.schema.medium), ...layer.keys };
  return !pigments.length && typeof depth === 'number' && depth > 0 && (typeof sigma === 'number' || Array.isArray(sigma));
}

/** The colour of a medium that has one. */
export function tintOf({ store, session, edits }, layer) {
  const { sigma_a: sigma, depth } = { ...standards(session.schema.medium), ...layer.keys };
  const twice = isOpaque(enabled(store.get()).at(-1));
  const label = `Colour ${twice ? 'twice' : 'once'} through`;
  const act = (next) => [setValue, layer.id, 'sigma_a', next];
  const edit = edits.of(`${layer.id}.sigma_a`, act, `layer.${layer.id}`, layer.id);
  return html`<div class="parameter" title="What absorption leaves of white light, at the normal; changes sigma_a">
    <span class="name">${label}</span>
    <div class="control">${tint({ label, sigma, way: (twice ? 2 : 1) * depth, edit })}</div>
  </div>`;
}

const standards = (schema) => Object.fromEntries(Object.entries(schema).map(([key, spec]) => [key, spec.default]));

/**
 * `services` are {store, session, lacks, edits, messages, choose, upload, spaces, strips}; `spaces` holds the colours that
 * are shown by hue.
 */
export function parameter(services, layer, key) {
  const { names, schema, layers } = services.session;
  const declared = schema[layer.kind][key];
  const spec = { ...declared, default: declared.default ?? layers[layer.kind].fresh[key] };
  const value = layer.keys[key] ?? spec.default;
  const act = (next) => (key === 'conductor' ? [setMetal, layer.id, next, names] : [setValue, layer.id, key, next]);
  return row(services, { layer, key, label: '', value, spec, act });
}

/**
 * The row of a value of a layer, or of a part of one whose cards are those of its `owner`: `label` says which; `act(value)`
 * is [command, ...args]. `over` lies above the control.
 */
export function row(services, { layer, key, label: part, value, spec, act, owner = layer, over = nothing, ...given }) {
  const { session, edits } = services, name = NAMES[key] ?? key;
  const label = part ? `${part}, ${name.toLowerCase()}` : name;
  const edit = edits.of(`${layer.id}.${key}`, act, `layer.${owner.id}`, owner.id);
  const context = { services, layer, key, label, spec, value, edit, records: session.schema, ...given };
  const { control, extras } = FORMS[spec.kind](context);
  const takes = spec.texturable && !services.lacks('texture') ? textureTarget(context) : {};
  return html`<div
    class="parameter"
    title=${explained(key, spec)}
    @dragover=${takes.over}
    @drop=${takes.drop}
  >
    <span class="name" ${whole(hasDefault(spec) ? () => takeDefault(context) : null)}
      >${name} <span class="unit">${spec.kind === 'angle' ? '' : spec.unit}</span></span
    >
    <span class="extras">${extras}</span>
    <div class="control">${over}${control}</div>
  </div>`;
}

/** Whether a double click on the name takes the default: lists of things are not removed by one. */
const hasDefault = (spec) => Object.hasOwn(PLAIN, spec.kind) && (spec.default ?? null) !== null;

function takeDefault({ value, spec, edit }) {
  if (JSON.stringify(value) !== JSON.stringify(spec.default)) edit.set(spec.default);
}

function explained(key, spec) {
  const { doc, low = null, high = null, unit } = spec;
  const range = high !== null ? `, ${low} to ${high}` : low !== null ? `, from ${low}` : '';
  const standard = hasDefault(spec) ? `; a double click takes ${[spec.default].flat().join(', ')}` : '';
  return `${key}: ${doc}${range}${unit ? ` (${unit})` : ''}${standard}`;
}

// By kind --------------------------------------------------------------------------------------------

const FORMS = {
  number: (context) => simple(context, number, context.span),
  colour: (context) => simple(context, colour),
  index,
  pair,
  angle,
  phase,
  pigments: (context) => pigments({ ...context, row: (given) => row(context.services, given) }),
  films: (context) => films({ ...context, row: (given) => row(context.services, given) }),
  choice: ({ services, layer, label, edit }) => {
    const groups = metals(services.session.names), value = metalOf(layer.keys);
    const options = [...chosen(value, groups), ...groups];
    return { control: menu({ label, value, options, choose: edit.set }), extras: nothing };
  },
};

/** A control that may give way to a texture. */
function simple(context, control, span = SPANS[context.key]) {
  const { value } = context;
  if (isTexture(value)) return textured(context);
  if (isMeasured(value)) return measured(context);
  const channels = control === colour && { hsv: spaceOf(context), beside: channelsMenu(context) };
  return { control: control({ ...context, ...channels, ...(span && { span }) }), extras: textureButton(context) };
}

const placeOf = ({ layer, key }) => `${layer.id}.${key}`;
const spaceOf = ({ services, ...context }) => services.spaces.get(placeOf(context)) ?? null;

/** Whether a colour is one number, or three, or three by hue. */
function channelsMenu(context) {
  const { services, label, value, spec, edit } = context;
  const several = Array.isArray(value);
  const options = [['grey', 'Grey'], ['rgb', 'RGB'], ...(spec.high === 1 ? [['hsv', 'HSV']] : [])];
  const choose = (name) => {
    services.spaces.delete(placeOf(context));
    if (name === 'hsv') services.spaces.set(placeOf(context), { latest: null });
    if (name === 'grey') edit.set(Number((value.reduce((a, b) => a + b) / 3).toPrecision(4)));
    else if (!several) edit.set(channelsOf(value));
    else services.update();
  };
  return menu({ label: `${label} by`, value: several ? (spaceOf(context) ? 'hsv' : 'rgb') : 'grey', options, choose });
}

/** An index: a name of a measured material, a page of refractiveindex.info, or numbers. */
function index(context) {
  const { services, layer, key, label, value, edit } = context;
  const { names } = services.session;
  const page = pageOf(value);
  const known = Object.hasOwn(names.pages, page ?? '');
  if (isTexture(value)) return textured(context);
  if (isMeasured(value) && !known) return measured(context);
  const named = typeof value === 'string' || known;
  const groups = [
    ...(variantOf(layer) === 'custom' ? metals(names) : []),
    ...(key === 'eta' ? dielectrics(names) : []),
  ];
  const name = known ? page : named ? value : '';
  const options = [['', 'By number'], ...chosen(name, groups), ...groups];
  const written = (choice) => (Object.hasOwn(names.pages, choice) ? { refractiveindex: choice } : choice);
  const choose = (choice) => edit.set(written(choice) || plainIndex(indices(value, key, names)));
  const menuOf = menu({ label: `${label}, by name`, value: name, options, choose });
  const numbers = named ? { control: nothing, extras: textureButton(context) } : simple(context, colour);
  return { control: html`${menuOf}${numbers.control}`, extras: numbers.extras };
}

/** The numbers of a name as one number where the channels are nearly the same. */
function plainIndex(found) {
  const rgb = channelsOf(found ?? 1.5).map((channel) => Number(channel.toPrecision(4)));
  return Math.max(...rgb) === Math.min(...rgb) ? rgb[0] : rgb;
}

/** Roughness: one number while locked, else one for each axis; each may be a texture. */
function pair(context) {
  const { label, value, edit } = context;
  const locked = !Array.isArray(value);
  const lock = iconButton({
    label: locked ? `${label}: one for each axis` : `${label}: the same for both axes`,
    icon: locked ? 'locked' : 'unlocked',
    pressed: locked,
    name: 'lock',
    act: () => edit.set(locked ? axes(value) : value[0]),
  });
  if (locked) {
    const { control, extras } = simple(context, number);
    return { control, extras: html`${lock}${extras}` };
  }
  const axis = (name, place) => {
    const replaced = (next) => value.map((old, other) => (other === place ? next : old));
    const one = {
      ...edit,
      move: (next) => edit.move(replaced(next)),
      set: (next) => edit.set(replaced(next)),
    };
    const part = simple({ ...context, label: `${label} ${name}`, value: value[place], edit: one }, number);
    return html`<div class="axis"><span class="tag">${name}</span>${part.control}${part.extras}</div>`;
  };
  return { control: html`${axis('u', 0)}${axis('v', 1)}`, extras: lock };
}

/** Rotation: an angle, a texture, or a field of directions. */
function angle(context) {
  const { label, value, spec, edit, records, services } = context;
  if (isTexture(value)) return textured(context);
  const straight = !isBrushing(value);
  const fields = records.brushing.brushing.options.map((kind) => [kind, kind, services.lacks('texture')]);
  const choose = (kind) => edit.set(kind === 'straight' ? 0 : { ...(straight ? {} : value), brushing: kind });
  const brushing = menu({
    label: `${label}, brushing`,
    value: straight ? 'straight' : value.brushing,
    options: ['straight', ...fields],
    choose,
  });
  const part = (key) => {
    const one = {
      ...edit,
      set: (next) => edit.set({ ...value, [key]: next }),
      move: (next) => edit.move({ ...value, [key]: next }),
    };
    const number = value[key] ?? records.brushing[key].default;
    return html`<label
      >${key} ${numberField({ label: `${label}, ${key}`, value: number, spec: records.brushing[key], edit: one })}</label
    >`;
  };
  return {
    control: straight
      ? html`<div class="angle">${dial({ label, value, spec, edit })}${brushing}</div>`
      : html`${brushing}
          <div class="pairs">${['u', 'v', 'offset'].map(part)}</div>`,
    extras: textureButton(context),
  };
}

const PHASES = { // of a new one
  rayleigh: ['Rayleigh', 'rayleigh'],
  two_lobes: ['Two lobes', { forward: 0.8, backward: -0.3, share: 0.8 }],
  mie: ['Spheres (Mie)', { eta: 1.5, radius_um: 0.5 }],
};

/** The kind of a phase function, as its record is called. */
function kindOf(phase) {
  if (typeof phase !== 'object') return phase;
  return phase.forward !== undefined ? 'two_lobes' : phase.table !== undefined ? 'phase_table' : 'mie';
}

/** A phase function: by g, or another one by its numbers; a table stays as it is. */
function phase({ services, layer, label, value, edit, records }) {
  const { store, lacks } = services;
  const kind = value === null ? 'g' : kindOf(value);
  const none = lacks('phase');
  const options = [['g', 'Henyey-Greenstein'], ...Object.entries(PHASES).map(([name, [title]]) => [name, title, none])];
  if (kind === 'phase_table') options.push([kind, 'Table']);
  const choose = (name) => store.run(setPhase, layer.id, PHASES[name]?.[1]);
  const part = (key) => {
    const one = {
      ...edit,
      set: (next) => edit.set({ ...value, [key]: next }),
      move: (next) => edit.move({ ...value, [key]: next }),
    };
    const spec = records[kind][key];
    return html`<label title=${spec.doc}
      >${key} ${numberField({ label: `${label}, ${key}`, value: value[key] ?? spec.default, spec, edit: one })}</label
    >`;
  };
  const numbers = value !== null && records[kind] ? Object.keys(records[kind]) : [];
  const given = numbers.filter((key) => (value[key] ?? records[kind][key].default) !== null);
  return {
    control: html`${menu({ label, value: kind, options, choose })}
      <div class="pairs">${given.map(part)}</div>`,
    extras: nothing,
  };
}

// Textures -------------------------------------------------------------------------------------------

function textured(context) {
  const { label, spec, edit, records, plain = PLAIN[spec.kind] } = context;
  const act = () => edit.set(plain);
  return {
    control: texture({ ...context, records: records.texture }),
    extras: iconButton({ label: `${label}: remove the texture`, icon: 'remove', act }),
  };
}

/** Values over wavelength, by the file of their table or the page of their substance. */
function measured({ label, value, spec, edit }) {
  const act = () => edit.set(PLAIN[spec.kind]);
  return {
    control: html`<span class="file" title=${fileOf(value)}>${fileOf(value)}</span>`,
    extras: iconButton({ label: `${label}: remove the table`, icon: 'remove', act }),
  };
}

function textureButton({ services, label, edit, spec }) {
  if (!spec.texturable) return nothing;
  const act = async () => {
    const file = await services.choose('image/*,.exr,.hdr');
    if (file) putTexture(services, file, edit);
  };
  const lacks = services.lacks('texture');
  const words = `${label}: take a texture`;
  return iconButton({ label: words, icon: 'texture', act, disabled: Boolean(lacks), title: lacks || words });
}

function textureTarget({ services, edit }) {
  return {
    over: (event) => event.preventDefault(),
    drop(event) {
      const [file] = event.dataTransfer?.files ?? [];
      if (!file) return;
      event.preventDefault();
      event.stopPropagation();
      putTexture(services, file, edit);
    },
  };
}

async function putTexture({ messages, upload }, file, edit) {
  await messages.attempt(`Texture ${file.name}`, async () => edit.set({ texture: await upload(file) }));
}
