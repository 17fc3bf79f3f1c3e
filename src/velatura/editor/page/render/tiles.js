// Pictures of the same view side by side on one canvas.

const GAP = 2; // pixels between two

/** Columns and rows of so many pictures. */
export const tiling = (count) => (count < 4 ? [count, 1] : [2, 2]);

/** The size of one of `count` pictures on a canvas, in whole pixels. */
export function tileSize(count, { width, height }) {
  const along = (length, parts) => Math.max(1, Math.floor((length - GAP * (parts - 1)) / parts));
  const [columns, rows] = tiling(count);
  return { width: along(width, columns), height: along(height, rows) };
}

/** The lower left corner of one of them, by its place: line by line, from the upper left. */
export function tileCorner(place, count, canvas) {
  const [columns] = tiling(count), { width, height } = tileSize(count, canvas);
  const row = Math.floor(place / columns);
  return [(place % columns) * (width + GAP), canvas.height - height - row * (height + GAP)];
}
