// The class of the chosen lobe: its map, the member that is taken, and small pictures of others.

import { html, nothing } from 'lit-html';
import { ref } from 'lit-html/directives/ref.js';
import { decode } from '../../arrays.js';
import { setMember } from '../../state/commands.js';
import { pattern, stateOf } from '../../state/material.js';
import { contentsOf } from '../../state/picture.js';
import { number } from '../controls.js';
import { mean, shown } from '../plots/scale.js';
import { line } from '../settings.js';
import { pathOf } from './path.js';
import { deepest, plane } from './plane.js';

const SIZE = 64; // cells of a map along an axis
const IDLE = 700; // milliseconds without a change, after which others are drawn
const SEEN = 16; // samples of the large picture that come first
const SMALL = 96; // pixels of a small picture
const SAMPLES = [8, 48]; // rough ones of all, then better ones
const [TALL, LOW] = [230, 26];
const KINDS = {
  dielectric: 'Dielectric interfaces',
  conductor: 'Conductors',
  'dielectric pair': 'Pairs of dielectric interfaces',
  'pair over a conductor': 'Dielectrics over a conductor',
  'pair over a mirror': 'Dielectrics over a mirror',
};

const CHANNELS = ['red', 'green', 'blue'];
const LEAST = 0.01; // span of a slider

/**
 * @param {{store, session, call, viewport, picture, isQuiet: function}} services
 * @param {{target: function(): ?object, chosen: function(): number, held: function(): boolean, ask: function,
 *   question: function, want: function, letGo: function, paint: function}} panel what the panel around knows and does
 */
export function createClass(services, panel) {
  const { call, viewport } = services;
  let card = null; // the map
  let asked = ''; // what it is of
  let begun = null; // depths from which a step began, so that its end does not depend on the way of the hand
  let problem = '';
  let pictures = []; // of members along the path: {place, tint, material, image, problem}
  let timer = null;

  /** Requests the map if its subject has changed; while it is held, it stays. */
  function follow() {
    const target = panel.target();
    if (!target || panel.held()) return;
    const question = { ...panel.question(), target, lobe: panel.chosen(), size: SIZE };
    const text = JSON.stringify(question);
    if (text === asked) return;
    asked = text;
    clearTimeout(timer);
    read(question, text);
  }

  async function read(question, text) {
    try {
      const answer = await panel.ask('class', question);
      if (!answer || asked !== text) return;
      if (panel.held()) {
        asked = ''; // what has been changed meanwhile is on the map that is here, and not on this one
        return;
      }
      card = decoded(answer);
      problem = '';
      pictures = pathOf(card).map((stop) => ({ ...stop, image: null }));
      clearTimeout(timer);
      timer = setTimeout(() => draw(question, text), IDLE);
    } catch (error) {
      if (asked !== text) return;
      [card, problem] = [null, error.message];
    }
    panel.paint();
  }

  /** Draws the members along the path one after the other, until something else is asked. */
  async function draw(question, text) {
    const drawn = pictures;
    for (const [picture, samples] of SAMPLES.flatMap((samples) => drawn.map((picture) => [picture, samples]))) {
      if (asked !== text || panel.held() || !viewport.budget.samples) return;
      try {
        picture.material ??= (await call('member', { ...question, ...wishOf(picture) })).material;
        if (asked !== text) return;
        picture.image = await small(services, picture.material, samples);
      } catch (error) {
        picture.problem = error.message;
      }
      panel.paint();
    }
  }

  function move(point, map) {
    const place = map ? card.conductor : card;
    place.member = point;
    take(map ? { point, map } : wishOf({ place: point }));
    panel.paint();
  }

  /** Requests another member. The map that shows what this one absorbs comes later than the next wish may. */
  function take(wish) {
    begun ??= card.depths;
    const wished = Object.entries(wish.depths ?? {}).map(([name, value]) => [name, { ...card.depths[name], value }]);
    card.depths = { ...card.depths, ...Object.fromEntries(wished) };
    const body = { target: panel.target(), lobe: panel.chosen(), ...wish };
    panel.want({ verb: 'member', body, command: setMember });
  }

  function letGo() {
    begun = null;
    panel.letGo();
  }

  /** What a medium absorbs, where a step began. */
  const depthOf = (name) => (begun ?? card.depths)[name].value;

  /** What `member` takes for a place on the map, or for a tint: above a conductor the second axis is a depth. */
  function wishOf({ place, tint }) {
    if (tint !== undefined) return { point: [...card.point.slice(0, -1), tint] };
    if (card.kind !== 'pair over a conductor') return { point: place };
    return { point: [place[0], card.point[1]], depths: { tau_1: alike(depthOf('tau_1'), place[1]) } };
  }

  function deepen(name, value) {
    take({ depths: { [name]: value } });
    panel.paint();
  }

  const drawn = (one, map) =>
    plane({
      label: map ? 'Metals of the class, eta against k' : `Class of lobe ${panel.chosen() + 1}`,
      axes: one.axes,
      cells: one.cells,
      outlines: one.outlines,
      point: one.member,
      dots: one.members,
      path: map ? [] : pictures.flatMap(({ place }) => (place ? [place] : [])),
      height: one.axes.length > 1 ? TALL : LOW,
      onMove: (point) => move(point, map),
      onLetGo: letGo,
    });

  function view() {
    if (problem) return html`<p class="problem">${problem}</p>`;
    if (!card) return html`<p class="faint">The map is on its way.</p>`;
    if (card.kind === 'mirror') return html`<p class="faint">Nothing is free of a mirror but its roughness.</p>`;
    if (alone(card) && !Object.keys(card.depths).length)
      return html`<p class="faint">
        Only one index does it: ${card.member.map(shown).join(' + ')}${card.kind === 'conductor' ? 'i' : ''}. With two
        interfaces there is a choice.
      </p>`;
    return html`
      <p class="faint">${KINDS[card.kind]} that look the same head-on: drag the point.</p>
      ${drawn(card)} ${card.cells ? legend(card) : nothing} ${card.conductor ? drawn(card.conductor, 'conductor') : nothing}
      ${Object.entries(card.depths).map(([name, depth]) => depths(name, depth))}
      ${pictures.length ? strip() : nothing}
    `;
  }

  /** Sliders for what a medium absorbs: in all channels by as much, and in each. */
  function depths(name, { value, low, high }) {
    const title = name === 'tau_1' ? 'Absorption of the coat' : 'Absorption above';
    const slider = (channel, now, most, changed) => {
      const move = (number) => deepen(name, changed(number));
      const edit = {
        move,
        set(number) {
          move(number);
          letGo();
        },
        settle: letGo,
        refuse: (words) => services.messages.complain('appearance', words, { passing: true }),
      };
      const label = `${title}, ${channel}`;
      const spec = { low: 0, high: Math.max(most, LEAST), strict: false };
      return line(channel, number({ label, value: Number(now.toPrecision(3)), spec, edit }));
    };
    const within = (number, index) => Math.min(Math.max(number, low[index]), high[index]);
    return html`<p class="faint">${title}, optical depth at normal incidence:</p>
      ${slider('all', mean(value), Math.min(...high), (number) => alike(depthOf(name), number).map(within))}
      ${CHANNELS.map((channel, index) =>
        slider(channel, value[index], high[index], (number) => value.map((old, n) => (n === index ? number : old))),
      )}`;
  }

  const strip = () => html`<div class="members" role="group" aria-label="Members along a path through the class">
    ${pictures.map(
      ({ image, problem, ...stop }, index) => html`<button
        type="button"
        title=${problem ?? titleOf(stop)}
        aria-label="Take member ${index + 1} of the path"
        @click=${() => {
          take(wishOf(stop));
          letGo();
        }}
      >
        <canvas
          width=${SMALL}
          height=${SMALL}
          ${ref((canvas) => canvas && image && canvas.getContext('2d').putImageData(image, 0, 0))}
        ></canvas>
      </button>`,
    )}
  </div>`;

  /** A place by the names of the axes, or a tint. */
  const titleOf = ({ place, tint }) =>
    place ? place.map((value, axis) => `${card.axes[axis].label} ${shown(value)}`).join(', ') : `tint ${shown(tint)}`;

  return { follow, view, stop: () => clearTimeout(timer) };
}

