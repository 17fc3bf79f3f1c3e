// The parts of the page that are open, and the sizes in pixels that hands have given; a browser remembers it.

const LAYOUT = { history: true, look: false, view: false, model: false, expert: false, lookHeight: null, panelWidth: null };

/** `{layout, arrange(changes)}`; `update` is called after a change. */
export function createLayout(storage, update) {
  const layout = { ...LAYOUT, ...storage.layout() };
  return {
    layout,
    arrange(changes) {
      Object.assign(layout, changes);
      storage.keepLayout(layout);
      update();
    },
  };
}
