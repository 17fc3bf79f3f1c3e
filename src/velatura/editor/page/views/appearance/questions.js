// Questions to Python under the hand: one at a time, and after it the latest.

/** How to ask: over the open line where there is one. */
export const asker =
  ({ live, call }) =>
  (verb, body) =>
    live?.online ? live.ask(verb, body) : call(verb, body);

/** Does one thing after the other; while one is done, only the latest of those asked for waits. Then it may `rest`. */
export function oneAtATime(act, rest) {
  let waiting = null;
  let busy = false;

  async function work() {
    busy = true;
    try {
      while (waiting) {
        const next = waiting;
        waiting = null;
        await act(next);
      }
    } finally {
      busy = false;
      if (waiting) work();
      else rest();
    }
  }

  return {
    want(next) {
      waiting = next;
      return busy ? null : work();
    },
    get busy() {
      return busy;
    },
  };
}
