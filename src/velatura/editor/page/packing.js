// Answers in the files of a static folder, as velatura/editor/packing.py writes them.

import { through } from './state/share.js';

/** The answer in the bytes of a file. */
export async function unpacked(bytes) {
  const text = new TextDecoder().decode(await through(new DecompressionStream('gzip'), bytes));
  return JSON.parse(text, (_, value) => (value?.steps && value.constants ? absolute(value) : value));
}

/** A tape whose steps name others by their numbers among all values, which are negative from where they are named. */
function absolute(tape) {
  const first = tape.inputs.length + tape.constants.length;
  const steps = tape.steps.map((step, k) => step.map((x) => (x < 0 ? x + first + k : x)));
  return { ...tape, steps };
}

/** A text of numbered lines, each given as its distance from the one before. */
export function textOf(distances, lines) {
  let at = 0;
  return distances.map((distance) => lines[(at += distance)]).join('\n');
}
