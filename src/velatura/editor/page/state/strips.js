// The colours of interfaces over the thickness of a film, which Python works out: asked for once, and again after a change.

import { decode } from '../arrays.js';
import { Recent } from '../recent.js';

const KEPT = 64; // answers

/** `{of(place, question)}`; `update` is called when an answer has come, and `lacks` says why there are none, or ''. */
export function createStrips({ call, lacks, update }) {
  const kept = new Recent(KEPT); // answers by question, null where there is none
  const shown = new Map(); // by place, the colours that were found last
  const wanted = new Map(); // by place, the question to be asked next
  let busy = false;

  async function ask() {
    if (busy) return;
    busy = true;
    while (wanted.size) {
      const [[place, text]] = wanted;
      wanted.delete(place);
      try {
        const { array } = decode((await call('film', JSON.parse(text))).colours);
        kept.set(text, Array.from({ length: array.length / 3 }, (_, k) => [...array.subarray(3 * k, 3 * k + 3)]));
      } catch {
        kept.set(text, null); // the reason is shown on the card
      }
      update();
    }
    busy = false;
  }

  return {
    /** The colours of a film at a place of the page, by the body of call('film'); those before while Python is asked. */
    of(place, question) {
      if (lacks('film')) return null;
      const text = JSON.stringify(question), known = kept.get(text);
      if (known === undefined) {
        wanted.set(place, text);
        ask();
      } else {
        wanted.delete(place);
        shown.set(place, known);
      }
      return shown.get(place) ?? null;
    },
  };
}
