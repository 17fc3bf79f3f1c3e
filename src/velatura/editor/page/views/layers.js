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
  removeLayer,
  rename,
  setExterior,
  setThin,
  setVariant,
} from '../state/commands.js';
import { isBase, layerName, variantOf } from '../state/material.js';
import { capital, flag, iconButton, menu, numberField } from './controls.js';
import { icons } from './icons.js';
import { parameter, parametersOf } from './parameter.js';
import { text } from './typing.js';

const VARIANTS = [
  ['dielectric', 'Dielectric'],
  ['metal', 'Metal by name'],
  ['custom', 'Metal by eta and k'],
  ['mirror', 'Mirror'],
];

/** A view of the layers of the state. */
export function createLayers(services) {
  const panel = { ...services, dropAt: null }; // the place where a card that is dragged would go
  return () => layers(panel);
}

function layers(panel) {
  const state = panel.store.get();
  return html`
    ${top(panel, state)}
    <ol class="layers">
      ${repeat(
        state.layers,
        ({ id }) => id,
        (layer, index) => card(panel, layer, index),
      )}
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

function top({ store, session, edits }, { name, exterior, thin }) {
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
    ${flag({ label: 'Thin', value: thin, title: material.thin.doc, choose: (on) => store.run(setThin, on) })}
  </div>`;
}

// One layer ------------------------------------------------------------------------------------------

function card(panel, layer, index) {
  const { store, session } = panel;
  const name = layerName(layer, session.layers);
  const problem = panel.messages.problemOf(layer.id);
  const number = numberOf(store.get(), layer.id);
  return html`<li
    class="layer ${layer.kind} ${layer.enabled ? '' : 'off'} ${panel.dropAt === index ? 'drop' : ''}"
    data-layer=${layer.id}
    aria-label=${layer.enabled ? `Layer ${number}: ${name}` : `${name}, off`}
  >
    <div class="head">
      <button
        type="button"
        class="small grip"
        title="Drag to move; arrow keys move too"
        aria-label=${`Move ${name}: arrow keys`}
        @keydown=${(event) => moveByKey(panel, event, layer, index)}
        @pointerdown=${(event) => moveByHand(panel, event, layer)}
      >
        ${icons.grip}
      </button>
      <b class="place" title="Its number in plots and messages">${layer.enabled ? number : '–'}</b>
      ${kindOf(panel, layer)}
      <span class="buttons">
        <input
          type="checkbox"
          title="On or off"
          aria-label=${`${name} is on`}
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
        ${iconButton({ label: `Remove ${name}`, icon: 'remove', act: () => remove(panel, layer, index) })}
      </span>
    </div>
    ${problem ? html`<p class="problem">${problem}</p>` : nothing}
    <div class="parameters" ?hidden=${!layer.enabled}>
      ${repeat(
        parametersOf(layer, session.schema),
        (key) => key,
        (key) => parameter(panel, layer, key),
      )}
    </div>
  </li>`;
}

function kindOf({ store, session }, layer) {
  if (layer.kind !== 'interface')
    return html`<span class="kind">${capital(session.layers[layer.kind].title)}</span>`;
  const choose = (variant) => store.run(setVariant, layer.id, variant, session.names);
  return menu({ label: 'Kind of interface', value: variantOf(layer.keys), options: VARIANTS, choose });
}

function remove(panel, layer, index) {
  panel.store.run(removeLayer, layer.id);
  const next = panel.store.get().layers[Math.min(index, panel.store.get().layers.length - 1)];
  panel.focus(next ? `[data-layer="${next.id}"] .grip` : '[data-add]');
}

// Moving ---------------------------------------------------------------------------------------------

function moveByKey(panel, event, layer, index) {
  const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
  if (!step) return;
  event.preventDefault();
  panel.store.run(moveLayer, layer.id, index + step);
  panel.focus(`[data-layer="${layer.id}"] .grip`);
}

/** Follows a pointer over the list and shows where the layer would go; it moves when the pointer is let go. */
function moveByHand(panel, event, layer) {
  if (event.button !== 0) return;
  const grip = event.currentTarget;
  const cards = [...grip.closest('.layers').children];
  const over = ({ clientY }) => {
    const index = cards.findIndex((card) => clientY < card.getBoundingClientRect().bottom);
    return index < 0 ? cards.length - 1 : index;
  };
  const done = new AbortController();
  const on = (name, act) => grip.addEventListener(name, act, { signal: done.signal });
  const end = () => {
    done.abort();
    panel.dropAt = null;
    panel.update();
  };
  grip.setPointerCapture(event.pointerId);
  on('pointermove', (moved) => {
    panel.dropAt = over(moved);
    panel.update();
  });
  on('pointerup', (moved) => {
    end();
    panel.store.run(moveLayer, layer.id, over(moved));
    panel.focus(`[data-layer="${layer.id}"] .grip`);
  });
  on('pointercancel', end);
}
