// The whole page: toolbar, picture and inspector, and the panel beside them.

import { html, nothing } from 'lit-html';
import { repeat } from 'lit-html/directives/repeat.js';
import { LARGEST_DIFFERENCE } from '../render/glsl/display.glsl.js';
import { tiling } from '../render/tiles.js';
import { setView, takeAway } from '../state/commands.js';
import { besideOf } from '../state/compared.js';
import { lookOf } from '../state/snapshots.js';
import { iconButton, styles } from './controls.js';
import { splitter } from './splitter.js';
import { titleOf } from './strip.js';

/**
 * The whole page: `view()`, and `show(face)`, which turns the panel to the layers or to their appearance.
 *
 * @param {object} parts views `toolbar`, `choice`, `layers`, `strip`, `aim`, `view` and `model` of what is in it, its `canvas`, and what it works on;
 *   `onFace()` is called after the panel has turned
 */
export function createPage({ store, session, layout, arrange, edits, messages, picture, canvas, focus, update, lacks, onFace, ...parts }) {
  let face = 'layers'; // of the panel

  function show(name) {
    face = name;
    update();
    onFace();
  }

  const view = () => html`
    ${parts.toolbar()}
    <main class="stage" .style=${styles({ '--look': pixels(layout.lookHeight) })}>
      <div class="picture">
        ${canvas} ${parts.aim()} ${compared({ store, session, edits, picture })}
        <span class="samples" aria-hidden="true"></span>
        ${formOf(picture.shader('a'))}
        ${bubbles(messages)}
      </div>
      <details
        class="history"
        ?open=${layout.history}
        @toggle=${({ target }) => target.open !== layout.history && arrange({ history: target.open })}
      >
        <summary>History</summary>
        ${parts.strip()}
      </details>
      ${
        layout.look
          ? splitter({
              label: 'Height of the plots',
              size: layout.lookHeight ?? LOOK,
              part: (border) => border.nextElementSibling,
              resize: (size) => arrange({ lookHeight: size && Math.max(size, SMALLEST) }),
            })
          : nothing
      }
      <details
        class="look"
        ?open=${layout.look}
        @toggle=${({ target }) => target.open !== layout.look && arrange({ look: target.open })}
      >
        <summary>Look inside</summary>
        <div class="inspector-slot"></div>
      </details>
    </main>
    ${splitter({
      label: 'Width of the panel',
      size: layout.panelWidth ?? PANEL,
      across: true,
      part: (border) => border.nextElementSibling,
      resize: (size) => arrange({ panelWidth: size && Math.max(size, NARROWEST) }),
    })}
    <aside
      class="panel"
      aria-label="Material and view"
      .style=${styles({ '--panel': pixels(layout.panelWidth) })}
    >
      ${faces({ face, show, focus, lacks })}
      <div class="material">
      <div
        id="face-layers"
        role="tabpanel"
        class="section"
        aria-labelledby="tab-layers"
        ?hidden=${face !== 'layers'}
      >
        ${parts.layers()}
      </div>
      <div
        id="face-appearance"
        role="tabpanel"
        class="appearance-slot"
        aria-labelledby="tab-appearance"
        ?hidden=${face !== 'appearance'}
      ></div>
      </div>
      ${section('View', 'view', parts.view())} ${section('Model', 'model', parts.model())}
    </aside>
    ${parts.choice()}
  `;

  function section(title, key, content) {
    return html`<details
      class="section"
      ?open=${layout[key]}
      @toggle=${({ target }) => target.open !== layout[key] && arrange({ [key]: target.open })}
    >
      <summary>${title}</summary>
      ${content}
    </details>`;
  }

  return { view, show };
}

const [LOOK, PANEL] = [384, 352]; // where no hand has been
const SMALLEST = 120;
const NARROWEST = 280;

const CLOSED_FORM =
  'The model is not solved here, but added up in closed form. Over the presets the two pictures differ by 0.03 in the median (root mean square, white being 1), and by more where media scatter.';

const INTERPOLATED =
  'Between solutions of the model that are stored: over the presets, 1.6 % of the light is elsewhere than in the whole solution where one value has changed, and 1.8 % where two have, by little.';

const pixels = (size) => (size ? `${size}px` : '');

const FACES = [
  ['layers', 'Layers'],
  ['appearance', 'Appearance'],
];

/** Two ways to the material: its layers, or what is seen of them. */
function faces({ face, show, focus, lacks }) {
  const lacksFace = (name) => (name === 'appearance' ? lacks(name) : '');
  const onKey = (event) => {
    if (event.key !== 'ArrowLeft' && event.key !== 'ArrowRight') return;
    event.preventDefault();
    const [other] = FACES.find(([name]) => name !== face);
    if (lacksFace(other)) return;
    show(other);
    focus(`#tab-${other}`);
  };
  return html`<div class="faces" role="tablist" aria-label="The material by" @keydown=${onKey}>
    ${FACES.map(
      ([name, title]) => html`<button
        type="button"
        role="tab"
        id="tab-${name}"
        aria-selected=${name === face}
        aria-controls="face-${name}"
        tabindex=${name === face ? 0 : -1}
        ?disabled=${lacksFace(name)}
        title=${lacksFace(name)}
        @click=${() => show(name)}
      >
        ${title}
      </button>`,
    )}
  </div>`;
}

