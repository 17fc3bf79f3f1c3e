// The papers' validations: assumptions of the model compared with the truth, with sliders.

import { html, nothing } from 'lit-html';
import { decode } from '../../arrays.js';
import { enabled, layerName, stackOf } from '../../state/material.js';
import { chart, valueAt } from '../plots/chart.js';
import { SIZE, disc } from '../plots/disc.js';
import { lookOf, shown } from '../plots/scale.js';
import { createPairs } from './pairs.js';

/** The pages; `paint` is called when there is something new to see in `view()`. */
export function createValidations({ call, store, session }, paint) {
  let pages = null;
  let name = null;
  let values = {}; // by page and slider, as they are shown
  let own = {}; // those that were chosen by hand, by page
  let layer = null; // the number of the interface that others are taken from
  let seen = ''; // the material that was asked about
  let answer = null;
  let cursor = null;
  let problem = '';
  let asking = false;
  let again = false;

  // The interfaces of the material

  const interfaces = () =>
    enabled(store.get()).flatMap((one, place) => (one.kind === 'interface' ? [{ ...one, place }] : []));
  const pageNow = () => pages.find((other) => other.name === name);

  /** The interface that is chosen, else the first brushed one, else the first. */
  function place() {
    const all = interfaces();
    const found =
      all.find((one) => one.place === layer) ?? all.find(({ keys }) => Array.isArray(keys.alpha)) ?? all[0];
    return found?.place ?? null;
  }

  /** What is asked of the material, where the page is about one of its interfaces. */
  function question() {
    const { model, switches } = store.get();
    return { name, material: stackOf(store.get()), layer: place(), model, switches };
  }

  const pairs = createPairs({ call, question, paint });

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
    pairs.stop();
    ask();
  }

  function change(key, value) {
    values = { ...values, [name]: { ...values[name], [key]: value } };
    own = { ...own, [name]: { ...own[name], [key]: value } };
    ask();
  }

  /** Takes numbers from an interface, in place of those that were chosen by hand. */
  function take(chosen) {
    layer = chosen;
    own = {};
    ask();
  }

  /** One question at a time; of those that come meanwhile, the last one is asked. */
  async function ask() {
    paint();
    const { of } = pageNow();
    if (of === 'pairs') return;
    again = asking;
    if (asking) return;
    asking = true;
    try {
      const asked = name;
      const taken = of === 'interface' && place() !== null ? question() : { name };
      seen = JSON.stringify(taken);
      const found = await call('validation', { ...taken, parameters: own[name] ?? {} });
      if (asked === name) [answer, values] = [found, { ...values, [name]: found.parameters }];
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
    const page = pageNow();
    if (page?.of === 'interface' && !asking && !problem && seen !== JSON.stringify(question())) queueMicrotask(ask);
    if (!page) return problem ? html`<p class="problem" role="alert">${problem}</p>` : html`<p class="waiting">Asking …</p>`;
    return html`<div class="chosen">
        <label class="choice">
          <span>Validation</span>
          <select @change=${(event) => choose(event.target.value)}>
            ${pages.map((other) => html`<option value=${other.name} ?selected=${other.name === name}>${other.title}</option>`)}
          </select>
        </label>
        <p>${page.doc}</p>
        ${page.of ? interfaceMenu() : nothing}
        ${page.of === 'pairs' ? nothing : Object.entries(page.sliders).map(([key, slider]) => control(key, slider))}
        ${problem ? html`<p class="problem" role="alert">${problem}</p>` : nothing}
      </div>
      ${page.of === 'pairs' ? (place() === null ? nothing : pairs.view()) : answer ? plot(page) : nothing}`;
  }

  const interfaceMenu = () => html`<label class="choice">
    <span>Interface of the material</span>
    <select @change=${({ target }) => take(Number(target.value))}>
      ${interfaces().map(
        (one) => html`<option value=${one.place} ?selected=${one.place === place()}>
          ${one.place} ${layerName(one, session.layers)}
        </option>`,
      )}
    </select>
  </label>`;

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
    if (answer.disc) return onDisc(page);
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

  function onDisc(page) {
    const { picture, outlines } = answer.disc;
    const { angle, azimuth } = values[name];
    const mirror = Math.sin((angle * Math.PI) / 180);
    const lines = outlines.map((outline) => ({ ...outline, look: outline.kind === 'truth' ? 'truth' : lookOf(0) }));
    return html`<div class="plot discs">
        <figure>
          ${disc({
            label: page.title,
            pixels: greys(decode(picture).array),
            outlines: lines.map(({ points, look, kind }) => ({ points, look, dashed: kind === 'model' })),
            mark: turned(azimuth).map((part) => -mirror * part),
            cursor: null,
            onCursor() {},
          })}
          <figcaption>reflected; + mirror direction</figcaption>
        </figure>
      </div>
      <div class="readout">
        <p class="says" aria-live="polite">${answer.says}</p>
        <table class="legend on-disc">
          <tbody>
            ${lines.map(
              ({ look, label }) => html`<tr>
                <th scope="row"><span class="swatch ${look}"></span>${label}</th>
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

const turned = (degrees) => [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];

/** A picture of numbers as one of colours. */
function greys(values) {
  const found = new Float32Array(4 * SIZE * SIZE);
  values.forEach((value, at) => found.set([value, value, value, 1], 4 * at));
  return found;
}
