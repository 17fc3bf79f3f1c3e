// Textures whose texels stand for other values.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { throughCurve } from '../../src/velatura/editor/page/render/curve.js';

test('texels become values between those of the curve', () => {
  const found = throughCurve(new Uint8Array([0, 51, 255, 102]), [0, 0.25, 1], 'linear');
  const expected = [0, 0.1, 1, 0.2];
  expected.forEach((value, k) => assert.ok(Math.abs(found[k] - value) < 1e-6, `${k}`));
});

test('colours are decoded, and opacity is not', () => {
  const found = throughCurve(new Uint8Array([188, 188, 188, 188]), [0, 2], 'srgb');
  assert.ok(Math.abs(found[0] - 1.006) < 1e-3);
  assert.ok(Math.abs(found[3] - 2 * (188 / 255)) < 1e-6);
});
