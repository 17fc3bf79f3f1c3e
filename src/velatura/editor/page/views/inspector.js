// Look inside: the lobes of the material as plots, and the papers' validations.

import { html, nothing, render } from 'lit-html';
import { Slices, radians } from '../render/slices.js';
import { setView } from '../state/commands.js';
import { isOfMaterials } from '../state/compared.js';
import { chosenOf, chosenPart, enabled, layerName } from '../state/material.js';
import './inspector.css';
import { chart, valueAt } from './plots/chart.js';
import { SIZE, colourAt, disc, outline } from './plots/disc.js';
import { polar } from './plots/polar.js';
import { isGrey, lookOf, nearest, shown, shownColour } from './plots/scale.js';
import { createValidations } from './validations/validations.js';

const TABS = [
  { name: 'polar', title: 'Polar' },
  { name: 'disc', title: 'Disc' },
  { name: 'energy', title: 'Energy' },
  { name: 'blur', title: 'Blur' },
  { name: 'validations', title: 'Validations' },
];
const INTERVAL = 30; // milliseconds between looks for changes
const PAUSE = 200; // milliseconds after a preview, in which nothing may change before plots are made
const CHANNELS = ['red', 'green', 'blue'];

/**
 * Shows the inspector in an element; it follows the store and what the viewport draws.
 *
 * @param {HTMLElement} element
 * @param {{store, session, viewport, call, lacks, picture, onLobes}} services `onLobes(f)` calls f(slot) after its lobes have changed
 * @returns {{destroy: function}}
 */
