// Colours that are kept for later: linear, each channel from 0 to 1; the latest first.

const MOST = 24;

const isColour = (value) => Array.isArray(value) && value.length === 3 && value.every((x) => Number.isFinite(x) && x >= 0 && x <= 1);

/** `list`, `keep(rgb)` and `forget(rgb)`, in the storage of the page. */
export function createSwatches(storage, onChange) {
  const kept = storage.swatches();
  let list = (Array.isArray(kept) ? kept : []).filter(isColour).slice(0, MOST);

  function become(next) {
    list = next.slice(0, MOST);
    storage.keepSwatches(list);
    onChange();
  }

  const others = (rgb) => list.filter((other) => String(other) !== String(rgb));
  return {
    get list() {
      return list;
    },
    keep: (rgb) => become([rgb, ...others(rgb)]),
    forget: (rgb) => become(others(rgb)),
  };
}
