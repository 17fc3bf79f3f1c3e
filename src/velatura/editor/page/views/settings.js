// The contents of the picture, and its model.

import { html, nothing } from 'lit-html';
import { partsOf } from '../render/slices.js';
import { pin, putBeside, setCamera, setModel, setSwitch, setView, swap } from '../state/commands.js';
import { isPaired, keptOf, slotBeside } from '../state/compared.js';
import { LIGHT, MOST_LIGHTS, NEW_LIGHT } from '../state/lights.js';
import { chosenOf, enabled, layerName } from '../state/material.js';
import { transformOf } from '../state/transform.js';
import { picks } from './colour.js';
import { capital, dial, iconButton, menu, number, numberField } from './controls.js';

const MODES = [
  ['single', 'One model'],
  ['split', 'Split screen'],
  ['difference', 'Difference'],
  ['tiles', 'Side by side'],
];
/** What is beside the models to compare with: slow, so that it comes a few samples at a time. */
const TRUTH = { name: 'truth', title: 'Truth (random walk)' };

const TURN = { unit: 'degrees', default: 0 };

export function line(label, control) {
  return html`<div class="parameter">
    <span class="name">${label}</span>
    <div class="control">${control}</div>
  </div>`;
}

const choice = (label, value, options, choose) => line(label, menu({ label, value, options, choose }));

// View -----------------------------------------------------------------------------------------------

/** A view of what the picture shows. */
export const createView = (services) => () => view(services);

function view({ store, session, edits, picture, choose, placeLight, takeEnvironment }) {
  const { view } = store.get(), { lights = [] } = view;
  const setLights = (next) => store.run(setView, { lights: next });
  const change = (key) => edits.of(`view.${key}`, (value) => [setView, { [key]: value }], 'view');
  const known = session.environments.map(({ name, title }) => [name, title]);
  /** The known options, with a dropped file if it is chosen. */
  const withOwn = (options, name) =>
    options.some(([known]) => known === name) ? options : [...options, [name, name.replace('file:', '')]];
  const chooseObject = (object) => {
    store.run(setView, { object });
    store.aside(setCamera, null);
  };
  const chooseEnvironment = async () => {
    const file = await choose('.hdr,.exr');
    if (file) takeEnvironment(file);
  };
  const exposure = { label: 'Exposure, in stops', spec: { low: -20, high: 20, default: 0 }, span: [-4, 4] };
  const objects = session.objects.map((name) => [name, capital(name)]);
  return html`
    ${choice('Object', view.object, withOwn(objects, view.object), chooseObject)}
    ${choice('Light', view.environment, withOwn(known, view.environment), change('environment').set)}
    ${lights.map((_, number) => light({ lights, number, edits, place: () => placeLight(number), remove: () => setLights(lights.toSpliced(number, 1)) }))}
    ${line('Light turned', dial({ label: 'Rotation of the light', value: view.rotation, spec: TURN, edit: change('rotation') }))}
    ${line('Exposure', number({ ...exposure, value: view.exposure, edit: change('exposure') }))}
    ${line(
      'Transform',
      menu({
        label: 'View transform',
        value: transformOf(view.transform, session).name,
        options: session.views.map(({ name, title }) => [name, title]),
        choose: change('transform').set,
      }),
    )}
    ${line('Lobes', lobes({ store, session, picture }))}
    <div class="actions">
      <button type="button" @click=${() => store.aside(setCamera, null)}>Reset the camera</button>
      <button type="button" @click=${chooseEnvironment}>Light from a file</button>
      <button type="button" ?disabled=${lights.length >= MOST_LIGHTS} @click=${() => setLights([...lights, NEW_LIGHT])}>Add a light</button>
    </div>
  `;
}

/** One light of one's own: its colour and strength, where it is, and buttons that place it by its highlight, and take it away. */
function light({ lights, number, edits, place, remove }) {
  const name = `Light ${number + 1}`, value = lights[number];
  const part = (key) => edits.of(`view.lights.${number}.${key}`, (next) => [setView, { lights: lights.with(number, { ...value, [key]: next }) }], 'view');
  const field = ([key, { step, ...spec }]) => html`<label
    >${capital(key)} ${numberField({ label: `${name}, ${key}`, value: value[key], spec, step, edit: part(key) })}</label
  >`;
  return html`<div class="parameter light">
    <span class="name">${name}</span>
    <div class="control">${picks({ label: name, rgb: value.colour, edit: part('colour') })}</div>
    <div class="extras">
      ${iconButton({ label: `Place the highlight of ${name}`, icon: 'aim', title: 'Moves the light to where it is mirrored at a place of the picture', act: place })}
      ${iconButton({ label: `Remove ${name}`, icon: 'remove', act: remove })}
    </div>
    <div class="pairs">${Object.entries(LIGHT).map(field)}</div>
  </div>`;
}

