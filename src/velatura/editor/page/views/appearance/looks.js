// Lobes of a target: their colours, and the same lobes with others.

import { mean } from '../plots/scale.js';

export const DARKEST = 1e-4; // mean energy that a hand can give a lobe

/** A lobe's colour alone: as bright as can be. */
export function hue({ energy }) {
  const most = Math.max(...energy);
  return most > 0 ? energy.map((channel) => channel / most) : [0, 0, 0];
}

/** The energies of another mean, of the same hue as far as none exceeds 1. */
export function withMean(energy, wanted) {
  const now = mean(energy);
  const scaled = now > 0 ? energy.map((channel) => (channel * wanted) / now) : energy.map(() => wanted);
  const most = Math.max(1, ...scaled);
  return scaled.map((channel) => channel / most);
}

/** Roughness along both axes of a lobe. */
export const axesOf = ({ alpha }) => (Array.isArray(alpha) ? alpha : [alpha, alpha]);

/** One roughness for both axes of a lobe. */
export const blurOf = (lobe) => Math.hypot(...axesOf(lobe)) * Math.SQRT1_2;

/** A lobe's roughness where that of both axes together is another one, as far as none exceeds 1. */
export function withBlur(lobe, wanted) {
  if (!Array.isArray(lobe.alpha)) return wanted;
  const scale = Math.min(wanted / blurOf(lobe), 1 / Math.max(...lobe.alpha));
  return lobe.alpha.map((alpha) => alpha * scale);
}

/** The target with changes of one lobe; what was fixed of it holds no more where its interfaces are others. */
export function changed(target, index, changes) {
  const other = 'interfaces' in changes || 'base' in changes;
  const lobes = target.lobes.map((lobe, place) =>
    place === index ? { ...lobe, ...changes, ...(other && { fixed: {} }) } : lobe,
  );
  return { ...target, lobes };
}

/** Which lobe a sentence is about, and the sentence: "lobe 2: why". */
export function about(text) {
  const [, number, words] = text.match(/^lobe (\d+): (.*)$/s) ?? [];
  return number ? { lobe: Number(number) - 1, text: words } : { lobe: null, text };
}
