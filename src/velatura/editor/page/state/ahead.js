// Prepares possible next states while there is no input: one more layer of each kind, and other values of a solved one.

import { addLayer } from './commands.js';
import { documentOf, pattern } from './material.js';

const PAUSE = 500; // milliseconds between two looks at whether there is time

/** Follows a store: `{quiet, stop()}`; `drawn` returns the shape that the picture has. */
export function lookAhead({ store, viewport, call, lacks, session, drawn }) {
  const added = Object.entries(session.layers).map(([kind, { fresh }]) => [kind, fresh]);
  let ready = ''; // the shape that all is ready for
  let busy = false;
  let timer = setTimeout(look, PAUSE);

  async function look() {
    const state = store.get();
    const shape = JSON.stringify([pattern(state), state.model, state.switches]);
    if (shape !== ready && shape === drawn() && viewport.idle) {
      ready = shape;
      busy = true;
      if (lacks('values')) await prepare(state, state, { coarse: true });
      for (const layer of added) if (store.get() === state) await prepare(state, addLayer(state, ...layer));
      busy = false;
    }
    if (timer !== null) timer = setTimeout(look, PAUSE);
  }

  async function prepare(state, next, wishes) {
    const { model, switches } = state;
    try {
      const shader = await call('shader', { material: documentOf(next), model, switches, ...wishes });
      if (store.get() === state) await viewport.prepare(shader);
    } catch {
      // The reason is shown when the layer is added
    }
  }

  return {
    get quiet() {
      return !busy;
    },
    stop() {
      clearTimeout(timer);
      timer = null;
    },
  };
}
