// The parts of a mixture: above the layers of the chosen one, each with its share of the surface.

import { html, nothing } from 'lit-html';
import { repeat } from 'lit-html/directives/repeat.js';
import { stacksOf, treeOf } from '../state/material.js';
import {
  chooseCovering,
  choosePart,
  coveringName,
  duplicatePart,
  mostOf,
  movePart,
  nodeCovering,
  objectionTo,
  partName,
  removePart,
  renamePart,
  setCovers,
  setWeight,
  sharesOf,
} from '../state/parts.js';
import { iconButton, menu, shown } from './controls.js';
import { grip } from './moving.js';
import { row } from './parameter.js';
import { text } from './typing.js';

/** The list of parts, and a button that mixes the material with another one. */
export function parts(panel) {
  const { store, mix, lacks } = panel, tree = treeOf(store.get());
  const refused = lacks('mix');
  return html`<section class="mixture" aria-label="Parts of the mixture">
    ${tree ? list(panel, tree) : nothing}
    <div class="actions">
      <button type="button" ?disabled=${refused} title=${refused || 'On a share of the surface, side by side'} @click=${mix}>
        ${tree ? 'Add a part …' : 'Mix with …'}
      </button>
    </div>
  </section>`;
}

const list = (panel, siblings) => html`<ol class="parts">
  ${repeat(
    siblings,
    ({ id }) => id,
    (node, index) => card(panel, siblings, node, index),
  )}
</ol>`;

/** A part, and the parts of one that is a mixture itself. */
function card(panel, siblings, node, index) {
  const { store, focus } = panel, { part } = store.get();
  const name = partName(node, index), isChosen = node.id === part;
  const move = (to) => {
    const place = Math.max(0, Math.min(siblings.length - 1, to)), wrong = objectionTo(siblings, node.id, place);
    if (wrong) return panel.messages.complain(`part.${node.id}`, wrong, { passing: true });
    store.run(movePart, node.id, place);
    return focus(`[data-part="${node.id}"] > .head .grip`);
  };
  const remove = () => {
    store.run(removePart, node.id);
    focus('.mixture [aria-pressed="true"], .mixture .actions button');
  };
  return html`<li class="part ${isChosen ? 'chosen' : ''}" data-part=${node.id} aria-label=${`Part ${index}: ${name}`}>
    <div class="head">
      ${grip({ name, place: index, items: ':scope > .part', move })}
      <b class="place" title="Its number in messages">${index}</b>
      ${
        isChosen || node.parts
          ? html`<input
              type="text"
              aria-label=${`Name of part ${index}`}
              placeholder=${name}
              spellcheck="false"
              .value=${text(node.name)}
              @change=${({ target }) => store.run(renamePart, node.id, target.value)}
            />`
          : html`<button
              type="button"
              class="name"
              title="Show its layers"
              @click=${() => store.aside(choosePart, node.id)}
            >
              ${name}
            </button>`
      }
      <span class="buttons">
        ${iconButton({ label: `Duplicate ${name}`, icon: 'duplicate', act: () => store.run(duplicatePart, node.id) })}
        ${iconButton({ label: `Remove ${name}`, icon: 'remove', act: remove, disabled: siblings.length < 2 })}
      </span>
    </div>
    ${node.weight === null ? rest(siblings) : weight(panel, siblings, node, name)}
    ${covers(panel, node, name)}
    ${node.parts ? list(panel, node.parts) : nothing}
  </li>`;
}

/** The share of a part: a number up to what the others leave, or a mask. */
function weight(panel, siblings, node, name) {
  const spec = panel.session.schema.part.weight, high = mostOf(siblings, node.id);
  return row(panel, {
    layer: { id: `part${node.id}`, kind: 'part', keys: { weight: node.weight } },
    key: 'weight',
    label: name,
    value: node.weight,
    spec: { ...spec, high },
    act: (next) => [setWeight, node.id, next],
    span: [0, 1],
    plain: Math.min(0.5, high),
  });
}

/** The part of the object that a part of the mixture has the whole of. */
function covers({ store, viewport }, { id, covers: chosen, weight }, name) {
  const { names } = viewport, isTop = treeOf(store.get()).some((node) => node.id === id);
  if (!chosen && (!isTop || weight === null || names.length < 2)) return nothing;
  const known = names.includes(chosen) || !chosen ? names : [...names, chosen];
  const options = [['', 'Its share of all'], ...known.map((one) => [one, names.includes(one) ? one : `${one} (not of this object)`])];
  const choose = (one) => store.run(setCovers, id, one);
  return html`<div class="parameter">
    <span class="name">Covers</span><span class="extras"></span>
    <div class="control">${menu({ label: `What ${name} covers`, value: chosen, options, choose })}</div>
  </div>`;
}

/** The parts of the object, each with the material that covers it; a button gives it another one. */
export function objectParts({ store, viewport, give, lacks }) {
  const { names } = viewport, state = store.get();
  if (names.length < 2) return nothing;
  const part = (name) => {
    const node = nodeCovering(state, name);
    const isChosen = node && stacksOf([node]).some(({ id }) => id === state.part);
    return html`<li>
      <button type="button" class="name" aria-pressed=${Boolean(isChosen)} ?disabled=${!node} title="Show its layers" @click=${() => store.aside(chooseCovering, name)}>
        ${name}
      </button>
      <span>${coveringName(state, name)}</span>
      <button type="button" aria-label=${`Material of ${name}`} ?disabled=${lacks('mix')} title=${lacks('mix') || `Choose what ${name} is made of`} @click=${() => give(name)}>
        Material …
      </button>
    </li>`;
  };
  return html`<section class="object-parts" aria-label="Parts of the object">
    <h2>Parts of the object</h2>
    <ul>${names.map(part)}</ul>
  </section>`;
}

/** The share of the last part. */
function rest(siblings) {
  const share = sharesOf(siblings).at(-1);
  const words = typeof share === 'number' ? shown(share) : 'what masks leave';
  return html`<div class="parameter rest" title="The last part covers what the others leave">
    <span class="name">Share</span><span class="extras"></span><span class="control">${words}, the rest</span>
  </div>`;
}
