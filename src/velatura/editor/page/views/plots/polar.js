// Lobes in the plane of incidence: f cos against the outgoing angle, as distance from the middle.

import { html, nothing, svg } from 'lit-html';
import { radians } from '../../render/slices.js';
import { lookOf, mean, roundUp, shown } from './scale.js';

const RADIUS = 150;
const DECADES = 3; // of the logarithmic scale, below the highest value
const MARGIN = 22;

/**
 * @param {object} plot
 * @param {object} plot.slice {angles, all, parts}, of colours
 * @param {?object} plot.other the same of the second model, dashed
 * @param {object} plot.incidence {angle, below}
 * @param {boolean} plot.whole both sides of the surface
 * @param {boolean} plot.logarithmic
 * @param {function(number): boolean} plot.seen whether a part is drawn
 * @param {boolean} plot.sum whether the sum of all is
 * @param {?number} plot.cursor an angle, degrees from the normal on the side of the light
 * @param {function(number)} plot.onCursor
 */
export function polar({ slice, other, incidence, whole, logarithmic, seen, sum, cursor, onCursor }) {
  const lines = [...linesOf(slice, seen, sum), ...(other ? linesOf(other, seen, sum, 'dashed') : [])];
  const highest = roundUp(Math.max(...lines.map(({ values }) => Math.max(...values)), 0));
  const reach = radius(highest, logarithmic);
  const flip = incidence.below ? -1 : 1;
  const place = (angle, length) => [length * Math.sin(radians(angle)), -flip * length * Math.cos(radians(angle))];
  const height = whole ? 2 * (RADIUS + MARGIN) : RADIUS + 2 * MARGIN;
  const [top, limit] = [-RADIUS - MARGIN, whole ? 180 : 90];

  const point = (event) => {
    const box = event.currentTarget.getBoundingClientRect();
    const scale = (2 * (RADIUS + MARGIN)) / box.width;
    const x = (event.clientX - box.left) * scale - RADIUS - MARGIN;
    const y = (event.clientY - box.top) * scale + top;
    const angle = (Math.atan2(x, -flip * y) * 180) / Math.PI;
    if (Math.abs(angle) <= limit) onCursor(angle);
  };
  const press = (event) => {
    const moves = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 };
    if (!(event.key in moves)) return;
    event.preventDefault();
    onCursor(Math.min(Math.max(cursor + moves[event.key], -limit), limit));
  };
  const outline = ({ angles, values }) => {
    const points = angles.map((angle, i) => place(angle, reach(values[i])));
    const around = points.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join('L');
    return whole ? `M${around}Z` : `M0 0L${around}Z`;
  };
  const ray = (angle, length, look) => {
    const [x, y] = place(angle, length);
    return svg`<line class=${look} x1="0" y1="0" x2=${x} y2=${y} />`;
  };

  return html`<svg
    class="polar"
    viewBox="${-RADIUS - MARGIN} ${top} ${2 * (RADIUS + MARGIN)} ${height}"
    role="slider"
    tabindex="0"
    aria-label="Lobes in the plane of incidence; the outgoing angle that is read"
    aria-valuemin=${-limit}
    aria-valuemax=${limit}
    aria-valuenow=${Math.round(cursor)}
    aria-valuetext="${Math.round(cursor)} degrees"
    @pointermove=${point}
    @pointerdown=${point}
    @keydown=${press}
  >
    ${rings(highest, logarithmic).map((value) => {
      const r = reach(value);
      const text = svg`<text class="tick" x="3" y=${-flip * r - 3 * flip}>${shown(value)}</text>`;
      return whole
        ? svg`<circle class="grid" r=${r} />${text}`
        : svg`<path class="grid" d="M${-r} 0A${r} ${r} 0 0 1 ${r} 0" />${text}`;
    })}
    ${[-60, -30, 0, 30, 60].map((angle) => ray(angle, RADIUS, 'grid'))}
    ${[-90, -60, -30, 30, 60, 90].map((angle) => {
      const [x, y] = place(angle, RADIUS + 12);
      return svg`<text class="tick" text-anchor="middle" x=${x} y=${y + 4}>${Math.abs(angle)}°</text>`;
    })}
    <line class="surface" x1=${-RADIUS} x2=${RADIUS} y1="0" y2="0" />
    ${lines.map((line) => svg`<path class="line area ${line.look}" d=${outline(line)} />`)}
    ${ray(-incidence.angle, RADIUS, 'incident')} ${cursor === null ? nothing : ray(cursor, RADIUS, 'cursor')}
  </svg>`;
}

function linesOf({ angles, all, parts }, seen, sum, look = '') {
  const drawn = parts.map((values, k) => ({ angles, values: values.map(mean), look: `${lookOf(k)} ${look}`, k }));
  const whole = { angles, values: all.map(mean), look: `sum ${look}` };
  return [...(sum ? [whole] : []), ...drawn.filter(({ k }) => seen(k))];
}

/** Distance from the middle of a value; the logarithm begins three decades below the highest. */
function radius(highest, logarithmic) {
  if (!logarithmic) return (value) => (RADIUS * Math.max(value, 0)) / highest;
  return (value) => RADIUS * Math.max(0, 1 + Math.log10(Math.max(value, 1e-30) / highest) / DECADES);
}

const rings = (highest, logarithmic) =>
  logarithmic ? [highest, highest / 10, highest / 100] : [highest, (2 / 3) * highest, highest / 3];
