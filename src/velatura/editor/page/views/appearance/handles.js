// All lobes in one plot, blur against energy, each with a handle.

import { nothing, svg, html } from 'lit-html';
import { hex } from '../colour.js';
import { mean, shown } from '../plots/scale.js';
import { DARKEST, hue } from './looks.js';

const [WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM] = [330, 190, 50, 14, 12, 34];
const RADIUS = 9;
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
 * @param {function(number, {blur: ?number, energy: ?number})} plot.onMove
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
    ${asked ? lobes.map((lobe, index) => ghost(lobe, asked[index])) : nothing}
    ${lobes.map((lobe, index) =>
      handle(lobe, index, { from: hand[index], chosen: index === chosen, fixed, onChoose, onMove, onLetGo }),
    )}
  </svg>`;
}

/** Where a lobe was asked to be, joined to where it is. */
function ghost(lobe, wish) {
  const [x, y, u, v] = [across(lobe.alpha), up(mean(lobe.energy)), across(wish.alpha), up(mean(wish.energy))];
  if (Math.hypot(x - u, y - v) < 2) return nothing;
  return svg`<line class="ghost" x1=${x} y1=${y} x2=${u} y2=${v} />
    <circle class="ghost" cx=${u} cy=${v} r=${RADIUS} />`;
}

function handle(lobe, index, { from, chosen, fixed, onChoose, onMove, onLetGo }) {
  const [blur, energy] = [lobe.alpha, mean(lobe.energy)];
  const colour = hue(lobe);
  const press = (event) => {
    const moves = {
      ArrowLeft: { blur: within(0, from.alpha - STEP.blur, 1) },
      ArrowRight: { blur: within(0, from.alpha + STEP.blur, 1) },
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
    const box = event.currentTarget.ownerSVGElement.getBoundingClientRect();
    const scale = WIDTH / box.width;
    onMove(index, {
      blur: blurAt((event.clientX - box.left) * scale),
      energy: energyAt((event.clientY - box.top) * scale),
    });
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
    aria-valuetext="blur ${shown(blur)}, energy ${shown(energy)}"
    @focus=${() => onChoose(index)}
    @pointerdown=${begin}
    @pointermove=${drag}
    @lostpointercapture=${onLetGo}
    @keydown=${press}
  >
    <circle r=${RADIUS} fill=${hex(colour)} />
    <text text-anchor="middle" y="4" fill=${mean(colour) > 0.35 ? '#000' : '#fff'}>${index + 1}</text>
  </g>`;
}
