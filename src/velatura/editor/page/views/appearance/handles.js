// All lobes in one plot, blur against energy, each with a handle.

import { nothing, svg, html } from 'lit-html';
import { hex } from '../colour.js';
import { mean, shown } from '../plots/scale.js';
import { DARKEST, axesOf, blurOf, hue } from './looks.js';

const [WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM] = [330, 190, 50, 14, 12, 34];
const RADIUS = 9;
const FLAT = 0.6; // least height of the handle of a brushed lobe, in its width
const GRIP = 4.5; // radius of the handles of its axes
const ZERO = LEFT + RADIUS + 3; // where there is no blur
const BLURS = [0, 0.01, 0.1, 0.2, 0.4, 0.7, 1];
const ENERGIES = [0.001, 0.01, 0.1, 1];
const FLOOR = 5e-4; // where the scale of energies begins
const DECADES = Math.log10(1 / FLOOR);
const STEP = { blur: 0.01, energy: 1.05 };

// Blur by its root, so that sharp lobes have room; energy by its logarithm
const across = (alpha) => ZERO + Math.sqrt(Math.min(alpha, 1)) * (WIDTH - ZERO - RIGHT);
const up = (energy) => TOP + Math.min(1, -Math.log10(Math.max(energy, FLOOR)) / DECADES) * (HEIGHT - TOP - BOTTOM);
const within = (low, value, high) => Math.min(Math.max(value, low), high);
const blurAt = (x) => within(0, (x - ZERO) / (WIDTH - ZERO - RIGHT), 1) ** 2;
const energyAt = (y) => within(DARKEST, 10 ** ((-DECADES * (y - TOP)) / (HEIGHT - TOP - BOTTOM)), 1);

/**
 * @param {object} plot
 * @param {object[]} plot.lobes as they are
 * @param {?object[]} plot.asked as they were asked for, where that could not be had
 * @param {object[]} plot.hand from where keys move them on
 * @param {number} plot.chosen
 * @param {boolean} plot.fixed nothing can be dragged
 * @param {function(number)} plot.onChoose
 * @param {function(number, {blur: ?number, energy: ?number, axis: ?number})} plot.onMove `axis`: whose blur it is, where
 *   not that of both
 * @param {function} plot.onLetGo
 */
export function handles({ lobes, asked, hand, chosen, fixed, onChoose, onMove, onLetGo }) {
  const box = `0 0 ${WIDTH} ${HEIGHT}`;
  return html`<svg class="plot" viewBox=${box} role="group" aria-label="Lobes by blur and energy">
    ${BLURS.map(
      (blur) => svg`<line class="grid" x1=${across(blur)} x2=${across(blur)} y1=${TOP} y2=${HEIGHT - BOTTOM} />
        <text text-anchor="middle" x=${across(blur)} y=${HEIGHT - BOTTOM + 14}>${blur}</text>`,
    )}
    ${ENERGIES.map(
      (energy) => svg`<line class="grid" x1=${LEFT} x2=${WIDTH - RIGHT} y1=${up(energy)} y2=${up(energy)} />
        <text text-anchor="end" x=${LEFT - 5} y=${up(energy) + 4}>${energy}</text>`,
    )}
    <text text-anchor="middle" x=${(LEFT + WIDTH - RIGHT) / 2} y=${HEIGHT - 4}>blur (alpha)</text>
    <text text-anchor="middle" transform="translate(9 ${(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)">energy</text>
    ${asked?.length === lobes.length ? lobes.map((lobe, index) => ghost(lobe, asked[index])) : nothing}
    ${lobes.map((lobe, index) => (Array.isArray(lobe.alpha) ? brushed(lobe, index, { fixed, onChoose, onMove, onLetGo }) : nothing))}
    ${lobes.map((lobe, index) =>
      handle(lobe, index, { from: hand[index], chosen: index === chosen, fixed, onChoose, onMove, onLetGo }),
    )}
  </svg>`;
}

/** A lobe's blur in words: of both axes and their direction where they differ. */
export function described(lobe) {
  const [u, v] = axesOf(lobe).map(shown);
  return u === v ? u : `${u}, ${v} at ${Math.round(lobe.rotation)}°`;
}

