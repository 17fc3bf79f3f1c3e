// Sobol points, as the shader scrambles them (directions: Joe and Kuo 2008).

/** Per dimension from the third on: the coefficients of its polynomial, and the first directions. */
const POLYNOMIALS = [
  [1, [1, 3]],
  [1, [1, 3, 1]],
  [2, [1, 1, 1]],
  [1, [1, 1, 3, 3]],
  [4, [1, 3, 5, 13]],
  [2, [1, 1, 5, 5, 17]],
  [4, [1, 1, 5, 5, 5]],
  [7, [1, 1, 7, 11, 19]],
  [11, [1, 1, 5, 1, 1]],
  [13, [1, 1, 1, 3, 11]],
];

/** How many numbers of a path are a point's, its place within the pixel aside; all others are independent. */
export const DIMENSIONS = POLYNOMIALS.length;

const DIRECTIONS = [Array.from({ length: 32 }, (_, k) => (1 << (31 - k)) >>> 0)]
  .concat([directions(0, [1])])
  .concat(POLYNOMIALS.map(([coefficients, first]) => directions(coefficients, first)));

function directions(coefficients, first) {
  const degree = first.length;
  const found = first.map((m, k) => (m << (31 - k)) >>> 0);
  for (let k = degree; k < 32; k++) {
    let next = found[k - degree] ^ (found[k - degree] >>> degree);
    for (let j = 1; j < degree; j++) if ((coefficients >> (degree - 1 - j)) & 1) next ^= found[k - j];
    found.push(next >>> 0);
  }
  return found;
}

/**
 * A sample's place within the pixel, and further coordinates for its path: 32 bits each, the last one first,
 * for the shader to scramble.
 */
export function sobol(number) {
  const [x, y, ...others] = DIRECTIONS.map((columns) => coordinate(columns, number));
  const within = [x, y].map((bits) => (bits / 2 ** 32 + 0.5) % 1);
  return { within, sobol: Uint32Array.from(others, reversed) };
}

function coordinate(columns, number) {
  let bits = 0;
  for (let k = 0; k < 32; k++) if ((number >>> k) & 1) bits ^= columns[k];
  return bits >>> 0;
}

function reversed(number) {
  let bits = 0;
  for (let k = 0; k < 32; k++) bits = (bits << 1) | ((number >>> k) & 1);
  return bits >>> 0;
}
