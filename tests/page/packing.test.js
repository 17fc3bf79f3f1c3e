// Answers in the files of a static folder: arrays by planes, tapes that look back, texts of numbered lines.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { gzipSync } from 'node:zlib';

import { decode } from '../../src/velatura/editor/page/arrays.js';
import { textOf, unpacked } from '../../src/velatura/editor/page/packing.js';

const file = (answer, planes = []) =>
  Uint8Array.from(gzipSync(Buffer.concat([Buffer.from(JSON.stringify(answer)), Buffer.from(planes.length ? [10, ...planes] : [])])));

test('arrays are put together from planes, where the lowest may be left out', async () => {
  const whole = { dtype: 'uint32', shape: [2], planes: [0, 8], step: 0 };
  const floats = { dtype: 'float32', shape: [1, 2], planes: [8, 6], step: 0 };
  const made = await unpacked(file({ whole, floats }, [1, 2, 0, 1, 0, 0, 0, 0, 0, 0, 0x80, 0x20, 0x3f, 0xc0]));
  assert.deepEqual([...decode(made.whole).array], [1, 258]);
  assert.deepEqual(decode(made.floats), { array: Float32Array.of(1, -2.5), shape: [1, 2] });
});

test('numbers are added up from differences, of those a step before', async () => {
  const whole = { dtype: 'int16', shape: [2, 2], planes: [0, 8], step: 2 };
  const floats = { dtype: 'float32', shape: [2], planes: [8, 6], step: 1 };
  const made = await unpacked(file({ whole, floats }, [10, 255, 246, 2, 0, 255, 255, 0, 0, 0, 0x80, 0, 0x3f, 0x80]));
  assert.deepEqual([...decode(made.whole).array], [10, -1, 0, 1]);
  assert.deepEqual([...decode(made.floats).array], [1, -1]);
});

test('steps of a tape name all that is before them by number', async () => {
  const steps = [['add', 0, 2], ['component', 1, -1], ['add', 0, -1]];
  const { baked } = await unpacked(file({ baked: { inputs: ['a', 'b'], constants: [1], steps, outputs: [5] } }));
  assert.deepEqual(baked.steps, [['add', 0, 2], ['component', 1, 3], ['add', 0, 4]]);
});

test('a text is put together from lines by their distances', () => {
  assert.equal(textOf([1, 1, -2], ['a', 'b', 'c']), 'b\nc\na');
});
