// The class of the chosen lobe: its map, the member that is taken, and small pictures of others.

import { html, nothing } from 'lit-html';
import { ref } from 'lit-html/directives/ref.js';
import { decode } from '../../arrays.js';
import { setMember } from '../../state/commands.js';
import { layersOf, pattern } from '../../state/material.js';
import { contentsOf } from '../../state/picture.js';
import { shown } from '../plots/scale.js';
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
};

/**
 * @param {{store, session, call, viewport, picture, isQuiet: function}} services
 * @param {{target: function(): ?object, chosen: function(): number, held: function(): boolean, ask: function,
 *   question: function, want: function, letGo: function, paint: function}} panel what the panel around knows and does
 */
export function createClass(services, panel) {
  const { call, viewport } = services;
  let card = null; // the map
  let asked = ''; // what it is of
  let problem = '';
  let pictures = []; // of members along the path: {point, material, image, problem}
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
        picture.material ??= (await call('member', { ...question, point: picture.point })).material;
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
    panel.paint();
    take(point, map);
  }

  function take(point, map) {
    const body = { target: panel.target(), lobe: panel.chosen(), point, ...(map && { map }) };
    panel.want({ verb: 'member', body, command: setMember });
  }

  const drawn = (one, map) =>
    plane({
      label: map ? 'Metals of the class, eta against k' : `Class of lobe ${panel.chosen() + 1}`,
      axes: one.axes,
      cells: one.cells,
      outlines: one.outlines,
      point: one.member,
      dots: one.members,
      path: map ? [] : pictures.map(({ point }) => point).filter((point) => point.length === one.axes.length),
      height: one.axes.length > 1 ? TALL : LOW,
      onMove: (point) => move(point, map),
      onLetGo: panel.letGo,
    });

  function view() {
    if (problem) return html`<p class="problem">${problem}</p>`;
    if (!card) return html`<p class="faint">The map is on its way.</p>`;
    if (alone(card))
      return html`<p class="faint">
        Only one index does it: ${card.member.map(shown).join(' + ')}${card.kind === 'conductor' ? 'i' : ''}. With two
        interfaces there is a choice.
      </p>`;
    return html`
      <p class="faint">${KINDS[card.kind]} that look the same head-on: drag the point.</p>
      ${drawn(card)} ${card.cells ? legend(card) : nothing} ${card.conductor ? drawn(card.conductor, 'conductor') : nothing}
      ${pictures.length ? strip() : nothing}
    `;
  }

  const strip = () => html`<div class="members" role="group" aria-label="Members along a path through the class">
    ${pictures.map(
      ({ point, image, problem }, index) => html`<button
        type="button"
        title=${problem ?? titleOf(point)}
        aria-label="Take member ${index + 1} of the path"
        @click=${() => {
          take(point);
          panel.letGo();
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

  /** A point by the names of its axes; outside the map it is a tint. */
  const titleOf = (point) => {
    const onMap = point.length === card.axes.length && card.kind !== 'conductor';
    return point.map((value, axis) => `${onMap ? card.axes[axis].label : 'tint'} ${shown(value)}`).join(', ');
  };

  return { follow, view, stop: () => clearTimeout(timer) };
}

/** Whether a class has one member only. */
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
  const state = { ...store.get(), layers: layersOf(material) };
  const { model, switches } = state;
  const known = picture.shader('a');
  const question = { material, model, switches };
  const shader = known && pattern(state) === pattern(store.get()) ? known : await call('shader', question);
  const solved = shader === known && shader.solution && (await call('values', question));
  return viewport.thumbnail(shader, solved || contentsOf(shader, state, session), SMALL, samples);
}
