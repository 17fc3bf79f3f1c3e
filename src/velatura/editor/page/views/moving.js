// Things of a list that are dragged by their grips.

import { html } from 'lit-html';
import { icons } from './icons.js';

/**
 * The grip of an item, by which a pointer drags it and arrow keys move it.
 *
 * @param {object} item its `name` in words, its `place` in the list, and the selector `items` of all, which are in the list
 *   that the grip is in; `move(place)`, and `over(place)` while it is dragged, which is called with null at the end
 */
export const grip = ({ name, place, items, move, over }) => html`<button
  type="button"
  class="small grip"
  title="Drag to move; arrow keys move too"
  aria-label=${`Move ${name}: arrow keys`}
  @keydown=${(event) => {
    const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (!step) return;
    event.preventDefault();
    move(place + step);
  }}
  @pointerdown=${(event) => followGrip(event, items, { over, drop: move })}
>
  ${icons.grip}
</button>`;

/**
 * Follows a pointer over a list and shows where the item of the grip would go; it moves when the pointer is let go.
 *
 * @param {PointerEvent} event on the grip
 */
function followGrip(event, items, { over = () => {}, drop }) {
  if (event.button !== 0) return;
  const grip = event.currentTarget;
  const cards = [...grip.closest('ol').querySelectorAll(items)];
  const placeOf = ({ clientY }) => {
    const index = cards.findIndex((card) => clientY < card.getBoundingClientRect().bottom);
    return index < 0 ? cards.length - 1 : index;
  };
  const done = new AbortController();
  const on = (name, act) => grip.addEventListener(name, act, { signal: done.signal });
  const end = () => {
    done.abort();
    over(null);
  };
  grip.setPointerCapture(event.pointerId);
  on('pointermove', (moved) => over(placeOf(moved)));
  on('pointerup', (moved) => {
    end();
    drop(placeOf(moved));
  });
  on('pointercancel', end);
}
