// What the page says: what is wrong, until its cause has gone, and what was done last.

import { Offline } from '../connection.js';

/** Messages; `changed` is called after every change of them. */
export function createMessages(changed) {
  const problems = new Map(); // by what they are about
  let note = '';

  const messages = {
    /** Says what is wrong: until it is forgiven, what is `passing` until anything is done, and `away` until the server is back. */
    complain(about, text, { layer = null, actions = [], passing = false, away = false } = {}) {
      problems.delete(about); // the latest comes last
      problems.set(about, { text, layer, actions, passing, away });
      changed();
    },
    /** The same of an act that has failed. */
    fail(about, error) {
      const away = error instanceof Offline;
      messages.complain(about, error.message, { away, passing: !away });
    },
    forgive(about) {
      if (problems.delete(about)) changed();
    },
    /** What is no longer wrong: of all that is `passing`, or `away`. */
    forgiveAll(kind) {
      for (const [about, problem] of problems) if (problem[kind]) messages.forgive(about);
    },
    /** Does what may fail, and says so in words. */
    async attempt(about, act) {
      try {
        await act();
        messages.forgive(about);
      } catch (error) {
        messages.fail(about, error);
      }
    },
    say(text) {
      note = text;
      changed();
    },
    /** Something was done: what was said of acts before is over, and is not drawn again for that alone. */
    done() {
      messages.forgiveAll('passing');
      note = '';
    },
    get note() {
      return note;
    },
    /** The latest last. */
    get problems() {
      return [...problems].map(([about, problem]) => ({ about, ...problem }));
    },
    problemOf: (layer) => messages.problems.find((problem) => problem.layer === layer)?.text,
  };
  return messages;
}
