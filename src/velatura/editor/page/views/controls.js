// Controls of single values. Each takes its value and `edit`, which is called with a new one.

import { html, nothing } from 'lit-html';
import { live } from 'lit-html/directives/live.js';
import { evaluated } from '../state/expression.js';
import { nearest, objection } from '../state/range.js';
import { icons } from './icons.js';
import { scrubbed, steps } from './scrubbing.js';
import { isTyping, release, text } from './typing.js';

const ROOM = 8; // characters of a field
const DIGITS = [6, 5, 4, 3, 2, 1];
const TICKS = 200; // of a slider
const DECADES = [-3, 2]; // of a slider for a range that is wider than WIDE; its left end is 0
const WIDE = 1000;

/** A value as a field shows it: with the most digits, up to six, that it has room for. */
export function shown(value) {
  const texts = DIGITS.map((digits) => String(Number(value.toPrecision(digits))));
  return texts.find(({ length }) => length <= ROOM) ?? texts.at(-1);
}

/** Words that begin with a capital. */
export const capital = (words) => words.charAt(0).toUpperCase() + words.slice(1);

/** Styles of an element for its property: a page may be served by a policy that refuses the attribute. */
export const styles = (declared) =>
  Object.entries(declared)
    .map(([name, value]) => (value === '' ? '' : `${name}: ${value};`))
    .join(' ');

// Numbers --------------------------------------------------------------------------------------------

/** How the ticks of a slider stand for values: `span` [low, high] evenly, or decades where there is none. */
function scaleOf(span, [first, last] = DECADES) {
  if (span) {
    const [low, high] = span;
    return {
      tick: (value) => Math.round((TICKS * (value - low)) / (high - low)),
      value: (tick) => Number((low + (tick / TICKS) * (high - low)).toPrecision(4)),
    };
  }
  return {
    tick: (value) =>
      value > 0 ? Math.round(1 + ((TICKS - 1) * (Math.log10(value) - first)) / (last - first)) : 0,
    value: (tick) =>
      tick < 1 ? 0 : Number((10 ** (first + ((tick - 1) / (TICKS - 1)) * (last - first))).toPrecision(3)),
  };
}

/** The ends of a slider: those of the range, within it where they are excluded; null for a wide one: as decades. */
export function spanOf({ low, high, strict }) {
  if (high - low > WIDE) return null;
  const margin = strict ? (high - low) / TICKS : 0;
  return [low + margin, high - margin];
}

/** A field that takes a number within the range of `spec`, also by arithmetic; with steps by arrow keys, wheel and label. */
export function numberField({ label, value, spec = {}, edit, step = 0.01 }) {
  const typed = (field) => evaluated(field.value, spec.unit);
  const take = (field) => {
    const number = typed(field);
    const wrong = objection(number, spec);
    field.setCustomValidity(wrong);
    if (wrong) edit.refuse(`${label}: ${wrong}, got ${field.value.trim() || 'nothing'}`);
    else if (number !== value) edit.set(number);
  };
  const move = (field, by) => {
    const moved = nearest((isTyping(field) ? typed(field) : value) + by * step, spec);
    if (moved === undefined) return;
    edit.move(moved);
    edit.settle();
    release(field);
  };
  const onKey = (event) => {
    const sign = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (!sign) return;
    event.preventDefault();
    move(event.target, sign * steps(event));
  };
  const onWheel = (event) => {
    const field = event.currentTarget;
    if (field !== field.getRootNode().activeElement) return; // the page scrolls
    event.preventDefault();
    move(field, -Math.sign(event.deltaY || event.deltaX) * steps(event));
  };
  return html`<input
    class="number"
    type="text"
    inputmode="decimal"
    autocomplete="off"
    spellcheck="false"
    aria-label=${label}
    .value=${text(shown(value))}
    ${scrubbed({ value, spec, step, edit })}
    @keydown=${onKey}
    @wheel=${onWheel}
    @change=${({ target }) => take(target)}
  />`;
}

/** A slider with its field. */
export function number({ label, value, spec, edit, span = spanOf(spec), decades, step }) {
  const scale = scaleOf(span, decades);
  return html`<div class="number-row">
    <input
      type="range"
      min="0"
      max=${TICKS}
      aria-label=${`${label}, slider`}
      aria-valuetext=${shown(value)}
      .value=${live(String(Math.max(0, Math.min(TICKS, scale.tick(value)))))}
      @input=${({ target }) => edit.move(scale.value(Number(target.value)))}
      @change=${edit.settle}
    />
    ${numberField({ label, value, spec, edit, step })}
  </div>`;
}

