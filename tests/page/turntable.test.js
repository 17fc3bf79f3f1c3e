// Views and names of the frames of a turntable.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { frameNames, turned } from '../../src/velatura/editor/page/state/turntable.js';

const VIEW = { camera: { origin: [0, 1, 2], target: [0, 1, 0], fov: 20 }, rotation: 30 };
const near = (found, expected) => found.forEach((x, i) => assert.ok(Math.abs(x - expected[i]) < 1e-12, `${found}`));

test('a quarter of a turn brings a camera from the front to the right, and what turns instead to the same view', () => {
  const camera = turned(VIEW, 'camera', 0.25);
  near(camera.camera.origin, [2, 1, 0]);
  assert.equal(camera.rotation, 30);
  // An object that turns is seen as from a camera that goes the other way, and light comes along
  const object = turned(VIEW, 'object', 0.25);
  near(object.camera.origin, [-2, 1, 0]);
  assert.equal(object.rotation, -60);
  assert.deepEqual(turned(VIEW, 'light', 0.25), { ...VIEW, rotation: 120 });
});

test('frames have names in their order, which no file has', () => {
  assert.deepEqual(frameNames('gold', 'png', 2, []), ['gold-01.png', 'gold-02.png']);
  assert.equal(frameNames('gold', 'png', 36, ['gold.png'])[35], 'gold-036.png');
  assert.equal(frameNames('gold', 'exr', 2, ['gold-01.png', 'gold-2-01.png'])[0], 'gold-3-01.exr');
});
