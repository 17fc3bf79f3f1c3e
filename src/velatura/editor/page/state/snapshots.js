// The history of the material in pictures: each state that was left alone for a while, to return to.

import { keptOf } from './compared.js';
import { coversOf, enabled, leavesOf, treeOf, weightsOf } from './material.js';

const MOST = 40;
const SIZE = [144, 108]; // pixels of a picture
const RESTED = 300; // milliseconds that a preview must have been there
const CLEAR = 16; // samples from which on a picture is not taken again

/** What decides about the picture of a material, as text. */
export function lookOf(state) {
  const ofLayer = ({ kind, keys }) => [kind, Object.entries(keys).sort()];
  const stacks = leavesOf(state).map(({ prefix, thin, layers }) => [prefix, thin, enabled({ layers }).map(ofLayer)]);
  const weights = weightsOf(treeOf(state) ?? []);
  return JSON.stringify([state.exterior, stacks, weights, coversOf(state), state.model, Object.entries(state.switches).sort()]);
}

/**
 * Follows a store: `{look, list, current}`. `look()`, called now and then, takes the picture of a state that has settled;
 * `list` holds `{number, look, kept, picture, samples}`, the latest last, `picture` as an address; `current()` is the one
 * that is open, if any.
 */
export function createSnapshots({ store, viewport, picture, storage, onChange }) {
  let list = storage.snapshots();
  let known = { state: null, look: '' };

  /** The look of the open material, worked out once for a state. */
  function look() {
    const state = store.get();
    if (known.state !== state) known = { state, look: lookOf(state) };
    return known.look;
  }

  const current = () => list.find((snapshot) => snapshot.look === look());

  /** Whether the viewport shows the whole of the open material, and nothing is on its way. */
  function isSettled() {
    const drawn = picture.given('a');
    const { view } = store.get();
    return (
      !viewport.lost && !store.dragging && view.lobe === null && picture.quiet && viewport.rested(RESTED) &&
      drawn && (drawn === store.get() || lookOf(drawn) === look())
    );
  }

  return {
    current,
    get list() {
      return list;
    },
    look() {
      const found = current();
      const { samples } = viewport;
      if (found && (found.samples >= CLEAR || samples < CLEAR)) return;
      if (!isSettled()) return;
      const taken = { picture: viewport.snapshot(...SIZE), samples };
      if (found) {
        list = list.map((snapshot) => (snapshot === found ? { ...snapshot, ...taken } : snapshot));
      } else {
        const number = (list.at(-1)?.number ?? 0) + 1;
        list = [...list, { number, look: look(), kept: keptOf(store.get()), ...taken }].slice(-MOST);
      }
      storage.keepSnapshots(list);
      onChange();
    },
  };
}
