// The history of the material as a strip of pictures; a click goes back to one.

import { html } from 'lit-html';
import { repeat } from 'lit-html/directives/repeat.js';
import { goBack } from '../state/commands.js';

const KEYS = { ArrowLeft: -1, ArrowRight: 1, Home: -Infinity, End: Infinity };

/** What a snapshot is called. */
export const titleOf = ({ number, state }) => `${number} · ${state.name || 'Material'}`;

/** A view of the history; of its pictures one is reached by Tab, and the others from there by arrow keys. */
export function createStrip({ store, snapshots, focus }) {
  const onKey = (event) => {
    const { list } = snapshots, at = list.findIndex(({ number }) => number === Number(event.target.dataset.snapshot));
    if (!(event.key in KEYS) || at < 0) return;
    event.preventDefault();
    const { number } = list[Math.max(0, Math.min(list.length - 1, at + KEYS[event.key]))];
    focus(`[data-snapshot="${number}"]`);
  };

  return () => {
    const { list } = snapshots, current = snapshots.current();
    const stop = current ?? list.at(-1);
    const picture = (snapshot) => html`<li>
      <button
        type="button"
        class="snapshot"
        data-snapshot=${snapshot.number}
        title=${titleOf(snapshot)}
        aria-label=${titleOf(snapshot)}
        aria-current=${snapshot === current}
        tabindex=${snapshot === stop ? 0 : -1}
        @click=${() => snapshot !== current && store.run(goBack, snapshot.state)}
      >
        <img src=${snapshot.picture} alt="" width="72" height="54" draggable="false" />
      </button>
    </li>`;
    return html`<ol class="strip" aria-label="Earlier states of the material" @keydown=${onKey}>
      ${repeat(list, ({ number }) => number, picture)}
    </ol>`;
  };
}
