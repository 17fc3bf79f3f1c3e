// A place of the picture that is asked for: by a click, or by a cross that arrow keys move.

import { html, nothing } from 'lit-html';
import { styles } from './controls.js';

const STEP = 1 / 50; // of the picture, a key
const KEYS = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, -STEP], ArrowDown: [0, STEP] };
const within = (share) => Math.min(Math.max(share, 0), 1);

/** `view()`, which lies over the picture, and `ask(title)`: the place as {x, y} on the page, or null where it was given up. */
export function createAim({ element, update }) {
  let asked = null; // {title, resolve, at: shares of the picture, before: what had the focus}

  function ask(title) {
    asked?.resolve(null);
    const before = element.getRootNode().activeElement;
    return new Promise((resolve) => {
      asked = { title, resolve, at: [0.5, 0.5], before };
      update();
      element.querySelector('.aim').focus();
    });
  }

  function end(place) {
    const { resolve, before } = asked;
    asked = null;
    update();
    before?.focus();
    resolve(place);
  }

  function take({ currentTarget: { clientWidth, clientHeight }, detail, offsetX, offsetY }) {
    const [x, y] = asked.at;
    end(detail ? { x: offsetX, y: offsetY } : { x: x * clientWidth, y: y * clientHeight }); // by hand, or by Enter
  }

  function onKey(event) {
    const [right, down] = KEYS[event.key] ?? [];
    if (event.key !== 'Escape' && right === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.key === 'Escape') return end(null);
    const far = event.shiftKey ? 5 : 1, [x, y] = asked.at;
    asked.at = [within(x + far * right), within(y + far * down)];
    return update();
  }

  function view() {
    if (!asked) return nothing;
    const { title, at: [x, y] } = asked;
    return html`<button
      type="button"
      class="aim"
      @click=${take}
      @keydown=${onKey}
      @blur=${() => asked && end(null)}
    >
      <span class="what">${title}: click a place, or arrow keys and Enter; Escape ends this</span>
      <span class="cross" .style=${styles({ left: `${100 * x}%`, top: `${100 * y}%` })}></span>
    </button>`;
  }

  return { view, ask };
}
