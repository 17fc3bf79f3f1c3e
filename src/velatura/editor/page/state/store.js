// The state and its history: commands are pure functions, and a drag is one step.

const STEPS = 200;

/** A command, with the title that undo shows. */
export const titled = (title, command) => Object.assign(command, { title });

/**
 * @param {object} present the state to begin with
 * @param {{past?: object[], future?: object[], outside?: string[]}} history steps, nearest last, each
 *   `{state, title}`; `outside` names the keys of the state that undoing leaves as they are
 */
export function createStore(present, { past = [], future = [], outside = [] } = {}) {
  const listeners = new Set();
  let dragged = null;

  const kept = () => Object.fromEntries(outside.map((key) => [key, present[key]]));

  function become(state) {
    present = state;
    for (const listener of listeners) listener(present);
  }

  function step(key, command, args) {
    const state = command(present, ...args);
    if (state === present) return;
    if (key === null || key !== dragged)
      past = [...past, { state: present, title: command.title }].slice(-STEPS);
    future = [];
    dragged = key;
    become(state);
  }

  /** Takes the last step of `from` back, and puts its inverse on top of `to`. */
  function exchanged(from, to) {
    const { state, title } = from.at(-1);
    dragged = null;
    return [{ ...state, ...kept() }, from.slice(0, -1), [...to, { state: present, title }]];
  }

  return {
    get: () => present,
    subscribe(listener) {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },

    run: (command, ...args) => step(null, command, args),
    /** Like `run`, but one step together with the preceding drag by the same key. */
    drag: (key, command, ...args) => step(key, command, args),
    /** The drag is over: the next one is a step of its own. */
    release: () => (dragged = null),
    /** A change that is no step: of a camera, or of the version on disk. */
    aside(command, ...args) {
      const state = command(present, ...args);
      if (state !== present) become(state);
    },

    undo() {
      if (!past.length) return;
      let state;
      [state, past, future] = exchanged(past, future);
      become(state);
    },
    redo() {
      if (!future.length) return;
      let state;
      [state, future, past] = exchanged(future, past);
      become(state);
    },
    get canUndo() {
      return past.length > 0;
    },
    get canRedo() {
      return future.length > 0;
    },
    /** The titles of the next undo, and of the next redo. */
    get undoes() {
      return past.at(-1)?.title ?? '';
    },
    get redoes() {
      return future.at(-1)?.title ?? '';
    },
    get dragging() {
      return dragged !== null;
    },
    history: () => ({ present, past, future }),
  };
}
