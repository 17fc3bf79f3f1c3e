// The layers: from the top down, each with its parameters; dragged or moved by keys.

import { html, nothing } from 'lit-html';
import { repeat } from 'lit-html/directives/repeat.js';
import { live } from 'lit-html/directives/live.js';
import {
  addLayer,
  duplicateLayer,
  enableLayer,
  moveLayer,
  numberOf,
  placeOf,
  removeLayer,
  rename,
  setExterior,
  setThin,
  setVariant,
} from '../state/commands.js';
import { enabled, isBase, isOpaque, layerName, objectionToEnabling, pageOf, variantOf } from '../state/material.js';
import { createCards } from './cards.js';
import { capital, flag, iconButton, menu, numberField, shown } from './controls.js';
import { icons } from './icons.js';
import { grip } from './moving.js';
import { hasTint, parameter, parametersOf, tintOf } from './parameter.js';
import { objectParts, parts } from './parts.js';
import { text } from './typing.js';

const VARIANTS = [
  ['dielectric', 'Dielectric'],
  ['metal', 'Metal by name'],
  ['custom', 'Metal by eta and k'],
  ['mirror', 'Mirror'],
];
const BASES = [...VARIANTS, ['diffuse', 'Diffuse']];
const BETWEEN = ['interface', 'medium']; // kinds that may lie above others

/** A view of the layers of the state. */
export function createLayers(services) {
  // The places where a card that is dragged would go, and where a new one is chosen
  const panel = { ...services, cards: createCards(services), dropAt: null, openAt: null, spaces: new Map() };
  return () => layers(panel);
}

function layers(panel) {
  const state = panel.store.get();
  return html`
    ${top(panel, state)} ${notCarried(placeOf(state).imported)} ${objectParts(panel)} ${parts(panel)} ${panel.cards.tools()}
    <ol class="layers">
      ${repeat(
        state.layers,
        ({ id }) => id,
        (layer, index) => html`${between(panel, index)}${card(panel, layer, index)}`,
      )}
      ${state.layers.some(isBase) ? nothing : between(panel, state.layers.length)}
    </ol>
    <div class="add" role="group" aria-label="Add a layer">
      <span>Add</span>
      ${Object.entries(panel.session.layers).map(
        ([kind, { title, fresh }]) =>
          html`<button type="button" data-add=${kind} @click=${() => panel.store.run(addLayer, kind, fresh)}>
            ${capital(title)}
          </button>`,
      )}
    </div>
  `;
}

/** A place for a new layer, and where it was chosen the kinds that may lie there. */
function between(panel, index) {
  const { store, session } = panel;
  const open = panel.openAt === index;
  const show = (at) => {
    panel.openAt = at;
    panel.update();
  };
  const add = (kind) => {
    show(null);
    store.run(addLayer, kind, session.layers[kind].fresh, index);
    panel.focus(`[data-layer="${store.get().layers[index].id}"] .grip`);
  };
  const kinds = index === store.get().layers.length ? Object.keys(session.layers) : BETWEEN;
  return html`<li class="between">
    <button
      type="button"
      class="small plus"
      title="Add a layer here"
      aria-label=${`Add a layer at place ${index}`}
      aria-expanded=${open}
      @click=${() => show(open ? null : index)}
    >
      ${icons.plus}
    </button>
    ${
      open
        ? kinds.map(
            (kind) =>
              html`<button type="button" data-kind=${kind} @click=${() => add(kind)}>
                ${capital(session.layers[kind].title)}
              </button>`,
          )
        : nothing
    }
  </li>`;
}

function top({ store, session, edits }, state) {
  const { name, exterior, thin } = state, lacks = isOpaque(enabled(state).at(-1)) ? 'Only of what ends in a dielectric' : '';
  const edit = edits.of('exterior', (next) => [setExterior, next], 'material');
  const { material } = session.schema;
  return html`<div class="top">
    <label class="wide">
      Name
      <input
        type="text"
        .value=${text(name)}
        spellcheck="false"
        @change=${({ target }) => store.run(rename, target.value)}
      />
    </label>
    <label title=${material.exterior.doc}>
      Exterior ${numberField({ label: 'Exterior index', value: exterior, spec: material.exterior, edit })}
    </label>
    ${flag({ label: 'Thin pane', value: thin, title: material.thin.doc, lacks, choose: (on) => store.run(setThin, on) })}
  </div>`;
}

/** What an import could not carry, or not as it was. */
function notCarried(imported) {
  if (!imported?.left.length) return nothing;
  const { file, left } = imported;
  return html`<details class="left">
    <summary>Not carried from ${file}, or not as it was (${left.length})</summary>
    <ul>
      ${left.map((line) => html`<li>${line}</li>`)}
    </ul>
  </details>`;
}

