// The range of a number.

/** What is wrong with a number, in words; empty where nothing is. */
export function objection(value, { low = null, high = null, strict = false }) {
  if (!Number.isFinite(value)) return 'must be a number';
  const outside = (low !== null && value < low) || (high !== null && value > high);
  if (!outside && !(strict && (value === low || value === high))) return '';
  const ends = strict ? ', both excluded' : '';
  return high !== null
    ? `must lie in ${low} to ${high}${ends}`
    : `must be ${strict ? 'above' : 'at least'} ${low}`;
}

/** The number of a range that is nearest to another one, of six digits; undefined where its end is excluded. */
export function nearest(value, spec) {
  const found = Number(Math.max(spec.low ?? -Infinity, Math.min(spec.high ?? Infinity, value)).toPrecision(6));
  return objection(found, spec) ? undefined : found;
}
