// Things of a list that are dragged by their grips.

/**
 * Follows a pointer over a list and shows where the item of the grip would go; it moves when the pointer is let go.
 *
 * @param {PointerEvent} event on the grip
 * @param {string} items the selector of the items, which are in the list that the grip is in
 * @param {object} act `drop(place)`, and `over(place)`, which is called with null at the end
 */
export function followGrip(event, items, { over = () => {}, drop }) {
  if (event.button !== 0) return;
  const grip = event.currentTarget;
  const cards = [...grip.closest('ol').querySelectorAll(items)];
  const placeOf = ({ clientY }) => {
    const index = cards.findIndex((card) => clientY < card.getBoundingClientRect().bottom);
    return index < 0 ? cards.length - 1 : index;
  };
  const done = new AbortController();
  const on = (name, act) => grip.addEventListener(name, act, { signal: done.signal });
  const end = () => {
    done.abort();
    over(null);
  };
  grip.setPointerCapture(event.pointerId);
  on('pointermove', (moved) => over(placeOf(moved)));
  on('pointerup', (moved) => {
    end();
    drop(placeOf(moved));
  });
  on('pointercancel', end);
}
