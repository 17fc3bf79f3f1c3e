// The common part of plots: round numbers for ticks, numbers as text, styles of lines.

const LOOKS = 6;

/** The class of what belongs to a part of the light. */
export const lookOf = (k) => `part-${k % LOOKS}`;

/** About `count` round numbers from low to high. */
export function ticks(low, high, count = 5) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999) * power;
  const first = Math.ceil(low / step - 1e-6);
  const last = Math.floor(high / step + 1e-6);
  return Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step);
}

/** A round number not below the highest value. */
export function roundUp(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 1.5, 2, 3, 4, 5, 6, 8, 10].find((factor) => factor * power >= value * 0.999) * power;
}

/** A number as a read-out has it: three digits that count. */
export function shown(value) {
  if (!Number.isFinite(value)) return '–';
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-4) return value.toExponential(1).replace('e+', 'e');
  return size >= 100 ? value.toFixed(0) : Number(value.toPrecision(3)).toString();
}

/** A colour as a read-out has it: one number where its channels agree. */
export function shownColour(colour) {
  const texts = colour.map(shown);
  return texts.every((text) => text === texts[0]) ? texts[0] : texts.join(' ');
}

export const mean = (colour) => colour.reduce((sum, value) => sum + value, 0) / colour.length;

/** Whether a colour is grey, to the eye. */
export const isGrey = (colour) => Math.max(...colour) - Math.min(...colour) < 0.01 * Math.max(...colour, 1e-6);

/** The number of the item of a sorted list that is nearest. */
export function nearest(list, value) {
  let best = 0;
  list.forEach((item, i) => (best = Math.abs(item - value) < Math.abs(list[best] - value) ? i : best));
  return best;
}
