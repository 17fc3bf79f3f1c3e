// Answers in the files of a static folder: arrays by planes, tapes that look back, texts of numbered lines.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { gzipSync } from 'node:zlib';

import { decode } from '../../src/velatura/editor/page/arrays.js';
import { textOf, unpacked } from '../../src/velatura/editor/page/packing.js';

const file = (answer) => Uint8Array.from(gzipSync(JSON.stringify(answer)));
const inBase64 = (bytes) => Buffer.from(bytes).toString('base64');

test('arrays are put together from planes, where the lowest may be left out', async () => {
  const whole = { dtype: 'uint32', shape: [2], planes: inBase64([1, 2, 0, 1, 0, 0, 0, 0]) };
  const floats = { dtype: 'float32', shape: [1, 2], planes: inBase64([0, 0, 0x80, 0x20, 0x3f, 0xc0]) };
  const made = await unpacked(file({ whole, floats }));
  assert.deepEqual([...decode(made.whole).array], [1, 258]);
  assert.deepEqual(decode(made.floats), { array: Float32Array.of(1, -2.5), shape: [1, 2] });
});

test('steps of a tape name all that is before them by number', async () => {
  const steps = [['add', 0, 2], ['component', 1, -1], ['add', 0, -1]];
  const { baked } = await unpacked(file({ baked: { inputs: ['a', 'b'], constants: [1], steps, outputs: [5] } }));
  assert.deepEqual(baked.steps, [['add', 0, 2], ['component', 1, 3], ['add', 0, 4]]);
});

test('a text is put together from lines by their distances', () => {
  assert.equal(textOf([1, 1, -2], ['a', 'b', 'c']), 'b\nc\na');
});