export function mountInspector(element, { store, session, viewport, call, lacks, picture, onLobes }) {
  let local = { tab: 'polar', angle: 45, azimuth: 0, below: false, logarithmic: true, cursors: {} };
  const slices = {}; // by slot
  const making = {}; // whether slices are on their way, by slot
  const changed = { a: true, b: true };
  let problem = '';
  let stale = true;
  let timer = setTimeout(follow);
  const validations = createValidations({ call, store, session }, paint);
  const stops = [store.subscribe(paint), onLobes((name) => name in changed && (changed[name] = true))];

  const set = (changes) => {
    const aimed = ['angle', 'azimuth', 'below'].some((key) => key in changes);
    if (aimed) Object.assign(changed, { a: true, b: true });
    local = { ...local, ...(aimed && { cursors: {} }), ...changes };
    paint();
  };
  const setCursor = (place) => set({ cursors: { ...local.cursors, [local.tab]: place } });
  const overAngle = (what, quantity, lines, cursor) =>
    chart({
      label: `${what}, over the angle of incidence`,
      x: { label: 'angle of incidence (°)', low: 0, high: 90 },
      y: { label: quantity, low: 0, high: null },
      lines,
      cursor,
      onCursor: setCursor,
    });
  const isCompared = () => isOfMaterials(store.get().view);
  /** The number of a lobe among those of all parts. */
  const numberOf = ({ shader, stack }, k) =>
    shader.parts.slice(0, shader.parts.indexOf(stack)).flatMap(({ shown }) => shown).length + k;
  const showAlone = (k) => {
    const number = numberOf(slices.a, k);
    store.run(setView, { lobe: store.get().view.lobe === number ? null : number });
  };

  /** Draws changes while it is visible. Not in every frame: a page that asks for frames is composed in each of them. */
  function follow() {
    timer = setTimeout(follow, INTERVAL);
    if (!element.checkVisibility()) return;
    if (local.tab !== 'validations') slice();
    if (stale) render(page(), element);
    stale = false;
  }

  /** New slices, if the picture or the direction of the light has changed. */
  function slice() {
    for (const name of Object.keys(changed)) {
      const slot = viewport.slots[name];
      changed[name] ||= slices[name] && (slices[name].slot !== slot || isOfAnother(name)); // of a device that was lost, or part
      if (name === 'b' && !isCompared()) {
        replace(name, undefined);
        changed[name] = true;
      } else if (changed[name] && slot.shader && !making[name] && isTime()) {
        changed[name] = false;
        make(name, slot);
      }
    }
  }

  const isOfAnother = (name) => slices[name].stack !== slices[name].shader.parts[chosenOf(picture.given(name))];

  /** Plots come after pictures; while something is dragged they follow. */
  const isTime = () => !viewport.lost && (viewport.held || (viewport.rested(PAUSE) && picture.quiet));

  async function make(name, slot) {
    making[name] = true;
    const state = picture.given(name);
    try {
      const made = await new Slices(slot, local, state, chosenOf(state)).ready();
      if (viewport.lost || slot !== viewport.slots[name]) changed[name] = true;
      else replace(name, made);
    } catch (error) {
      problem = error.message;
      paint();
    }
    making[name] = false;
  }

  function replace(name, made) {
    if (slices[name] === made) return;
    if (slices[name]?.slot === viewport.slots[name]) slices[name].dispose();
    slices[name] = made;
    problem = '';
    paint();
  }

  function paint() {
    stale = true;
  }

  const lacksTab = (name) => (name === 'validations' ? lacks(name) : '');
  const page = () => html`<section class="inspector" aria-label="Look inside">
    <div class="tabs" role="tablist" @keydown=${step}>
      ${TABS.map(
        ({ name, title }) => html`<button
          role="tab"
          id="inspect-${name}"
          aria-selected=${name === local.tab}
          aria-controls="inspected"
          tabindex=${name === local.tab ? 0 : -1}
          ?disabled=${lacksTab(name)}
          title=${lacksTab(name)}
          @click=${() => set({ tab: name })}
        >
          ${title}
        </button>`,
      )}
    </div>
    <div id="inspected" role="tabpanel" aria-labelledby="inspect-${local.tab}">
      ${local.tab === 'validations' ? validations.view() : plots()}
    </div>
  </section>`;

  /** Arrow keys go from tab to tab. */
  function step(event) {
    const moves = { ArrowLeft: -1, ArrowRight: 1 };
    if (!(event.key in moves)) return;
    const open = TABS.filter(({ name }) => !lacksTab(name));
    const now = open.findIndex(({ name }) => name === local.tab);
    const { name } = open[(now + moves[event.key] + open.length) % open.length];
    set({ tab: name });
    element.querySelector(`#inspect-${name}`).focus();
  }

  function plots() {
    if (problem) return html`<p class="problem" role="alert">${problem}</p>`;
    if (!slices.a) return html`<p class="waiting">The lobes come with the first picture.</p>`;
    const { plot, read } = PLOTS[local.tab]();
    return html`${partOf(slices.a.state)} ${directions()}
      <div class="plot">${plot}</div>
      <div class="readout">${legend(read)}</div>`;
  }

  /** Which part of a mixture is plotted. */
  const partOf = (state) => {
    const part = chosenPart(state);
    if (!part) return nothing;
    return html`<p class="waiting">The plots are of the chosen part alone${part.name ? `, ${part.name}` : ''}.</p>`;
  };

  const directions = () => html`<div class="chosen">
    ${slider('Incidence', 'angle', 0, 89)} ${slider('Azimuth', 'azimuth', -180, 180)}
    ${slices.a.stack.transmitted
      ? html`<label><input type="checkbox" .checked=${local.below} @change=${(event) => set({ below: event.target.checked })} />
          from below</label>`
      : nothing}
    ${local.tab === 'polar'
      ? html`<label
          ><input
            type="checkbox"
            .checked=${local.logarithmic}
            @change=${(event) => set({ logarithmic: event.target.checked })}
          />
          logarithmic</label
        >`
      : nothing}
  </div>`;

  const slider = (title, key, low, high) => html`<label class="slide">
    <span>${title}</span>
    <input
      type="range"
      min=${low}
      max=${high}
      step="1"
      name=${key}
      .value=${String(local[key])}
      @input=${(event) => set({ [key]: Number(event.target.value) })}
    />
    <output>${local[key]}°</output>
  </label>`;

  // The four plots: each a picture, and the numbers at its cursor

  const lobe = () => {
    const { lobe } = store.get().view;
    return lobe === null ? null : lobe - numberOf(slices.a, 0);
  };
  const seen = (k) => lobe() === null || lobe() === k;

  const PLOTS = {
    polar() {
      const { a, b } = slices;
      const slice = a.polar;
      const beyond = a.parts[lobe()]?.kind === 'transmitted' && a.refracted !== null;
      const cursor = local.cursors.polar ?? (beyond ? 180 - a.refracted : a.angle);
      const whole = a.stack.transmitted;
      const other = b?.polar;
      const place = nearest(slice.angles, cursor);
      const side = Math.abs(cursor) > 90 ? 'transmitted, ' : '';
      const angle = Math.abs(cursor) > 90 ? 180 - Math.abs(cursor) : Math.abs(cursor);
      return {
        plot: polar({
          slice,
          other,
          incidence: a,
          whole,
          logarithmic: local.logarithmic,
          seen,
          sum: lobe() === null,
          cursor,
          onCursor: setCursor,
        }),
        read: {
          title: `BSDF × cosine at ${shown(angle)}°${cursor < 0 && side === '' ? ', towards the light' : ''}${side && ' beyond'}`,
          parts: slice.parts.map((values) => values[place]),
          all: slice.all[place],
          other: other && { parts: other.parts.map((values) => values[place]), all: other.all[place] },
        },
      };
    },

    disc() {
      const { a, b } = slices;
      const cursor = local.cursors.disc ?? null;
      const sides = a.stack.transmitted ? [true, false] : [true];
      const pictures = sides.map((reflected) => a.disc(SIZE, reflected, lobe()));
      const which = cursor?.reflected === false && pictures.length > 1 ? 1 : 0;
      const parts = cursor && a.parts.map((_, k) => colourAt(a.disc(SIZE, sides[which], k), cursor.point));
      return {
        plot: html`<div class="discs">
          ${sides.map(
            (reflected, i) => html`<figure>
              ${disc({
                label: reflected ? 'Reflected light on the projected disc' : 'Transmitted light on the projected disc',
                pixels: pictures[i],
                outlines: [...outlines(a, reflected, false), ...(b ? outlines(b, reflected, true) : [])],
                mark: markOf(a, reflected),
                cursor: cursor?.reflected === reflected ? cursor.point : null,
                onCursor: (point) => setCursor({ reflected, point }),
              })}
              <figcaption>${reflected ? 'reflected; + mirror direction' : 'transmitted; + refracted direction'}</figcaption>
            </figure>`,
          )}
        </div>`,
        read: {
          title: cursor ? `BSDF × cosine at ${cursor.point.map(shown).join(', ')}` : 'BSDF × cosine: point at a disc',
          parts: parts ?? [],
          all: cursor ? colourAt(a.disc(SIZE, sides[which]), cursor.point) : null,
        },
      };
    },

    energy() {
      const [a, b] = ['a', 'b'].map((name) => slices[name]?.curves());
      const lines = [...energyLines(a, ''), ...(b ? energyLines(b, 'dashed') : [])];
      const cursor = local.cursors.energy ?? local.angle;
      const at = ({ angles, parts }) => {
        const each = parts.map(({ energy }) => colourOf(angles, energy, cursor));
        return { parts: each, all: [0, 1, 2].map((channel) => each.reduce((sum, colour) => sum + colour[channel], 0)) };
      };
      return {
        plot: overAngle('Energy of each lobe and of all', 'energy', lines, cursor),
        read: { title: `Energy at ${shown(cursor)}°`, ...at(a), other: b && at(b), swatches: false },
      };
    },

    blur() {
      const [a, b] = ['a', 'b'].map((name) => slices[name]?.curves());
      const lines = [...blurLines(a, ''), ...(b ? blurLines(b, 'dashed') : [])];
      const cursor = local.cursors.blur ?? local.angle;
      const at = ({ angles, parts }) =>
        parts.map(({ alpha }) => alpha?.map((axis) => valueAt({ x: angles, y: axis }, cursor)) ?? null);
      return {
        plot: overAngle('Roughness of each lobe along both axes', 'alpha', lines, cursor),
        read: { title: `Alpha along u, v at ${shown(cursor)}°`, parts: at(a), all: null, other: b && { parts: at(b), all: null } },
      };
    },
  };

  /** A line for each channel where a lobe is coloured, else one; the sum of all is thicker. */
  function energyLines({ angles, parts }, look) {
    const all = angles.map((_, i) => [0, 1, 2].map((c) => parts.reduce((sum, { energy }) => sum + energy[i][c], 0)));
    const named = parts.map(({ energy }, k) => ({ colours: energy, tag: look ? '' : tagOf(k), look: lookOf(k), k }));
    const sum = lobe() === null && parts.length > 1 ? [{ colours: all, tag: 'Σ', look: 'sum', k: null }] : [];
    return [...sum, ...named.filter(({ k }) => seen(k))].flatMap(({ colours, tag, look: own }) => {
      const end = look ? {} : { tag };
      if (colours.every(isGrey)) return [{ x: angles, y: colours.map(([value]) => value), look: `${own} grey ${look}`, ...end }];
      return CHANNELS.map((channel, c) => ({
        x: angles,
        y: colours.map((colour) => colour[c]),
        look: `${own} ${channel} ${look}`,
        ...(c === 1 && end),
      }));
    });
  }

  function blurLines({ angles, parts }, look) {
    return parts.flatMap(({ alpha }, k) => {
      if (!alpha || !seen(k)) return [];
      const [u, v] = alpha.map((y) => ({ x: angles, y, look: `${lookOf(k)} ${look}` }));
      const tag = look ? {} : { tag: tagOf(k) };
      if (u.y.every((value, i) => Math.abs(value - v.y[i]) < 1e-4)) return [{ ...u, ...tag }];
      return [
        { ...u, ...(!look && { tag: `${tagOf(k)}u` }) },
        { ...v, look: `${v.look} second`, ...(!look && { tag: `${tagOf(k)}v` }) },
      ];
    });
  }

  function outlines(made, reflected, dashed) {
    const azimuth = radians(made.azimuth);
    const angle = reflected ? made.angle : made.refracted;
    if (angle === null) return [];
    const isOutside = (k) => k === 0 || !made.stack.solved; // other solved lobes have the roughness in their medium
    return made
      .chosen()
      .map((part, k) => ({ ...part, k, kind: made.parts[k].kind }))
      .filter(({ k, kind, alpha }) => alpha && seen(k) && isOutside(k) && (kind === 'reflected') === reflected)
      .map((part) => ({ k: part.k, dashed, points: outline(part, Math.sin(radians(angle)), azimuth) }));
  }

  function markOf(made, reflected) {
    const angle = reflected ? made.angle : made.refracted;
    if (angle === null) return null;
    const sine = -Math.sin(radians(angle));
    return [sine * Math.cos(radians(made.azimuth)), sine * Math.sin(radians(made.azimuth))];
  }

  // The legend, which is also the read-out

  const tagOf = (k) => {
    const { kind, layers } = slices.a.parts[k];
    if (kind !== 'reflected') return { base: 'base', remainder: 'rest', transmitted: 'T' }[kind];
    return seenLayers(layers).join('+');
  };

  /** Numbers of the layers that a lobe is of; seen from below, interfaces come the other way round. */
  function seenLayers(layers) {
    if (!slices.a.below) return layers;
    const all = slices.a.parts.flatMap((part) => part.layers);
    return layers.map((layer) => all[all.length - 1 - all.indexOf(layer)]);
  }

  function nameOf(k) {
    const { kind, layers } = slices.a.parts[k];
    if (kind === 'base') return 'diffuse base';
    if (kind === 'remainder') return 'remainder';
    if (kind === 'transmitted') return 'T transmitted';
    const all = enabled(slices.a.state);
    return seenLayers(layers).map((layer) => `${layer} ${described(all[layer], session.layers)}`).join(', ');
  }

  const titleOf = ({ state }) => session.models.find(({ name }) => name === state.model).title;

  function legend({ title, parts, all, other, swatches = true }) {
    const swatch = (look) => (swatches ? html`<span class="swatch ${look}"></span>` : nothing);
    const row = (k, name, look, value, second) => html`<tr class=${k !== null && k === lobe() ? 'alone' : ''}>
      <th scope="row">
        ${k === null
          ? html`${swatch(look)}${name}`
          : html`<button aria-pressed=${k === lobe()} title="Show this lobe alone" @click=${() => showAlone(k)}>
              ${swatch(look)}${name}
            </button>`}
      </th>
      <td>${coloured(value)}</td>
      ${other ? html`<td class="second">${coloured(second)}</td>` : nothing}
    </tr>`;
    return html`<table class="legend">
      <thead>
        <tr>
          <th scope="col">${title}</th>
          ${other ? html`<th scope="col">${titleOf(slices.a)}</th>` : html`<td></td>`}
          ${other ? html`<th scope="col">- - ${titleOf(slices.b)}</th>` : nothing}
        </tr>
      </thead>
      <tbody>
        ${slices.a.parts.map((_, k) => row(k, nameOf(k), lookOf(k), parts[k], other?.parts[k]))}
        ${all ? row(null, 'Σ all together', 'sum', all, other?.all) : nothing}
      </tbody>
    </table>`;
  }

  return {
    destroy() {
      clearTimeout(timer);
      stops.forEach((stop) => stop());
      Object.values(slices).forEach((made) => made?.dispose());
      render(nothing, element);
    },
  };
}

const coloured = (value) => (value ? shownColour(value) : '');

const colourOf = (angles, colours, place) =>
  [0, 1, 2].map((channel) => valueAt({ x: angles, y: colours.map((colour) => colour[channel]) }, place));

/** What an interface is, in few words. */
function described(layer, declared) {
  const name = layerName(layer, declared);
  const { eta } = layer.keys;
  return typeof eta === 'number' ? `${name}, eta ${shown(eta)}` : name;
}
