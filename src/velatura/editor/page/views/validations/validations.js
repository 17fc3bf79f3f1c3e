// The papers' validations: assumptions of the model compared with the truth, with sliders.

import { html, nothing } from 'lit-html';
import { chart, valueAt } from '../plots/chart.js';
import { lookOf, shown } from '../plots/scale.js';

/** The pages; `paint` is called when there is something new to see in `view()`. */
export function createValidations(call, paint) {
  let pages = null;
  let name = null;
  let values = {}; // by page and slider
  let answer = null;
  let cursor = null;
  let problem = '';
  let asking = false;
  let again = false;

  const failed = (error) => {
    problem = error.message;
    paint();
  };

  function start() {
    pages = [];
    call('validations', {}).then(({ validations }) => {
      pages = validations;
      for (const page of pages) {
        values[page.name] = Object.fromEntries(
          Object.entries(page.sliders).map(([key, slider]) => [key, slider.default]),
        );
      }
      choose(pages[0].name);
    }, failed);
  }

  function choose(chosen) {
    name = chosen;
    answer = null;
    cursor = null;
    ask();
  }

  function change(key, value) {
    values = { ...values, [name]: { ...values[name], [key]: value } };
    ask();
  }

  /** One question at a time; of those that come meanwhile, the last one is asked. */
  async function ask() {
    paint();
    again = asking;
    if (asking) return;
    asking = true;
    try {
      const asked = name;
      const found = await call('validation', { name, parameters: values[name] });
      if (asked === name) answer = found;
      problem = '';
    } catch (error) {
      problem = error.message;
    }
    asking = false;
    if (again) ask();
    else paint();
  }

  function view() {
    if (!pages) start();
    const page = pages.find((other) => other.name === name);
    if (!page) return problem ? html`<p class="problem" role="alert">${problem}</p>` : html`<p class="waiting">Asking …</p>`;
    return html`<div class="chosen">
        <label class="choice">
          <span>Validation</span>
          <select @change=${(event) => choose(event.target.value)}>
            ${pages.map((other) => html`<option value=${other.name} ?selected=${other.name === name}>${other.title}</option>`)}
          </select>
        </label>
        <p>${page.doc}</p>
        ${Object.entries(page.sliders).map(([key, slider]) => control(key, slider))}
        ${problem ? html`<p class="problem" role="alert">${problem}</p>` : nothing}
      </div>
      ${answer ? plot(page) : nothing}`;
  }

  const control = (key, { doc, low, high }) => html`<label class="slide">
    <span>${doc}</span>
    <input
      type="range"
      name=${key}
      min=${low}
      max=${high}
      step=${high - low > 20 ? 1 : 0.01}
      .value=${String(values[name][key])}
      @input=${(event) => change(key, Number(event.target.value))}
    />
    <output>${shown(values[name][key])}</output>
  </label>`;

  function plot(page) {
    const { curves, axes, says } = answer;
    let models = 0;
    const lines = curves.map((curve) => ({ ...curve, look: curve.kind === 'truth' ? 'truth' : lookOf(models++) }));
    const { low, high } = axes.x;
    const onCursor = (place) => {
      cursor = place;
      paint();
    };
    return html`<div class="plot">
        ${chart({ label: page.title, ...axes, lines, cursor, onCursor, step: (high - low) / 50 })}
      </div>
      <div class="readout">
        <p class="says" aria-live="polite">${says}</p>
        <table class="legend">
          <thead>
            <tr>
              <th scope="col">${cursor === null ? 'Point at the chart' : `At ${shown(cursor)}`}</th>
              <td></td>
            </tr>
          </thead>
          <tbody>
            ${lines.map(
              (line) => html`<tr>
                <th scope="row"><span class="swatch ${line.look}"></span>${line.label}</th>
                <td>${cursor === null ? '' : read(line)}</td>
              </tr>`,
            )}
          </tbody>
        </table>
      </div>`;
  }

  function read({ x, y, error }) {
    const value = shown(valueAt({ x, y }, cursor));
    return error ? `${value} ± ${shown(valueAt({ x, y: error }, cursor))}` : value;
  }

  return { view };
}
