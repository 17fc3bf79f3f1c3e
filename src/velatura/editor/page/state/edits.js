// Values being edited: a drag changes them at once, and is one step when it is released.

const SETTLED = 400; // milliseconds after which a value that is no longer moved counts as set

/**
 * `{drag, settle, of, stop}` for a store; the viewport draws in fewer pixels while something is dragged. `colours` is what controls of
 * colours offer: `{swatches, pick}`.
 */
export function createEdits({ store, viewport, messages, colours = null }) {
  let settling = null;

  const edits = {
    /** A change that belongs to one step with those before it, until `settle`. */
    drag(key, command, ...args) {
      clearTimeout(settling);
      viewport.moving(true);
      store.drag(key, command, ...args);
    },
    settle() {
      clearTimeout(settling);
      settling = setTimeout(() => {
        store.release();
        viewport.moving(false);
      }, SETTLED);
    },
    /**
     * What a control does with new values of one thing: `act(value)` is [command, ...args], `key` names what is dragged,
     * and what is refused is said `about` it, on the card of a `layer`.
     */
    of: (key, act, about, layer = null) => ({
      move: (value) => edits.drag(key, ...act(value)),
      set: (value) => store.run(...act(value)),
      settle: edits.settle,
      colours,
      refuse: (text) => messages.complain(about, text, { layer, passing: true }),
    }),
    stop: () => clearTimeout(settling),
  };
  return edits;
}