/** Optical depths with another mean, their differences kept as far as none is negative. */
const alike = (value, wanted) => value.map((one) => Math.max(one + wanted - mean(value), 0));

/** Whether a class has one member only, but for what absorbs. */
const alone = ({ kind, axes, cells }) =>
  kind === 'dielectric' ? !cells.feasible.some(Boolean) : kind === 'conductor' && axes.every(isPoint);

const isPoint = ({ low, high }) => high - low < 0.001 * high;

function legend({ cells }) {
  const most = deepest(cells.feasible, cells.absorption);
  return html`<p class="legend">
    <span class="shade ${most ? '' : 'flat'}"></span> ${most ? `absorption 0 to ${shown(most)}` : 'no absorption needed'}
    <span class="hatched"></span> none
    <span title="Where each channel, and all of them, begin to have members">
      <span class="channels"><i class="r"></i><i class="g"></i><i class="b"></i></span> limits
    </span>
  </p>`;
}

function decoded(answer) {
  const one = ({ feasible, absorption, ...rest }) => ({
    ...rest,
    cells: feasible && {
      feasible: decode(feasible).array,
      absorption: decode(absorption).array,
      shape: feasible.shape,
    },
  });
  return { ...one(answer), conductor: answer.conductor ? one(answer.conductor) : null };
}

/** A small picture of another material on the same object, from where the camera is; after the large one. */
async function small({ store, session, call, viewport, picture, isQuiet }, material, samples) {
  const enough = () => viewport.samples >= Math.min(SEEN, viewport.budget.samples);
  while (!isQuiet() || !enough()) await new Promise((resolve) => setTimeout(resolve, IDLE));
  const state = { ...store.get(), ...stateOf(material) };
  const { model, switches } = state;
  const known = picture.shader('a');
  const question = { material, model, switches };
  const shader = known && pattern(state) === pattern(store.get()) ? known : await call('shader', question);
  const solved = shader === known && shader.solution && (await call('values', question));
  return viewport.thumbnail(shader, solved || contentsOf(shader, state, session), SMALL, samples);
}
