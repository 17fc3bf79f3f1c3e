// Makes ready what may come next, while nobody does anything: the code for one more layer.

import { addLayer } from './commands.js';
import { documentOf, enabled, pattern } from './material.js';

const PAUSE = 1000; // milliseconds between two looks at whether there is time
const ENOUGH = 1; // samples, after which the picture can wait

/** Follows a store: `{stop()}`; `drawn` tells the shape that the picture has. */
export function lookAhead({ store, viewport, call, drawn }) {
  let ready = ''; // the shape that all is ready for
  let timer = setTimeout(look, PAUSE);

  async function look() {
    const state = store.get();
    const shape = JSON.stringify([pattern(state), state.model, state.switches]);
    if (shape !== ready && shape === drawn() && viewport.samples >= ENOUGH && !viewport.held) {
      ready = shape;
      await prepare(state, 'interface');
      // No medium lies on another
      if (enabled(state)[0].kind !== 'medium') await prepare(state, 'medium');
    }
    if (timer !== null) timer = setTimeout(look, PAUSE);
  }

  async function prepare(state, kind) {
    const { model, switches } = state;
    try {
      const shader = await call('shader', { material: documentOf(addLayer(state, kind)), model, switches });
      if (store.get() === state) await viewport.prepare(shader);
    } catch {
      // Whoever does add the layer is told why it cannot be
    }
  }

  return {
    stop() {
      clearTimeout(timer);
      timer = null;
    },
  };
}