// One layer ------------------------------------------------------------------------------------------

function card(panel, layer, index) {
  const { store, session } = panel;
  const name = layerName(layer, session.layers);
  const problem = panel.messages.problemOf(layer.id);
  const number = numberOf(store.get(), layer.id);
  const standing = enabled(store.get()).filter(({ kind }) => kind !== 'medium');
  const only = standing.length === 1 && standing[0] === layer; // without which there is no material
  const wrong = layer.enabled ? '' : objectionToEnabling(store.get().layers, index);
  const tinted = hasTint(panel, layer), { cards } = panel;
  return html`<li
    class="layer ${layer.kind} ${layer.enabled ? '' : 'off'} ${panel.dropAt === index ? 'drop' : ''}"
    data-layer=${layer.id}
    aria-label=${layer.enabled ? `Layer ${number}: ${name}` : `${name}, off`}
  >
    <div class="head">
      ${layer.enabled ? cards.fold(layer, name) : nothing} ${grip({ name, place: index, items: '.layer', ...moving(panel, layer) })}
      <b class="place" title="Its number in plots and messages">${layer.enabled ? number : '–'}</b>
      ${kindOf(panel, layer)}
      <span class="buttons">
        <input
          type="checkbox"
          title=${wrong || 'On or off'}
          aria-label=${`${name} is on`}
          ?disabled=${only || wrong}
          .checked=${live(layer.enabled)}
          @change=${({ target }) => store.run(enableLayer, layer.id, target.checked)}
        />
        ${
          isBase(layer)
            ? nothing
            : iconButton({
                label: `Duplicate ${name}`,
                icon: 'duplicate',
                act: () => store.run(duplicateLayer, layer.id),
              })
        }
        ${iconButton({
          label: `Remove ${name}`,
          icon: 'remove',
          act: () => remove(panel, layer, index),
          disabled: only,
        })}
      </span>
    </div>
    ${problem ? html`<p class="problem">${problem}</p>` : nothing}
    <div class="parameters" ?hidden=${!layer.enabled || cards.isFolded(layer)}>
      ${tinted && cards.isSought('Colour, tint') ? tintOf(panel, layer) : nothing}
      ${repeat(
        cards.keysOf(layer, parametersOf(layer, session.schema), tinted ? ['sigma_a'] : []),
        (key) => key,
        (key) => parameter(panel, layer, key),
      )}
      ${below(store.get(), layer)}
    </div>
  </li>`;
}

/** What lies below an interface of a pane, in words. */
function below(state, { id, keys }) {
  const all = enabled(state), last = all.at(-1);
  if (isOpaque(last) || all.find((layer) => layer.id === id)?.kind !== 'interface') return nothing;
  const { eta } = keys, isNumber = typeof eta === 'number';
  const name = isNumber ? substance(eta) : typeof eta === 'string' ? eta : (pageOf(eta) ?? 'as its index says');
  const endless = last.id === id && isNumber && eta !== state.exterior ? ', without an end' : '';
  return html`<p class="below">below: ${name}${isNumber ? ` ${shown(eta)}` : nothing}${endless}</p>`;
}

const LIQUID = 1.4; // index, up to which clear things are liquids

const substance = (eta) => (eta === 1 ? 'air' : eta < LIQUID ? 'liquid' : 'glass');

function kindOf({ store, session }, layer) {
  if (layer.kind === 'medium')
    return html`<span class="kind">${capital(session.layers[layer.kind].title)}</span>`;
  const fresh = Object.fromEntries(Object.entries(session.layers).map(([kind, { fresh }]) => [kind, fresh]));
  const choose = (variant) => store.run(setVariant, layer.id, variant, session.names, fresh);
  const options = enabled(store.get()).at(-1) === layer ? BASES : VARIANTS;
  return menu({ label: 'Kind of layer', value: variantOf(layer), options, choose });
}

function remove(panel, layer, index) {
  panel.store.run(removeLayer, layer.id);
  const next = panel.store.get().layers[Math.min(index, panel.store.get().layers.length - 1)];
  panel.focus(next ? `[data-layer="${next.id}"] .grip` : '[data-add]');
}

// Moving ---------------------------------------------------------------------------------------------

const moving = (panel, layer) => ({
  over(index) {
    panel.dropAt = index;
    panel.update();
  },
  move(index) {
    panel.store.run(moveLayer, layer.id, index);
    panel.focus(`[data-layer="${layer.id}"] .grip`);
  },
});
