// Labels of numbers: dragged, they change the number; a double click takes the default.

import { ref } from 'lit-html/directives/ref.js';
import { nearest } from '../state/range.js';

const LABELS = '.name, .tag, label';
const PLACES = 'label, .channel, .axis, .parameter'; // of a label with its number
const STILL = 3; // pixels that a click may move

const fields = new WeakMap(); // by field: {value, spec, step, edit}
const wholes = new WeakMap(); // by label of several numbers: what takes their default

/** Makes a field known with its `value` of a `spec`, its `step`, and what `edit`s it. */
export const scrubbed = (given) => ref((field) => field && fields.set(field, given));

/** Makes a label known by what takes the default of all that it is of; null where there is none. */
export const whole = (reset) => ref((label) => label && wholes.set(label, reset));

/** How many steps one of a key, a wheel or a pixel is: Shift makes it ten, Ctrl a tenth. */
export const steps = ({ shiftKey, ctrlKey, metaKey }) => (shiftKey ? 10 : ctrlKey || metaKey ? 0.1 : 1);

/** The field of a label that has one alone. */
function fieldOf(label) {
  const found = label.closest(PLACES)?.querySelectorAll('input.number') ?? [];
  return found.length === 1 && fields.has(found[0]) ? found[0] : null;
}

const labelOf = ({ target }) => (target.matches?.('input, select, button') ? null : target.closest?.(LABELS));

/** Listens to the labels in an element. */
export function followScrubbing(element, options) {
  element.addEventListener('pointerdown', begin, options);
  element.addEventListener('dblclick', takeDefault, options);
}

function begin(event) {
  const label = labelOf(event), field = label && fieldOf(label);
  if (!field || event.button !== 0 || field.matches(':disabled')) return;
  const { value } = fields.get(field);
  let at = event.clientX, moved = 0, dragged = false;
  const done = new AbortController();
  const on = (name, act) => label.addEventListener(name, act, { signal: done.signal });
  label.setPointerCapture(event.pointerId);
  on('pointermove', (next) => {
    dragged ||= Math.abs(next.clientX - event.clientX) > STILL;
    if (!dragged) return;
    const { spec, step, edit } = fields.get(field);
    moved += (next.clientX - at) * step * steps(next);
    at = next.clientX;
    const found = nearest(value + moved, spec);
    if (found !== undefined) edit.move(found);
  });
  const end = () => {
    done.abort();
    if (!dragged) return;
    fields.get(field).edit.settle();
    label.addEventListener('click', (click) => click.preventDefault(), { once: true }); // which would go into the field
  };
  on('pointerup', end);
  on('pointercancel', end);
}

function takeDefault(event) {
  const label = labelOf(event);
  if (!label) return;
  const reset = wholes.get(label), field = reset ? null : fieldOf(label);
  if (reset) reset();
  else if (field) resetField(fields.get(field));
}

function resetField({ value, spec, edit }) {
  if (typeof spec.default === 'number' && spec.default !== value) edit.set(spec.default);
}
