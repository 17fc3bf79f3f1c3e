// The whole page: toolbar, picture and inspector, and the panel beside them.

import { html, nothing } from 'lit-html';
import { styleMap } from 'lit-html/directives/style-map.js';
import { setView } from '../state/commands.js';
import { layers } from './layers.js';
import { model, view } from './settings.js';
import { toolbar } from './toolbar.js';

export function page(app) {
  return html`
    ${toolbar(app)}
    <main class="stage">
      <div class="picture">
        <canvas
          aria-label="The material on an object; arrow keys turn it, plus and minus come closer"
          role="img"
        ></canvas>
        ${divider(app)}
        <span class="samples" aria-hidden="true"></span>
        ${messages(app)}
      </div>
      <details class="look" open>
        <summary>Look inside</summary>
        <div class="inspector-slot"></div>
      </details>
    </main>
    <aside class="panel" aria-label="Material and view">
      ${faces(app)}
      <div
        id="face-layers"
        role="tabpanel"
        class="section"
        aria-labelledby="tab-layers"
        ?hidden=${app.face !== 'layers'}
      >
        ${layers(app)}
      </div>
      <div
        id="face-appearance"
        role="tabpanel"
        class="appearance-slot"
        aria-labelledby="tab-appearance"
        ?hidden=${app.face !== 'appearance'}
      ></div>
      ${section('View', view(app))} ${section('Model', model(app))}
    </aside>
  `;
}

const FACES = [
  ['layers', 'Layers'],
  ['appearance', 'Appearance'],
];

/** Two ways to the material: its layers, or what is seen of them. */
function faces(app) {
  const onKey = (event) => {
    if (event.key !== 'ArrowLeft' && event.key !== 'ArrowRight') return;
    event.preventDefault();
    const [other] = FACES.find(([name]) => name !== app.face);
    app.show(other);
    app.focus(`#tab-${other}`);
  };
  return html`<div class="faces" role="tablist" aria-label="The material by" @keydown=${onKey}>
    ${FACES.map(
      ([name, title]) => html`<button
        type="button"
        role="tab"
        id="tab-${name}"
        aria-selected=${name === app.face}
        aria-controls="face-${name}"
        tabindex=${name === app.face ? 0 : -1}
        @click=${() => app.show(name)}
      >
        ${title}
      </button>`,
    )}
  </div>`;
}

function section(title, content) {
  return html`<details class="section" open>
    <summary>${title}</summary>
    ${content}
  </details>`;
}

const MESSAGES = 3; // at once

/** What is wrong, the latest last, or was done last, in words. */
function messages(app) {
  const isNew = ({ text }, at, all) => all.findIndex((problem) => problem.text === text) === at;
  const problems = app.problems.filter(isNew).slice(-MESSAGES);
  return html`<div class="messages" role="status" aria-live="polite">
    ${problems.map(
      ({ about, text, actions }) =>
        html`<p class="problem">
          ${text}
          ${actions.map(({ title, act }) => html`<button type="button" @click=${act}>${title}</button>`)}
          <button type="button" class="quiet" @click=${() => app.forgive(about)}>Dismiss</button>
        </p>`,
    )}
    ${problems.length || !app.note ? nothing : html`<p>${app.note}</p>`}
  </div>`;
}

/** The line between two models, which can be dragged, and moved by keys. */
function divider(app) {
  const { view } = app.store.get();
  if (view.mode !== 'split') return nothing;
  const { models, default_model: standard } = app.session;
  const titleOf = (name) => models.find((known) => known.name === name).title;
  const move = (split) => app.drag('split', setView, { split: Math.max(0, Math.min(1, split)) });
  const onKey = (event) => {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
    if (!step) return;
    event.preventDefault();
    move(view.split + step);
    app.settle();
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
      style=${styleMap({ left: `${100 * view.split}%` })}
      @keydown=${onKey}
      @pointerdown=${(event) => event.currentTarget.setPointerCapture(event.pointerId)}
      @pointermove=${byHand}
      @pointerup=${app.settle}
    ></div>
    <span class="side left">${view.other?.material ? 'A' : titleOf(app.store.get().model)}</span>
    <span class="side right">${view.other?.title ?? titleOf(view.other?.model ?? standard)}</span>
  `;
}