/** Where a pointer is on the plot. */
function placeOf({ clientX, clientY, currentTarget }) {
  const box = currentTarget.ownerSVGElement.getBoundingClientRect();
  return [clientX - box.left, clientY - box.top].map((pixels) => (pixels * WIDTH) / box.width);
}

/** A handle: round, or wider across where its lobe is. */
function body(lobe, colour) {
  const [u, v] = axesOf(lobe);
  if (u === v) return svg`<circle r=${RADIUS} fill=${colour} />`;
  const most = Math.max(u, v);
  const [across, along] = [u, v].map((alpha) => RADIUS * Math.max(FLAT, alpha / most) * Math.sqrt(1 / FLAT));
  return svg`<ellipse rx=${across} ry=${along} transform="rotate(${-lobe.rotation})" fill=${colour} />`;
}

/** The blurs of a brushed lobe's axes, joined, each to be dragged along. */
function brushed(lobe, index, { fixed, onChoose, onMove, onLetGo }) {
  const y = up(mean(lobe.energy));
  const grips = lobe.alpha.map((alpha, axis) => {
    const drag = (event) => !fixed && event.buttons && onMove(index, { blur: blurAt(placeOf(event)[0]), axis });
    const begin = (event) => {
      event.currentTarget.setPointerCapture(event.pointerId);
      onChoose(index);
    };
    return svg`<g
      class="grip"
      transform="translate(${across(alpha)} ${y})"
      @pointerdown=${begin}
      @pointermove=${drag}
      @lostpointercapture=${onLetGo}
    >
      <circle r=${GRIP} />
      <text text-anchor="middle" y="15">${'uv'[axis]}</text>
    </g>`;
  });
  const [u, v] = lobe.alpha.map(across);
  return svg`<line class="brush" x1=${u} x2=${v} y1=${y} y2=${y} />${grips}`;
}

/** Where a lobe was asked to be, joined to where it is. */
function ghost(lobe, wish) {
  const [x, y, u, v] = [across(blurOf(lobe)), up(mean(lobe.energy)), across(blurOf(wish)), up(mean(wish.energy))];
  if (Math.hypot(x - u, y - v) < 2) return nothing;
  return svg`<line class="ghost" x1=${x} y1=${y} x2=${u} y2=${v} />
    <circle class="ghost" cx=${u} cy=${v} r=${RADIUS} />`;
}

function handle(lobe, index, { from, chosen, fixed, onChoose, onMove, onLetGo }) {
  const [blur, energy] = [blurOf(lobe), mean(lobe.energy)];
  const colour = hue(lobe);
  const press = (event) => {
    const moves = {
      ArrowLeft: { blur: within(0, blurOf(from) - STEP.blur, 1) },
      ArrowRight: { blur: within(0, blurOf(from) + STEP.blur, 1) },
      ArrowUp: { energy: within(DARKEST, mean(from.energy) * STEP.energy, 1) },
      ArrowDown: { energy: within(DARKEST, mean(from.energy) / STEP.energy, 1) },
    };
    if (fixed || !(event.key in moves)) return;
    event.preventDefault();
    onMove(index, moves[event.key]);
    onLetGo();
  };
  const drag = (event) => {
    if (fixed || !event.buttons) return;
    const [x, y] = placeOf(event);
    onMove(index, { blur: blurAt(x), energy: energyAt(y) });
  };
  const begin = (event) => {
    event.currentTarget.setPointerCapture(event.pointerId);
    onChoose(index);
  };
  return svg`<g
    class="handle ${chosen ? 'chosen' : ''}"
    transform="translate(${across(blur)} ${up(energy)})"
    role="slider"
    tabindex="0"
    aria-label="Lobe ${index + 1}: left and right change its blur, up and down its energy"
    aria-disabled=${fixed}
    aria-valuemin="0"
    aria-valuemax="1"
    aria-valuenow=${blur}
    aria-valuetext="blur ${described(lobe)}, energy ${shown(energy)}"
    @focus=${() => onChoose(index)}
    @pointerdown=${begin}
    @pointermove=${drag}
    @lostpointercapture=${onLetGo}
    @keydown=${press}
  >
    ${body(lobe, hex(colour))}
    <text text-anchor="middle" y="4" fill=${mean(colour) > 0.35 ? '#000' : '#fff'}>${index + 1}</text>
  </g>`;
}
