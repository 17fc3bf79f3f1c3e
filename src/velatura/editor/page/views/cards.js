// What the cards of layers show: all parameters, none of a folded one, those that are sought, and some to experts alone.

import { html } from 'lit-html';
import { live } from 'lit-html/directives/live.js';
import { flag, iconButton } from './controls.js';
import { isCalled } from './parameter.js';

/**
 * `tools()`, a search with switches above the cards; of one card `fold(layer, name)`, its button, and `isFolded(layer)`;
 * `keysOf(layer, keys, unwanted)`, the parameters that it shows, the unwanted ones to experts; `isSought(words)` of any other row.
 */
export function createCards({ store, session, layout, arrange, update }) {
  const folded = new Set(); // ids of layers
  let sought = '';

  const seek = ({ target }) => {
    sought = target.value.trim().toLowerCase();
    update();
  };
  /** Enter goes into the first field that is found. */
  const onKey = (event) => {
    if (event.key !== 'Enter') return;
    event.target.closest('.section').querySelector('.parameters .parameter :is(input, select)')?.focus();
  };
  const foldAll = (ids) => {
    const close = ids.some((id) => !folded.has(id));
    for (const id of ids) folded[close ? 'add' : 'delete'](id);
    update();
  };
  const turn = (id) => {
    if (!folded.delete(id)) folded.add(id);
    update();
  };

  function tools() {
    const ids = store.get().layers.map(({ id }) => id), closed = ids.every((id) => folded.has(id));
    return html`<div class="tools">
      <input
        type="search"
        aria-label="Find a parameter"
        placeholder="Find a parameter"
        .value=${live(sought)}
        @input=${seek}
        @keydown=${onKey}
      />
      ${flag({
        label: 'Expert',
        value: layout.expert,
        title: 'Coefficients, too, that follow from a colour: absorption per length',
        choose: (expert) => arrange({ expert }),
      })}
      ${iconButton({
        label: closed ? 'Unfold all layers' : 'Fold all layers',
        icon: closed ? 'unfold' : 'fold',
        act: () => foldAll(ids),
      })}
    </div>`;
  }

  const fold = ({ id }, name) =>
    iconButton({
      label: `${folded.has(id) ? 'Unfold' : 'Fold'} ${name}`,
      icon: folded.has(id) ? 'unfold' : 'fold',
      expanded: !folded.has(id),
      act: () => turn(id),
    });

  const keysOf = ({ kind }, keys, unwanted = []) =>
    sought
      ? keys.filter((key) => isCalled(key, session.schema[kind][key], session.schema, sought))
      : keys.filter((key) => layout.expert || !unwanted.includes(key));

  return {
    ...{ tools, fold, keysOf },
    isFolded: ({ id }) => !sought && folded.has(id),
    isSought: (words) => words.toLowerCase().includes(sought),
  };
}
