// Pairs of roughnesses of one interface of the material: a grid of spheres, half by random walks, half by the model.

import { html, nothing } from 'lit-html';
import { ref } from 'lit-html/directives/ref.js';
import { decode } from '../../arrays.js';
import { shown } from '../plots/scale.js';

const ALPHAS = [0.02, 0.1, 0.3, 0.6];
const PAUSE = 600; // milliseconds without a change, after which the grid is filled anew
const SIDE = 64; // pixels of a picture

/** @param {{call: function, question: function(): object, paint: function}} panel `question` is what is asked of a pair */
export function createPairs({ call, question, paint }) {
  let cells = new Map(); // answers by pair
  let filled = ''; // what the grid is of
  let chosen = null;
  let timer = null;
  let problem = '';

  const textNow = () => JSON.stringify(question());
  const nameOf = (u, v) => `${u} ${v}`;

  /** Fills the grid, one pair at a time, until something else is wanted. */
  async function fill(text) {
    for (const v of ALPHAS) {
      for (const u of ALPHAS) {
        if (text !== filled || text !== textNow()) return;
        try {
          const found = await call('validation', { ...question(), parameters: { alpha_u: u, alpha_v: v } });
          if (text !== filled) return;
          cells.set(nameOf(u, v), found);
          problem = '';
        } catch (error) {
          if (text === filled) problem = error.message;
          return paint();
        }
        paint();
      }
    }
  }

  function view() {
    const text = textNow();
    if (text !== filled) {
      filled = text;
      cells = new Map();
      clearTimeout(timer);
      timer = setTimeout(() => fill(text), PAUSE);
    }
    const cell = cells.get(chosen);
    return html`<div class="plot">
        <table class="roughnesses" aria-label="Pairs of roughnesses: left the random walk, right the model">
          <thead>
            <tr>
              <th scope="col" title="Roughness along y, down; along x, across">v \\ u</th>
              ${ALPHAS.map((u) => html`<th scope="col">${u}</th>`)}
            </tr>
          </thead>
          <tbody>
            ${ALPHAS.map((v) => html`<tr><th scope="row">${v}</th>${ALPHAS.map((u) => picture(u, v))}</tr>`)}
          </tbody>
        </table>
      </div>
      <div class="readout">
        ${problem ? html`<p class="problem" role="alert">${problem}</p>` : nothing}
        <p class="says" aria-live="polite">
          ${cell ? `Alpha ${chosen.replace(' ', ', ')}: ${cell.says}` : `${cells.size} of ${ALPHAS.length ** 2} pairs. Choose one for its difference.`}
        </p>
      </div>`;
  }

  function picture(u, v) {
    const name = nameOf(u, v);
    const cell = cells.get(name);
    const choose = () => {
      chosen = name;
      paint();
    };
    return html`<td>
      <button
        type="button"
        class="pair"
        aria-pressed=${chosen === name}
        aria-label=${`Alpha ${u}, ${v}${cell ? `: difference ${shown(cell.rmse)}` : ''}`}
        @click=${choose}
        @pointerenter=${choose}
      >
        <canvas width=${SIDE} height=${SIDE} ${ref((canvas) => canvas && paintHalves(canvas, cell))}></canvas>
      </button>
    </td>`;
  }

  return {
    view,
    stop() {
      clearTimeout(timer);
      filled = '';
    },
  };
}

/** The left half of the truth, the right half of the model; nothing while there is no answer. */
function paintHalves(canvas, cell) {
  const context = canvas.getContext('2d');
  context.clearRect(0, 0, SIDE, SIDE);
  if (!cell) return;
  const [truth, model] = [cell.pictures.truth, cell.pictures.model].map(decode);
  const image = context.createImageData(SIDE, SIDE);
  for (let at = 0; at < SIDE * SIDE; at++) {
    const { array } = at % SIDE < SIDE / 2 ? truth : model;
    image.data.set([array[3 * at], array[3 * at + 1], array[3 * at + 2], 255], 4 * at);
  }
  context.putImageData(image, 0, 0);
}
