// Parts of the object, each of which one part of a mixture covers.

const GROUP = 4; // numbers of a vector
export const MOST_PARTS = 32; // of an object

/** The number of the part of a mixture that a stack is in. */
const partOf = ({ prefix }) => Number(prefix.match(/^part(\d+)_/)[1]);

/**
 * `on_part(l, number)`: the lobes on a part of the object. Where a part of the mixture covers it, the shares of its stacks
 * are divided by their sum, and those of others are 0.
 */
export function covering({ parts }) {
  const shared = parts.filter(({ share }) => share);
  if (!shared.length) return 'VtLobes on_part(VtLobes l, int number) { return l; }';
  const shareOf = (part) => {
    const own = shared.filter((other) => partOf(other) === partOf(part)).map(({ share }) => `l.${share}`);
    const whole = own.length > 1 ? `l.${part.share} / max(${own.join(' + ')}, 1e-6)` : '1.0';
    return `l.${part.share} = one == ${partOf(part)} ? ${whole} : 0.0;`;
  };
  return `
uniform ivec4 covers[${MOST_PARTS / GROUP}]; // by part of the object: the number of the mixture's part, from 1 on, or 0
VtLobes on_part(VtLobes l, int number) {
  int one = covers[number / ${GROUP}][number % ${GROUP}] - 1;
  if (one < 0) return l;
  ${shared.map(shareOf).join('\n  ')}
  return l;
}
`;
}
