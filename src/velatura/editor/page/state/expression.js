// A number as hands write it: arithmetic, percent, and units, read by a grammar of five rules.
//
//   sum = product {(+|-) product}   product = factor {(*|/) factor}   factor = {+|-} value [% | unit]
//   value = number | ( sum )

const LONGEST = 64; // characters, which bounds how deep parentheses lie in one another
const TOKEN = /\s*(?:(\d+(?:[.,]\d*)?(?:e[+-]?\d+)?|[.,]\d+(?:e[+-]?\d+)?)|([a-zµμ°]+)|([-+*/()%]))/iy;

const LENGTHS = { m: 1, cm: 1e-2, mm: 1e-3, um: 1e-6, µm: 1e-6, μm: 1e-6, nm: 1e-9 }; // metres
const ANGLES = { deg: 1, '°': 1, rad: 180 / Math.PI, turn: 360 }; // degrees

/** What a parameter's unit takes, relative to it; a plain length is millimetres. */
const SIZES = {
  length: relative(LENGTHS, LENGTHS.mm),
  nm: relative(LENGTHS, LENGTHS.nm),
  micrometres: relative(LENGTHS, LENGTHS.um),
  degrees: ANGLES,
};

function relative(units, one) {
  return Object.fromEntries(Object.entries(units).map(([name, size]) => [name, size / one]));
}

/** The number that a text stands for in a unit of the schema; NaN where it stands for none. */
export function evaluated(text, unit = '') {
  const tokens = tokensOf(text);
  if (!tokens?.length) return NaN;
  const sizes = SIZES[unit] ?? {};
  let at = 0;
  const take = (...wanted) => (wanted.includes(tokens[at]) ? tokens[at++] : null);

  function sum() {
    let found = product();
    for (let sign; (sign = take('+', '-'));) found += (sign === '+' ? 1 : -1) * product();
    return found;
  }

  function product() {
    let found = factor();
    for (let sign; (sign = take('*', '/'));) found *= sign === '*' ? factor() : 1 / factor();
    return found;
  }

  function factor() {
    let sign = 1;
    for (let found; (found = take('+', '-'));) sign *= found === '-' ? -1 : 1;
    const number = sign * value();
    if (take('%')) return number / 100;
    return Object.hasOwn(sizes, tokens[at] ?? '') ? number * sizes[tokens[at++]] : number;
  }

  function value() {
    if (typeof tokens[at] === 'number') return tokens[at++];
    if (!take('(')) return NaN;
    const found = sum();
    return take(')') ? found : NaN;
  }

  const found = sum();
  return at === tokens.length ? found : NaN;
}

/** Numbers, signs and words of a text; null where it has others. */
function tokensOf(text) {
  if (text.length > LONGEST) return null;
  const tokens = [], written = text.trim();
  TOKEN.lastIndex = 0;
  while (TOKEN.lastIndex < written.length) {
    const found = TOKEN.exec(written);
    if (!found) return null;
    const [, number, word, sign] = found;
    tokens.push(number ? Number(number.replace(',', '.')) : word?.toLowerCase() ?? sign);
  }
  return tokens;
}
