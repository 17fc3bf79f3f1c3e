// A chart of lines over one axis, with a cursor that pointer and keys move.

import { html, nothing, svg } from 'lit-html';
import { roundUp, shown, ticks } from './scale.js';

const WIDTH = 440;
const HEIGHT = 270;
const LEFT = 46;
const RIGHT = 38;
const TOP = 10;
const BOTTOM = 40;

/**
 * @param {object} plot
 * @param {string} plot.label what the chart shows, in words
 * @param {{label: string, low: number, high: ?number}} plot.x the axis; so is `plot.y`; high null is what fits
 * @param {{x: number[], y: number[], error?: number[], look: string, tag?: string}[]} plot.lines `look`: classes;
 *   `tag`: a word at the end of the line
 * @param {?number} plot.cursor where along x the numbers are read
 * @param {function(number)} plot.onCursor
 * @param {number} plot.step what an arrow key moves it by
 */
export function chart({ label, x, y, lines, cursor, onCursor, step = 1 }) {
  const xs = { low: x.low ?? 0, high: x.high ?? roundUp(largest(lines, 'x')) };
  const ys = { low: y.low ?? 0, high: y.high ?? roundUp(largest(lines, 'y')) };
  const across = (value) => LEFT + ((value - xs.low) / (xs.high - xs.low)) * (WIDTH - LEFT - RIGHT);
  const up = (value) => HEIGHT - BOTTOM - ((value - ys.low) / (ys.high - ys.low)) * (HEIGHT - BOTTOM - TOP);
  const within = (value) => Math.min(Math.max(value, xs.low), xs.high);

  const point = (event) => {
    const box = event.currentTarget.getBoundingClientRect();
    const place = ((event.clientX - box.left) / box.width) * WIDTH;
    onCursor(within(xs.low + ((place - LEFT) / (WIDTH - LEFT - RIGHT)) * (xs.high - xs.low)));
  };
  const press = (event) => {
    const moves = { ArrowLeft: -step, ArrowRight: step, PageDown: -10 * step, PageUp: 10 * step };
    if (!(event.key in moves)) return;
    event.preventDefault();
    onCursor(within((cursor ?? xs.low) + moves[event.key]));
  };

  return html`<svg
    class="chart"
    viewBox="0 0 ${WIDTH} ${HEIGHT}"
    role="slider"
    tabindex="0"
    aria-label=${label}
    aria-valuemin=${xs.low}
    aria-valuemax=${xs.high}
    aria-valuenow=${cursor ?? xs.low}
    aria-valuetext="${x.label} ${shown(cursor ?? xs.low)}"
    @pointermove=${point}
    @pointerdown=${point}
    @keydown=${press}
  >
    ${ticks(ys.low, ys.high).map(
      (value) => svg`<line class="grid" x1=${LEFT} x2=${WIDTH - RIGHT} y1=${up(value)} y2=${up(value)} />
        <text class="tick" text-anchor="end" x=${LEFT - 6} y=${up(value) + 4}>${shown(value)}</text>`,
    )}
    ${ticks(xs.low, xs.high, 6).map(
      (value) => svg`<line class="grid" x1=${across(value)} x2=${across(value)} y1=${TOP} y2=${HEIGHT - BOTTOM} />
        <text class="tick" text-anchor="middle" x=${across(value)} y=${HEIGHT - BOTTOM + 16}>${shown(value)}</text>`,
    )}
    <text class="axis" text-anchor="middle" x=${(LEFT + WIDTH - RIGHT) / 2} y=${HEIGHT - 6}>${x.label}</text>
    <text class="axis" text-anchor="middle" transform="translate(12 ${(HEIGHT - BOTTOM + TOP) / 2}) rotate(-90)">
      ${y.label}
    </text>
    <clipPath id="plotted">
      <rect x=${LEFT} y=${TOP - 2} width=${WIDTH - LEFT - RIGHT} height=${HEIGHT - BOTTOM - TOP + 4} />
    </clipPath>
    <g clip-path="url(#plotted)">
      ${lines.map(
        (line) => svg`${line.error ? svg`<path class="error ${line.look}" d=${bars(line, across, up)} />` : nothing}
          <path class="line ${line.look}" d=${path(line, across, up)} />`,
      )}
    </g>
    ${apart(lines.filter(({ tag }) => tag), up).map(
      ({ line, y: place }) => svg`<text class="tag ${line.look}" x=${WIDTH - RIGHT + 4} y=${place + 4}>${line.tag}</text>`,
    )}
    ${cursor === null
      ? nothing
      : svg`<line class="cursor" x1=${across(cursor)} x2=${across(cursor)} y1=${TOP} y2=${HEIGHT - BOTTOM} />`}
  </svg>`;
}

/** The value of a line where the cursor is, between its points. */
export function valueAt({ x, y }, place) {
  const next = x.findIndex((value) => value >= place);
  if (next <= 0) return next === 0 ? y[0] : y.at(-1);
  const share = (place - x[next - 1]) / (x[next] - x[next - 1] || 1);
  return y[next - 1] + share * (y[next] - y[next - 1]);
}

const largest = (lines, key) =>
  lines.reduce((most, line) => line[key].reduce((a, b) => (Number.isFinite(b) ? Math.max(a, b) : a), most), 0);

function path({ x, y }, across, up) {
  const points = x.map((value, i) => [value, y[i]]).filter(([, value]) => Number.isFinite(value));
  return points.map(([a, b], i) => `${i ? 'L' : 'M'}${across(a).toFixed(1)} ${up(b).toFixed(1)}`).join('');
}

const bars = ({ x, y, error }, across, up) =>
  x.map((value, i) => `M${across(value).toFixed(1)} ${up(y[i] - error[i]).toFixed(1)}V${up(y[i] + error[i]).toFixed(1)}`).join('');

/** Tags at the ends of lines, moved until none covers another. */
function apart(lines, up) {
  const tags = lines.map((line) => ({ line, y: up(line.y.at(-1)) })).sort((a, b) => a.y - b.y);
  tags.forEach((tag, i) => i && (tag.y = Math.max(tag.y, tags[i - 1].y + 12)));
  for (let i = tags.length - 1; i >= 0; i--) {
    tags[i].y = Math.min(tags[i].y, i === tags.length - 1 ? HEIGHT - BOTTOM : tags[i + 1].y - 12);
  }
  return tags;
}
