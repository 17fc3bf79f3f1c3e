// Answers in the files of a static folder, as velatura/editor/packing.py writes them.

import { through } from './state/share.js';

const BREAK = 10; // of the line after which arrays lie

/** The answer in the bytes of a file; its arrays have their planes in these bytes. */
export async function unpacked(file) {
  const bytes = await through(new DecompressionStream('gzip'), file), line = bytes.indexOf(BREAK);
  const text = new TextDecoder().decode(line < 0 ? bytes : bytes.subarray(0, line));
  return JSON.parse(text, (_, value) => {
    if (value?.planes) return withPlanes(value, bytes.subarray(line + 1));
    return value?.steps && value.constants ? absolute(value) : value;
  });
}

const withPlanes = ({ planes: [begin, size], ...array }, bytes) => ({ ...array, planes: bytes.subarray(begin, begin + size) });

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