/** What is drawn where a material is not solved itself. */
function formOf(shader) {
  if (shader?.closed_form) return html`<span class="form" title=${CLOSED_FORM}>closed form</span>`;
  return shader?.interpolated ? html`<span class="form" title=${INTERPOLATED}>interpolated</span>` : nothing;
}

const MESSAGES = 3; // at once

/** What is wrong, the latest last, or was done last, in words. */
function bubbles(messages) {
  const isNew = ({ text }, at, all) => all.findIndex((problem) => problem.text === text) === at;
  const problems = messages.problems.filter(isNew).slice(-MESSAGES);
  return html`<div class="messages" role="status" aria-live="polite">
    ${problems.map(
      ({ about, text, actions }) =>
        html`<p class="problem">
          ${text}
          ${actions.map(({ title, act }) => html`<button type="button" @click=${act}>${title}</button>`)}
          <button type="button" class="quiet" @click=${() => messages.forgive(about)}>Dismiss</button>
        </p>`,
    )}
    ${messages.note ? html`<p>${messages.note}</p>` : nothing}
  </div>`;
}

/** What is compared, by name: materials side by side, two on either side of a line, or the scale of their difference. */
function compared({ store, session, edits, picture }) {
  const { view, model } = store.get();
  if (view.mode === 'tiles') return sideBySide(store, picture);
  const titleOf = (name) => session.models.find((known) => known.name === name).title;
  const a = view.other?.material ? 'A' : titleOf(model);
  const b = view.other?.title ?? titleOf(view.other?.model ?? session.default_model);
  if (view.mode === 'split')
    return html`${divider({ view, edits })}<span class="side left">${a}</span><span class="side right">${b}</span>`;
  return view.mode === 'difference' ? scale({ a, b }) : nothing;
}

/** Names of the materials side by side, each with three dots until it is drawn. */
function sideBySide(store, picture) {
  const all = [{ kept: store.get() }, ...besideOf(store.get())], [columns, rows] = tiling(all.length);
  const isDrawn = ({ slot, kept }) => picture.given(slot) && lookOf(picture.given(slot)) === lookOf(kept);
  const part = (share, parts) => `${(100 * share) / parts}%`;
  const name = (tile, place) => html`<div
    class="tile"
    .style=${styles({
      left: part(place % columns, columns),
      top: part(Math.floor(place / columns), rows),
      'max-width': `calc(${part(1, columns)} - 1.25rem)`,
    })}
  >
    <span title=${titleOf(tile)}>${titleOf(tile)}${tile.slot && !isDrawn(tile) ? ' \u2026' : nothing}</span>
    ${
      tile.slot
        ? iconButton({ label: `Take ${titleOf(tile)} away`, icon: 'remove', act: () => store.run(takeAway, tile.slot) })
        : nothing
    }
  </div>`;
  return repeat(all, ({ slot }) => slot, name);
}

function scale({ a, b }) {
  return html`<div class="scale" title="Difference in luminance, exposed as the picture is">
    <span>${b} darker</span>
    <span class="ramp" aria-hidden="true"
      ><i>−${LARGEST_DIFFERENCE}</i><i>0</i><i>+${LARGEST_DIFFERENCE}</i></span
    >
    <span>brighter than ${a}</span>
    <span class="measure" role="status"></span>
  </div>`;
}

/** The line between two models, which can be dragged, and moved by keys. */
function divider({ view, edits }) {
  const move = (split) => edits.drag('split', setView, { split: Math.max(0, Math.min(1, split)) });
  const onKey = (event) => {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
    if (!step) return;
    event.preventDefault();
    move(view.split + step);
    edits.settle();
  };
  const byHand = (event) => {
    if (!event.buttons) return;
    const box = event.currentTarget.parentElement.getBoundingClientRect();
    move((event.clientX - box.left) / box.width);
  };
  return html`
    <div
      class="divider"
      role="slider"
      tabindex="0"
      aria-label="Where the picture is split"
      aria-valuemin="0"
      aria-valuemax="100"
      aria-valuenow=${Math.round(100 * view.split)}
      .style=${styles({ left: `${100 * view.split}%` })}
      @keydown=${onKey}
      @pointerdown=${(event) => event.currentTarget.setPointerCapture(event.pointerId)}
      @pointermove=${byHand}
      @pointerup=${edits.settle}
    ></div>
  `;
}
