// The border of a part of the page, which is dragged, or moved by keys; a double click puts it back.

import { html } from 'lit-html';

const STEP = 24; // pixels for a key

/**
 * A border beside the part that `part(splitter)` finds, of a `size` in pixels. `resize` gets the part's new size in pixels, or null for the one
 * that it has by itself; parts lie below the border, or where `across` to its right.
 */
export function splitter({ label, across = false, size, part, resize }) {
  const sizeOf = (element) => part(element).getBoundingClientRect()[across ? 'width' : 'height'];
  const onKey = (event) => {
    const towards = across ? { ArrowLeft: 1, ArrowRight: -1 } : { ArrowUp: 1, ArrowDown: -1 };
    if (!towards[event.key]) return;
    event.preventDefault();
    resize(sizeOf(event.currentTarget) + STEP * towards[event.key]);
  };
  const byHand = (event) => {
    if (!event.buttons) return;
    const box = part(event.currentTarget).getBoundingClientRect();
    resize(across ? box.right - event.clientX : box.bottom - event.clientY);
  };
  return html`<div
    class="splitter"
    role="separator"
    tabindex="0"
    aria-label=${label}
    aria-valuenow=${Math.round(size)}
    aria-orientation=${across ? 'vertical' : 'horizontal'}
    @keydown=${onKey}
    @dblclick=${() => resize(null)}
    @pointerdown=${(event) => event.currentTarget.setPointerCapture(event.pointerId)}
    @pointermove=${byHand}
  ></div>`;
}
