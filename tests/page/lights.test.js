// Lights added to a picture of the light from all around.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { mirrored, withLights } from '../../src/velatura/editor/page/render/lights.js';

const GREY = { width: 4, height: 2, data: new Float32Array(24).fill(0.5) };
const LIGHT = { azimuth: 90, elevation: 30, size: 40, strength: 8, colour: [1, 0.5, 0] };

/** The sum over all directions of what a channel has above `less`, times the direction's solid angle. */
function flux({ width, height, data }, channel, less) {
  let sum = 0;
  for (let y = 0; y < height; y++) {
    const area = ((2 * Math.PI) / width) * (Math.PI / (height - 1)) * Math.sin((Math.PI * y) / (height - 1));
    for (let x = 0; x < width; x++) sum += area * (data[3 * (y * width + x) + channel] - less);
  }
  return sum;
}

test('a light sends its radiance from its solid angle, around its middle', () => {
  const picture = withLights(GREY, [LIGHT]);
  const expected = 8 * 2 * Math.PI * (1 - Math.cos(Math.PI / 9));
  [1, 0.5, 0].forEach((share, channel) => assert.ok(Math.abs(flux(picture, channel, 0.5) - share * expected) < 0.003 * expected));
  // In Mitsuba's pictures +z is in the middle, and +x, which is at 90 degrees, left of it
  const { width, height, data } = picture, row = Math.round((height - 1) / 3), column = Math.round(width / 4);
  assert.ok(Math.abs(data[3 * (row * width + column)] - 8.5) < 1e-5);
  assert.ok(Math.abs(data[3 * (row * width + 3 * column)] - 0.5) < 1e-5);
});

test('lights add up, and without any a picture is as it was', () => {
  assert.equal(withLights(GREY, []), GREY);
  const twice = withLights(GREY, [LIGHT, LIGHT]), once = withLights(GREY, [LIGHT]);
  assert.ok(Math.abs(flux(twice, 0, 0.5) - 2 * flux(once, 0, 0.5)) < 1e-4);
  assert.ok(GREY.data.every((value) => value === 0.5));
});

test('a highlight is placed where the eye is mirrored, in the picture of the light as it is turned', () => {
  const [slope] = [Math.SQRT1_2];
  assert.deepEqual(mirrored({ normal: [0, 0, 1], ray: [0, 0, -1] }, 0), { azimuth: 0, elevation: 0 });
  assert.deepEqual(mirrored({ normal: [slope, 0, slope], ray: [0, 0, -1] }, 0), { azimuth: 90, elevation: 0 });
  assert.deepEqual(mirrored({ normal: [slope, 0, slope], ray: [0, 0, -1] }, 30), { azimuth: 60, elevation: 0 });
  assert.equal(mirrored({ normal: [0, 2 * slope, 2 * slope], ray: [0, 0, -1] }, 0).elevation, 90); // of any length
});
