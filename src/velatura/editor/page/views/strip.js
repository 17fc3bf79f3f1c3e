// The history of the material as a strip of pictures; a click goes back to one, or puts it beside what is open.

import { html } from 'lit-html';
import { repeat } from 'lit-html/directives/repeat.js';
import { goBack, putBeside, takeAway } from '../state/commands.js';
import { besideOf, slotBeside } from '../state/compared.js';
import { iconButton } from './controls.js';

const KEYS = { ArrowLeft: -1, ArrowRight: 1, Home: -Infinity, End: Infinity };

/** What is kept under a number is called. */
export const titleOf = ({ number, kept }) => [number, kept.name || 'Material'].filter(Boolean).join(' \u00b7 ');

/** A view of the history; of its pictures one is reached by Tab, and the others from there by arrow keys. */
export function createStrip({ store, snapshots, focus, update }) {
  let reached = null; // the number of the picture that keys have come to

  const onKey = (event) => {
    const { list } = snapshots, at = list.findIndex(({ number }) => number === reached);
    if (!(event.key in KEYS) || at < 0) return;
    event.preventDefault();
    reached = list[Math.max(0, Math.min(list.length - 1, at + KEYS[event.key]))].number;
    update();
    focus(`[data-snapshot="${reached}"]`);
  };
  const reach = (number) => {
    if (reached === number) return;
    reached = number;
    update();
  };

  return () => {
    const { list } = snapshots, current = snapshots.current(), tiles = besideOf(store.get());
    const stop = list.find(({ number }) => number === reached) ?? current ?? list.at(-1);
    const picture = (snapshot) => {
      const { number, kept } = snapshot, title = titleOf(snapshot), tabindex = snapshot === stop ? 0 : -1;
      const tile = tiles.find((tile) => tile.number === number);
      return html`<li @focusin=${() => reach(number)}>
        <button
          type="button"
          class="snapshot"
          data-snapshot=${number}
          title=${title}
          aria-label=${title}
          aria-current=${snapshot === current}
          tabindex=${tabindex}
          @click=${() => snapshot !== current && store.run(goBack, kept)}
        >
          <img src=${snapshot.picture} alt="" width="72" height="54" draggable="false" />
        </button>
        ${iconButton({
          label: `${title}, side by side`,
          icon: 'beside',
          pressed: Boolean(tile),
          disabled: !tile && !slotBeside(store.get()),
          tabindex,
          act: () => (tile ? store.run(takeAway, tile.slot) : store.run(putBeside, kept, number)),
        })}
      </li>`;
    };
    return html`<ol class="strip" aria-label="Earlier states of the material" @keydown=${onKey}>
      ${repeat(list, ({ number }) => number, picture)}
    </ol>`;
  };
}
