// Two numbers of a class against each other: where there are members, how much they absorb, and the one that is taken.

import { html, nothing, svg } from 'lit-html';
import { ref } from 'lit-html/directives/ref.js';
import { styles } from '../controls.js';
import { shown, ticks } from '../plots/scale.js';

const [WIDTH, LEFT, RIGHT, TOP, BOTTOM] = [330, 50, 14, 8, 34];
const STEPS = 100; // of an axis, by arrow keys
const RATIO = 3; // of the ends of an axis, from which on it is logarithmic
const CLEAR = 1e-4; // an optical depth below this is not seen
const ROUND = [1, 1.5, 2, 3, 4, 5, 7];

/** How an axis {label, low, high} stands for pixels from `start` to `end`. */
function scaleOf({ low, high }, start, end) {
  const logarithmic = low > 0 && high / low > RATIO;
  const [to, from] = logarithmic ? [Math.log, Math.exp] : [(x) => x, (x) => x];
  const [a, b] = [to(low), to(high)];
  const at = (value) => start + ((end - start) * (to(Math.min(Math.max(value, low), high)) - a)) / (b - a || 1);
  const value = (place) => from(a + (b - a) * Math.min(Math.max((place - start) / (end - start), 0), 1));
  const moved = (now, steps) => value(at(now) + ((end - start) * steps) / STEPS);
  return { at, value, moved, marks: logarithmic ? decades(low, high) : ticks(low, high, 4) };
}

/** Round numbers of a logarithmic axis, few enough to be read. */
function decades(low, high) {
  const found = [];
  const digits = high / low > 30 ? [1] : ROUND;
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
    for (const digit of digits) found.push(Number((digit * 10 ** power).toPrecision(2)));
  }
  return found.filter((value) => value >= low * 0.999 && value <= high * 1.001);
}

/**
 * @param {object} plot
 * @param {string} plot.label
 * @param {object[]} plot.axes {label, low, high}, one or two
 * @param {?{feasible: Uint8Array, absorption: Float32Array, shape: number[]}} plot.cells rows from the lower one on
 * @param {{channel: string, points: number[][]}[]} plot.outlines
 * @param {number[]} plot.point the member
 * @param {number[][]} plot.dots its channels
 * @param {number[][]} plot.path other members
 * @param {number} plot.height of the plot itself
 * @param {function(number[])} plot.onMove
 * @param {function} plot.onLetGo
 */
export function plane({ label, axes, cells, outlines, point, dots = [], path = [], height, onMove, onLetGo }) {
  const bottom = TOP + height;
  const x = scaleOf(axes[0], LEFT, WIDTH - RIGHT);
  const y = axes[1] ? scaleOf(axes[1], bottom, TOP) : null;
  const place = ([a, b]) => [x.at(a), y ? y.at(b) : TOP + height / 2];
  const line = (points) => `M${points.map((one) => place(one).map((n) => n.toFixed(1)).join(' ')).join('L')}`;
  const move = (event) => {
    if (!event.buttons) return;
    const box = event.currentTarget.getBoundingClientRect();
    const scale = WIDTH / box.width;
    const [u, v] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
    onMove([x.value(u), ...(y ? [y.value(v)] : [])]);
  };
  const press = (event) => {
    const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1] }[event.key];
    if (!by || (!y && by[1])) return;
    event.preventDefault();
    const far = event.shiftKey ? 5 : 1;
    // Up is up, though pixels count downwards
    onMove([x.moved(point[0], far * by[0]), ...(y ? [y.moved(point[1], far * by[1])] : [])]);
    onLetGo();
  };
  const [u, v] = place(point);
  const part = (share, whole) => `${(100 * share) / whole}%`;
  const inside = {
    left: part(LEFT, WIDTH),
    top: part(TOP, bottom + BOTTOM),
    width: part(WIDTH - LEFT - RIGHT, WIDTH),
    height: part(height, bottom + BOTTOM),
  };
  return html`<div class="plane">
    ${
      cells
        ? html`<canvas
          width=${cells.shape[1]}
          height=${cells.shape[0]}
          .style=${styles(inside)}
          ${ref((canvas) => canvas && queueMicrotask(() => paint(canvas, cells)))}
        ></canvas>`
        : nothing
    }
    <svg
      class="plot"
      viewBox="0 0 ${WIDTH} ${bottom + BOTTOM}"
      role="application"
      tabindex="0"
      aria-label="${label}; arrow keys move the member"
      @pointerdown=${(event) => {
        event.currentTarget.setPointerCapture(event.pointerId);
        move(event);
      }}
      @pointermove=${move}
      @lostpointercapture=${onLetGo}
      @keydown=${press}
    >
      <rect class="frame" x=${LEFT} y=${TOP} width=${WIDTH - LEFT - RIGHT} height=${height} />
      ${x.marks.map(
        (value) => svg`<path class="tick" d="M${x.at(value)} ${bottom}v4" />
          <text text-anchor="middle" x=${x.at(value)} y=${bottom + 15}>${shown(value)}</text>`,
      )}
      ${(y?.marks ?? []).map(
        (value) => svg`<path class="tick" d="M${LEFT} ${y.at(value)}h-4" />
          <text text-anchor="end" x=${LEFT - 6} y=${y.at(value) + 4}>${shown(value)}</text>`,
      )}
      <text text-anchor="middle" x=${(LEFT + WIDTH - RIGHT) / 2} y=${bottom + 30}>${axes[0].label}</text>
      ${
        y &&
        svg`<text text-anchor="middle" transform="translate(9 ${TOP + height / 2}) rotate(-90)">${axes[1].label}</text>`
      }
      ${outlines.map(({ channel, points }) => svg`<path class="outline ${channel}" d=${line(points)} />`)}
      ${path.length > 1 ? svg`<path class="path" d=${line(path)} />` : nothing}
      ${path.map((one) => {
        const [a, b] = place(one);
        return svg`<circle class="stop" cx=${a} cy=${b} r="2.5" />`;
      })}
      ${dots.map((one, channel) => {
        const [a, b] = place(one);
        return svg`<circle class="dot ${'rgb'[channel]}" cx=${a} cy=${b} r="3" />`;
      })}
      <circle class="member" cx=${u} cy=${v} r="6" />
    </svg>
  </div>`;
}

/** Shades the members by what they absorb, between the two colours of the canvas's style; the rest stays clear. */
function paint(canvas, { feasible, absorption, shape: [rows, columns] }) {
  const context = canvas.getContext('2d');
  const image = context.createImageData(columns, rows);
  const { color, borderTopColor } = canvas.ownerDocument.defaultView.getComputedStyle(canvas);
  const [deep, clear] = [color, borderTopColor].map((text) => text.match(/[\d.]+/g).map(Number));
  const most = deepest(feasible, absorption);
  feasible.forEach((is, index) => {
    if (!is) return;
    const at = 4 * ((rows - 1 - Math.floor(index / columns)) * columns + (index % columns));
    const share = most > 0 ? Math.min(absorption[index] / most, 1) : 0;
    for (let channel = 0; channel < 3; channel++) {
      image.data[at + channel] = clear[channel] + share * (deep[channel] - clear[channel]);
    }
    image.data[at + 3] = 255;
  });
  context.putImageData(image, 0, 0);
}

/** The largest optical depth among the members; 0 where none need absorb, but for rounding. */
export function deepest(feasible, absorption) {
  let most = 0;
  feasible.forEach((is, index) => is && (most = Math.max(most, absorption[index])));
  return most < CLEAR ? 0 : most;
}
