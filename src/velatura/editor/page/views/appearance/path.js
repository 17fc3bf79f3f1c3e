// Members along a path through a class, from one end of it to the other.

const COUNT = 5;

/** The members to be shown: {place} on the map, or {tint}; none where there is nothing to choose. */
export function pathOf(card) {
  if (card.kind === 'mirror') return [];
  if (card.kind === 'conductor') return tints();
  const found = [...across(card)];
  if (found.length > 1) return found.map((place) => ({ place }));
  return card.conductor ? tints() : [];
}

/** Of a conductor: all tints, the rest of the member unchanged. */
const tints = () => Array.from({ length: COUNT }, (_, n) => ({ tint: n / (COUNT - 1) }));

/** From the lowest first index to the highest, each with the second nearest to the member's. */
function* across({ axes, cells, member }) {
  const [rows, columns] = cells.shape;
  const valueOf = ({ low, high, values }, index, count) =>
    values ? values[index] : low + ((high - low) * index) / Math.max(count - 1, 1);
  const rowsIn = (column) =>
    Array.from({ length: rows }, (_, row) => row).filter((row) => cells.feasible[row * columns + column]);
  const open = Array.from({ length: columns }, (_, column) => column).filter((column) => rowsIn(column).length);
  if (open.length < 2) return;
  for (let n = 0; n < COUNT; n++) {
    const column = open[Math.round(((open.length - 1) * n) / (COUNT - 1))];
    const first = valueOf(axes[0], column, columns);
    if (!axes[1]) {
      yield [first];
      continue;
    }
    const away = (row) => Math.abs(valueOf(axes[1], row, rows) - member[1]);
    const row = rowsIn(column).reduce((best, other) => (away(other) < away(best) ? other : best));
    yield [first, valueOf(axes[1], row, rows)];
  }
}
