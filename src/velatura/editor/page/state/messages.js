// Messages of the page: problems, until their cause is gone, and the last action.

import { Offline } from '../connection.js';

const READ = 12000; // milliseconds until a passing message, or a note, has been read

/** Messages; `changed` is called after every change of them. Notes and passing problems go by themselves. */
export function createMessages(changed) {
  const problems = new Map(); // by what they are about
  let note = '';

  const messages = {
    /** Reports a problem until it is forgiven, or the next action (`passing`), or the server is back (`away`). */
    complain(about, text, { layer = null, actions = [], passing = false, away = false } = {}) {
      const problem = { text, layer, actions, passing, away };
      problems.delete(about); // the latest comes last
      problems.set(about, problem);
      if (passing) setTimeout(() => problems.get(about) === problem && messages.forgive(about), READ);
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
    /** Withdraws all problems that are `passing`, or `away`. */
    forgiveAll(kind) {
      for (const [about, problem] of problems) if (problem[kind]) messages.forgive(about);
    },
    /** Performs an action, and reports its failure. */
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
      setTimeout(() => {
        if (note !== text) return;
        note = '';
        changed();
      }, READ);
    },
    /** An action was done: messages about earlier ones end, and are not redrawn for that alone. */
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
