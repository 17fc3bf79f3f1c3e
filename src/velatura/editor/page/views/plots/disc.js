// Lobes on the projected disc: a picture of f cos, and the outline of each lobe.

import { html, svg } from 'lit-html';
import { ref } from 'lit-html/directives/ref.js';
import { radians } from '../../render/slices.js';
import { lookOf } from './scale.js';

const DECADES = 3; // that the picture shows below its highest value
const OUTLINE = 72; // points
export const SIZE = 192; // pixels of the picture

/**
 * @param {object} plot
 * @param {string} plot.label
 * @param {Float32Array} plot.pixels of f cos, from the lower row on
 * @param {{k: number, look: ?string, dashed: boolean, points: number[][]}[]} plot.outlines `look`: not that of lobe k
 * @param {?number[]} plot.mark where the light comes from or goes on to
 * @param {?number[]} plot.cursor a point of the disc
 * @param {function(number[])} plot.onCursor
 */
export function disc({ label, pixels, outlines, mark, cursor, onCursor }) {
  const point = (event) => {
    const box = event.currentTarget.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * 2.1 - 1.05;
    const y = 1.05 - ((event.clientY - box.top) / box.height) * 2.1;
    if (x * x + y * y < 1) onCursor([x, y]);
  };
  const press = (event) => {
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    if (!(event.key in moves)) return;
    event.preventDefault();
    const [x, y] = moves[event.key].map((move, axis) => (cursor?.[axis] ?? 0) + 0.02 * move);
    if (x * x + y * y < 1) onCursor([x, y]);
  };
  return html`<div class="disc">
    <canvas width=${SIZE} height=${SIZE} ${ref((canvas) => canvas && paint(canvas, pixels))}></canvas>
    <svg
      viewBox="-1.05 -1.05 2.1 2.1"
      role="application"
      tabindex="0"
      aria-label="${label}; arrow keys move the point that is read"
      @pointermove=${point}
      @pointerdown=${point}
      @keydown=${press}
    >
      <circle class="surface" r="1" />
      ${outlines.map(
        ({ k, look = lookOf(k), dashed, points }) =>
          svg`<path class="line ${look} ${dashed ? 'dashed' : ''}" d="M${points.map(([x, y]) => `${x.toFixed(3)} ${(-y).toFixed(3)}`).join('L')}Z" />`,
      )}
      ${mark && svg`<path class="mark" d="M${mark[0] - 0.04} ${-mark[1]}h.08m-.04-.04v.08" />`}
      ${cursor && svg`<circle class="cursor" cx=${cursor[0]} cy=${-cursor[1]} r="0.03" />`}
    </svg>
  </div>`;
}

/** The colour that a picture of f cos has at a point of the disc. */
export function colourAt(pixels, [x, y]) {
  const column = Math.min(SIZE - 1, Math.floor(((x + 1) / 2) * SIZE));
  const row = Math.min(SIZE - 1, Math.floor(((y + 1) / 2) * SIZE));
  return Array.from(pixels.subarray(4 * (row * SIZE + column)).subarray(0, 3));
}

/**
 * Where the density of a lobe's normals has fallen to a quarter, as directions on the disc: slopes of one roughness from
 * the normal, light from (sine, 0) at that azimuth reflected there.
 */
export function outline({ alpha: [u, v], rotation }, sine, azimuth) {
  const wi = [sine * Math.cos(azimuth), sine * Math.sin(azimuth), Math.sqrt(1 - sine * sine)];
  return Array.from({ length: OUTLINE }, (_, i) => {
    const turn = radians((360 * i) / OUTLINE);
    const [a, b] = [u * Math.cos(turn), v * Math.sin(turn)];
    const slope = [
      a * Math.cos(rotation) - b * Math.sin(rotation),
      a * Math.sin(rotation) + b * Math.cos(rotation),
    ];
    const length = Math.hypot(...slope, 1);
    const h = [slope[0] / length, slope[1] / length, 1 / length];
    const cosine = wi[0] * h[0] + wi[1] * h[1] + wi[2] * h[2];
    const wo = [0, 1, 2].map((axis) => 2 * cosine * h[axis] - wi[axis]);
    // Below the horizon there is no light: keep to it
    const radius = Math.hypot(wo[0], wo[1]);
    return wo[2] > 0 ? wo : [wo[0] / radius, wo[1] / radius];
  });
}

/** Puts f cos into a canvas: its own colours, their brightness on a logarithmic scale. */
function paint(canvas, pixels) {
  const context = canvas.getContext('2d');
  const image = context.createImageData(SIZE, SIZE);
  let highest = 1e-12;
  for (let i = 0; i < pixels.length; i += 4) highest = Math.max(highest, pixels[i], pixels[i + 1], pixels[i + 2]);
  for (let row = 0; row < SIZE; row++) {
    for (let column = 0; column < SIZE; column++) {
      const from = 4 * (row * SIZE + column);
      const to = 4 * ((SIZE - 1 - row) * SIZE + column);
      const [r, g, b] = [pixels[from], pixels[from + 1], pixels[from + 2]];
      const most = Math.max(r, g, b);
      const bright = Math.max(0, 1 + Math.log10(Math.max(most, 1e-30) / highest) / DECADES);
      const inside = ((column + 0.5) / SIZE - 0.5) ** 2 + ((row + 0.5) / SIZE - 0.5) ** 2 < 0.25;
      [r, g, b].forEach((value, k) => (image.data[to + k] = 255 * bright * (most > 0 ? (value / most) ** 0.45 : 0)));
      image.data[to + 3] = inside ? 255 : 0;
    }
  }
  context.putImageData(image, 0, 0);
}
