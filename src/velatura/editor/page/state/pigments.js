// Pigments: Kubelka and Munk's coefficients K and S, those of the medium that they make, and the colour of a thick layer.

const each = (f, ...values) => {
  const channels = values.map((value) => (Array.isArray(value) ? value : [value, value, value]));
  const found = [0, 1, 2].map((k) => rounded(f(...channels.map((channel) => channel[k]))));
  return values.some(Array.isArray) ? found : found[0];
};
const rounded = (number) => Number(number.toPrecision(8));
const isPlain = (value) => typeof value === 'number' || Array.isArray(value);

/** Whether K and S of a pigment are numbers or colours. */
export const isKnown = ({ K, S }) => isPlain(K) && isPlain(S);

/** The pigment of a medium, by the relations of velatura.stack.pigments; none where its coefficients are no numbers. */
export const pigmentOf = (a, s, g) => ({
  K: isPlain(a) ? each((x) => 2 * x, a) : 0,
  S: isPlain(s) ? each((x) => 0.75 * (1 - g) * x, s) : 0,
});

/** Absorption and scattering of a medium of pigments: `{sigma_a, sigma_s}`, without any where these are not all known. */
export function coefficientsOf(pigments, g = 0) {
  if (!pigments.every(isKnown)) return {};
  const total = (key) => pigments.map(({ concentration: c = 1, ...own }) => each((x) => c * x, own[key])).reduce((a, b) => each((x, y) => x + y, a, b));
  return { sigma_a: each((x) => x / 2, total('K')), sigma_s: each((x) => (4 * x) / (3 * (1 - g)), total('S')) };
}

/** The reflectance of a layer of a pigment that nothing shines through, without a surface (Kubelka and Munk 1931). */
export const masstone = ({ K, S }) =>
  each((k, s) => (s > 0 ? 1 + k / s - Math.sqrt((k / s) ** 2 + (2 * k) / s) : k > 0 ? 0 : 1), K, S);

const DARKEST = 1e-3; // reflectance that K is found for

/** K of a pigment that has a reflectance as its masstone, and its S. */
export const absorptionFor = (reflectance, S) => each((r, s) => (s * (1 - Math.max(r, DARKEST)) ** 2) / (2 * Math.max(r, DARKEST)), reflectance, S);
