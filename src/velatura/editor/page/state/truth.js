// The truth on the right of a split picture: Python's random walk, a few samples at a time, until there are enough.

import { decode, sent } from '../arrays.js';
import { isPaired } from './compared.js';
import { documentOf } from './material.js';

const PAUSE = 600; // milliseconds without a change, after which it is asked for
const SAMPLES = 4; // per pixel of one call
const PASSES = 32;
const LONGEST = 360; // pixels along a side

/** Follows a store while its view asks for the truth; `files` knows what was dropped; `onProblem(error)` with null where there is none. */
export function followTruth({ store, viewport, call, files, onProblem }) {
  let wanted = null; // what is being computed
  let timer = null;

  function update(state = store.get()) {
    const question = questionOf(state, viewport);
    const text = question && JSON.stringify(question);
    if (text === wanted) return;
    clearTimeout(timer);
    wanted = text;
    viewport.setTruth(question && { samples: 0 });
    if (!question) return onProblem(null);
    timer = setTimeout(add, PAUSE);
  }

  async function add() {
    const question = questionOf(store.get(), viewport); // the camera may have come to its place since
    if (!question) return;
    const text = (wanted = JSON.stringify(question));
    let sum = null;
    try {
      const { object, environment, lights } = question, isOwn = files.isDropped(environment);
      const light = lights.length || isOwn ? await sent(viewport.lighting) : undefined;
      const shot = { ...question, environment: isOwn ? undefined : environment, mesh: await files.meshOf(object), light };
      for (let seed = 1; seed <= PASSES; seed++) {
        const { picture } = await call('truth', { ...shot, spp: SAMPLES, seed });
        if (text !== wanted) return;
        const { array, shape } = decode(picture);
        sum = sum ? sum.map((value, index) => value + array[index]) : array;
        const data = sum.map((value) => value / seed);
        viewport.setTruth({ width: shape[1], height: shape[0], data, samples: seed * SAMPLES });
      }
      onProblem(null);
    } catch (error) {
      if (text === wanted) onProblem(error);
    }
  }

  const stops = [store.subscribe(update), viewport.onCamera(() => update())];
  update();
  return {
    again() {
      wanted = null;
      update();
    },
    stop() {
      clearTimeout(timer);
      wanted = null;
      stops.forEach((stop) => stop());
    },
  };
}

/** What Python is asked, or null while the view does not ask for the truth. */
function questionOf(state, { canvas, camera }) {
  const { object, environment, lights = [], rotation, other } = state.view;
  if (!isPaired(state.view) || !other?.truth) return null;
  const scale = Math.min(1, LONGEST / Math.max(canvas.width, canvas.height));
  const size = [canvas.width, canvas.height].map((length) => Math.max(1, Math.round(length * scale)));
  const { model, switches } = state;
  return { material: documentOf(state), model, switches, object, environment, lights, rotation, camera: state.camera ?? camera, size };
}
