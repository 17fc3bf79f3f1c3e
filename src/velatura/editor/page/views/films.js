// The thin films of an interface: from the top down, each with its index, its thickness, and the colours that it may make.

import { html, nothing } from 'lit-html';
import { addFilm, moveFilm, numberOf, removeFilm, setFilm } from '../state/commands.js';
import { stackOf } from '../state/material.js';
import { hex } from './colour.js';
import { iconButton, styles } from './controls.js';
import { grip } from './moving.js';

const FRESH = { eta: 2, thickness_nm: 250 }; // of a new film: one that is seen on glass and on metal
const SPANS = [1000, 5000]; // nanometres, where sliders end

/** Where the slider of a thickness ends. */
const spanOf = (thickness) => SPANS.find((end) => thickness <= end) ?? SPANS.at(-1);

/** The films of a layer, and a button for another one; `row` draws a parameter. */
export function films({ services, layer, value, spec, row }) {
  const { store, session } = services, lacks = services.lacks('film');
  const words = 'Add a film below the others';
  const add = () => store.run(addFilm, layer.id, FRESH);
  return {
    control: html`<fieldset class="films" ?disabled=${lacks} title=${lacks || nothing}>
      ${value.length ? nothing : html`<span class="none">none</span>`}
      <ol>
        ${value.map((film, n) => card({ services, layer, value, film, n, row, spec: session.schema.film }))}
      </ol>
    </fieldset>`,
    extras: iconButton({
      label: words,
      icon: 'plus',
      act: add,
      disabled: Boolean(lacks) || value.length >= spec.most,
      title: lacks || words,
    }),
  };
}

function card({ services, layer, value, film, n, row, spec }) {
  const { store, focus } = services, name = `Film ${n}`;
  const gripAt = (at) => `[data-layer="${layer.id}"] [data-film="${at}"] .grip`;
  const move = (to) => {
    const place = Math.max(0, Math.min(value.length - 1, to));
    store.run(moveFilm, layer.id, n, place);
    focus(gripAt(place));
  };
  const remove = () => {
    store.run(removeFilm, layer.id, n);
    focus(value.length > 1 ? gripAt(Math.min(n, value.length - 2)) : `[data-layer="${layer.id}"] > .head .grip`);
  };
  const seen = { id: `${layer.id}.film${n}`, kind: 'interface', keys: { k: 0, ...film } };
  const part = (key) => {
    const act = (next) => [setFilm, layer.id, n, key, next];
    const own = { layer: seen, key, label: name, value: film[key] ?? spec[key].default };
    const over = key === 'thickness_nm' ? strip({ services, layer, film, n, name, act }) : nothing;
    return row({ ...own, spec: { ...spec[key], texturable: false }, act, owner: layer, span: key === 'thickness_nm' && [0, spanOf(film[key])], step: 1, over });
  };
  return html`<li class="film" data-film=${n} aria-label=${name}>
    <div class="head">
      ${grip({ name: `film ${n}`, place: n, items: '.film', move })}
      <span class="place">${name}</span>
      <span class="buttons">${iconButton({ label: `Remove film ${n}`, icon: 'remove', act: remove })}</span>
    </div>
    ${Object.keys(spec).map(part)}
  </li>`;
}

/** What the interface reflects at the normal over the thickness of a film, the brightest of it as white; a click picks. */
function strip({ services, layer, film, n, name, act }) {
  const { store, strips, edits } = services, state = store.get();
  if (!layer.enabled || typeof film.thickness_nm !== 'number') return nothing;
  const end = spanOf(film.thickness_nm), neutral = setFilm(state, layer.id, n, 'thickness_nm', end);
  const place = `${layer.id}.${n}`;
  const asked = { material: stackOf(neutral), layer: numberOf(state, layer.id), film: n, thickness_nm: end };
  const colours = strips.of(place, asked);
  if (!colours) return nothing;
  const edit = edits.of(`${layer.id}.film${n}.thickness_nm`, act, `layer.${layer.id}`, layer.id);
  const most = Math.max(...colours.flat()) || 1;
  const stops = colours.map((rgb) => hex(rgb.map((c) => c / most)));
  const pick = ({ currentTarget, clientX }) => {
    const { left, width } = currentTarget.getBoundingClientRect();
    edit.move(Math.round(end * Math.max(0, Math.min(1, (clientX - left) / width))));
  };
  return html`<div
    class="colours"
    role="img"
    aria-label=${`${name}: colours at the normal, thickness 0 to ${end} nm`}
    title=${`What is reflected at the normal, from 0 to ${end} nm; the brightest is shown as white. Click to pick`}
    .style=${styles({
      background: `linear-gradient(to right, ${stops.join(', ')})`,
      '--at': film.thickness_nm / end,
    })}
    @pointerdown=${(event) => {
      event.currentTarget.setPointerCapture(event.pointerId);
      pick(event);
    }}
    @pointermove=${(event) => event.buttons && pick(event)}
    @pointerup=${edit.settle}
  ></div>`;
}
