// Lights of one's own in the state: {azimuth, elevation, size: their diameter, all in degrees, strength: their radiance, colour}.

import { objection } from './range.js';

export const MOST_LIGHTS = 8;
export const NEW_LIGHT = { azimuth: 45, elevation: 45, size: 20, strength: 10, colour: [1, 1, 1] };

/** The ranges and steps of their numbers. */
export const LIGHT = {
  strength: { low: 0, high: 1e6, default: NEW_LIGHT.strength, step: 0.1 },
  azimuth: { low: -360, high: 360, unit: 'degrees', default: NEW_LIGHT.azimuth, step: 1 },
  elevation: { low: -90, high: 90, unit: 'degrees', default: NEW_LIGHT.elevation, step: 1 },
  size: { low: 1, high: 180, unit: 'degrees', default: NEW_LIGHT.size, step: 1 },
};

const isWithin = (number, spec) => !objection(number, spec);
const isColour = (value) => Array.isArray(value) && value.length === 3 && value.every((channel) => isWithin(channel, { low: 0, high: 1 }));

/** Whether a value from outside is a list of lights. */
export const areLights = (value) =>
  Array.isArray(value) &&
  value.length <= MOST_LIGHTS &&
  value.every((light) => isColour(light?.colour) && Object.entries(LIGHT).every(([key, spec]) => isWithin(light[key], spec)));
