// Colours there and back: as hexadecimal text, and by hue, saturation and value.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { fromHsv, hex, ofHex, toHsv } from '../../src/velatura/editor/page/views/colour.js';

const close = (a, b) => a.every((x, k) => Math.abs(x - b[k]) < 1e-9);

test('a colour that is written is the one that was read', () => {
  for (const text of ['#000000', '#ffffff', '#c86428', '#010203']) assert.equal(hex(ofHex(text)), text);
  assert.equal(hex(ofHex('8C4')), '#88cc44');
  for (const text of ['', '#12', 'red', '#12345g', '#1234567']) assert.equal(ofHex(text), null);
});

test('hue, saturation and value are those of the channels as a screen takes them', () => {
  assert.ok(close(toHsv([1, 0, 0]), [0, 1, 1]));
  assert.ok(close(toHsv([0, 1, 0]), [120, 1, 1]));
  assert.ok(close(toHsv([0, 0, 1]), [240, 1, 1]));
  assert.ok(close(toHsv(ofHex('#804020')), [20, 0.75, 128 / 255]));
  for (let k = 0; k < 200; k++) {
    const rgb = [(k * 37) % 101, (k * 53) % 101, (k * 71) % 101].map((c) => c / 100);
    assert.ok(close(fromHsv(toHsv(rgb)), rgb), `${rgb}`);
  }
});
