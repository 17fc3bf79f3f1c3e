// Fields in use: typed or picked text stays unchanged until it is accepted, or the field is left.

import { noChange } from 'lit-html';
import { Directive, directive } from 'lit-html/directive.js';

const TYPED = ['text', 'color'];
const latest = new WeakMap(); // by field: what it is to show when no hand is in it

/** Whether a field holds what is not taken yet. */
export const isTyping = (field) => 'typed' in (field.dataset ?? {});

function show(field, text) {
  if (!isTyping(field) && field.value !== text) field.value = text;
}

/** The `.value` of a field, also where a hand has changed it since; while it is being changed, it is left alone. */
export const text = directive(
  class extends Directive {
    update({ element }, [value]) {
      latest.set(element, value);
      show(element, value);
      return noChange;
    }
  },
);

/** Ends what is typed in a field: it shows its value again. */
export function release(field) {
  delete field.dataset.typed;
  if (latest.has(field)) show(field, latest.get(field));
}

/** Marks the fields in an element while a hand is in them; one that is refused stays so until it is left. */
export function followTyping(element, options) {
  const on = (name, act, capture = false) =>
    element.addEventListener(name, ({ target }) => act(target), { ...options, capture });
  on('input', (field) => TYPED.includes(field.type) && (field.dataset.typed = ''), true); // before the page is drawn
  on('change', (field) => field.validity?.valid && release(field));
  on('focusout', (field) => {
    if (!latest.has(field)) return;
    field.setCustomValidity('');
    release(field);
  });
}