// Choices --------------------------------------------------------------------------------------------

/** A menu of `options`: values, or [value, title], or {group, options}. */
/** A menu of names, of [name, title], or of [name, title, why it cannot be chosen]; `group` holds several. */
export function menu({ label, value, options, choose }) {
  const option = (entry) => {
    if (entry.group) return html`<optgroup label=${entry.group}>${entry.options.map(option)}</optgroup>`;
    const [key, title, lacks = ''] = Array.isArray(entry) ? entry : [entry, entry];
    return html`<option value=${key} .selected=${live(key === value)} ?disabled=${lacks} title=${lacks}>${title}</option>`;
  };
  return html`<select aria-label=${label} @change=${({ target }) => choose(target.value)}>
    ${options.map(option)}
  </select>`;
}

/** A checkbox; `lacks` says why it cannot be changed, where it cannot. */
export function flag({ label, value, choose, title = '', lacks = '' }) {
  return html`<label class="flag" title=${lacks || title}>
    <input type="checkbox" ?disabled=${lacks} .checked=${live(value)} @change=${({ target }) => choose(target.checked)} />
    ${label}
  </label>`;
}

/** A button that is a drawing; `pressed` makes it a switch, and `expanded` says whether what it folds is open. */
export function iconButton({ label, icon, act, pressed = null, expanded = null, disabled = false, name = '', title = label, tabindex = 0 }) {
  return html`<button
    type="button"
    class="small ${name}"
    title=${title}
    aria-label=${label}
    aria-pressed=${pressed ?? nothing}
    aria-expanded=${expanded ?? nothing}
    tabindex=${tabindex || nothing}
    ?disabled=${disabled}
    @click=${act}
  >
    ${icons[icon]}
  </button>`;
}

// Angles ---------------------------------------------------------------------------------------------

/** A dial, anticlockwise from the right, with its field; degrees. */
export function dial({ label, value, spec, edit, low = -180 }) {
  const turn = (event) => {
    const box = event.currentTarget.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left - box.width / 2, box.top + box.height / 2 - event.clientY];
    const degrees = Math.round((Math.atan2(y, x) * 180) / Math.PI);
    edit.move(degrees < low ? degrees + 360 : degrees);
  };
  const onKey = (event) => {
    const steps = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 15, PageDown: -15 };
    if (!(event.key in steps)) return;
    event.preventDefault();
    edit.move(value + steps[event.key]);
    edit.settle();
  };
  return html`<div class="knob-row">
    <div
      class="knob"
      role="slider"
      tabindex="0"
      aria-label=${`${label}, dial`}
      aria-valuemin=${low}
      aria-valuemax=${low + 360}
      aria-valuenow=${shown(value)}
      aria-valuetext=${`${shown(value)} degrees`}
      .style=${styles({ '--turn': `${-value}deg` })}
      @pointerdown=${(event) => {
        event.currentTarget.setPointerCapture(event.pointerId);
        turn(event);
      }}
      @pointermove=${(event) => event.buttons && turn(event)}
      @pointerup=${edit.settle}
      @keydown=${onKey}
    ></div>
    ${numberField({ label, value, spec, edit, step: 1 })}<span class="unit">°</span>
  </div>`;
}

// Textures -------------------------------------------------------------------------------------------

/** The place, scale and reading of a texture. */
export function texture({ label, value, spec, records, edit }) {
  const {
    scale = 1,
    offset = 0,
    encoding = 'linear',
    channel = spec.kind === 'colour' || spec.kind === 'index' ? 'rgb' : 'r',
  } = value;
  const part = (key) => ({
    ...edit,
    move: (entry) => edit.move({ ...value, [key]: entry }),
    set: (entry) => edit.set({ ...value, [key]: entry }),
  });
  const channels = records.channel.options.filter(
    (name) => name !== 'rgb' || channel === 'rgb' || spec.kind !== 'number',
  );
  const choice = (key, options, chosen) =>
    menu({ label: `${label}, ${key}`, value: chosen, options, choose: part(key).set });
  return html`<div class="texture">
    <span class="file" title=${value.texture}>${value.texture.split('/').at(-1)}</span>
    <div class="pairs">
      <label>scale ${numberField({ label: `${label}, scale`, value: scale, spec: records.scale, edit: part('scale') })}</label>
      <label>offset ${numberField({ label: `${label}, offset`, value: offset, spec: records.offset, edit: part('offset') })}</label>
      <label>channel ${choice('channel', channels, channel)}</label>
      <label>encoding ${choice('encoding', records.encoding.options, encoding)}</label>
    </div>
  </div>`;
}