/** One button for all lobes, and one for each alone. */
function lobes({ store, session, picture }) {
  const { lobe } = store.get().view;
  const shader = picture.shader('a');
  if (!shader) return nothing;
  const given = picture.given('a'), all = enabled(given), number = chosenOf(given);
  const first = shader.parts.slice(0, number).flatMap(({ shown }) => shown).length;
  const title = ({ kind, layers }) => {
    if (kind !== 'reflected') return capital(kind);
    return layers.map((number) => `${number} ${layerName(all[number], session.layers)}`).join(', ');
  };
  const button = (value, text) =>
    html`<button
      type="button"
      aria-pressed=${value === lobe}
      @click=${() => store.run(setView, { lobe: value })}
    >
      ${text}
    </button>`;
  return html`<div class="choices" role="group" aria-label="Lobes shown">
    ${button(null, 'All')}${partsOf(shader.parts[number]).map((part, index) => button(first + index, title(part)))}
  </div>`;
}

// Model ----------------------------------------------------------------------------------------------

/** A view of the model, and of what it is compared with. */
export const createModel = (services) => () => model(services);

function model({ store, session, lacks, choose, takePhotograph }) {
  const { model, switches, view } = store.get();
  const { switches: choices, defaults } = session.models.find(({ name }) => name === model);
  const models = session.models.map(({ name, title }) => [name, title]);
  const other = view.other?.model ?? session.models.find(({ name }) => name !== model).name;
  const beside = () => store.run(putBeside, keptOf(store.get()));
  const chooseMode = (mode) => {
    if (mode === 'tiles' && !view.tiles?.length) return beside();
    const fits = view.other && (mode !== 'difference' || !view.other.photograph); // which is no light to subtract
    return store.run(setView, { mode, ...(isPaired({ mode }) && { other: fits ? view.other : { model: other } }) });
  };
  const choosePhotograph = async () => {
    const file = await choose('image/*');
    if (file) takePhotograph(file);
  };
  const pinned = view.other?.material || view.other?.photograph ? [['', view.other.title]] : [];
  const chooseOther = (name) =>
    name && store.run(setView, { other: name === TRUTH.name ? { truth: true, title: TRUTH.title } : { model: name } });
  const compared = view.other?.truth ? TRUTH.name : pinned.length ? '' : other;
  const others = [...pinned, ...models, [TRUTH.name, TRUTH.title, lacks('truth')]];
  const offered = Object.entries(choices).filter(([, options]) => options.length > 1);
  const selector = ([key, options]) => {
    const titles = options.map((option) => [option, option + (option === defaults[key] ? ' (default)' : '')]);
    const choose = (value) => store.run(setSwitch, key, value === defaults[key] ? null : value);
    return choice(capital(key), switches[key] ?? defaults[key], titles, choose);
  };
  return html`
    ${choice('Model', model, models, (name) => store.run(setModel, name))}
    ${choice('Compare', view.mode, MODES, chooseMode)}
    ${isPaired(view) ? choice('With', compared, others, chooseOther) : nothing}
    <div class="actions">
      <button type="button" title="To compare what it becomes with what it is" @click=${() => store.run(pin)}>
        Pin as B
      </button>
      <button type="button" ?disabled=${!view.other?.material} @click=${() => store.run(swap)}>Swap A and B</button>
      <button
        type="button"
        title="Keeps the material, as it is now, beside what it becomes; others are put there from the history"
        ?disabled=${!slotBeside(store.get())}
        @click=${beside}
      >
        Put beside
      </button>
      <button type="button" title="Puts a photograph on the right of a split screen" @click=${choosePhotograph}>Photograph</button>
    </div>
    <details class="switches">
      <summary>Switches</summary>
      ${lacks('switches') || offered.map(selector)}
    </details>
  `;
}
