// A bounded memory: what it keeps, and what it forgets.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { Recent } from '../../src/velatura/editor/page/recent.js';

test('the entry that was used longest ago goes first', () => {
  const recent = new Recent(2);
  recent.set('a', 1);
  recent.set('b', 2);
  assert.equal(recent.get('a'), 1);
  recent.set('c', 3);
  assert.equal(recent.get('b'), undefined);
  assert.deepEqual([recent.get('a'), recent.get('c'), recent.size], [1, 3, 2]);
});

test('a promise is made once, for all who ask while it is under way', async () => {
  const recent = new Recent(4);
  let made = 0;
  const make = async () => ++made;
  assert.deepEqual(await Promise.all([recent.once('a', make), recent.once('a', make)]), [1, 1]);
  assert.equal(await recent.once('b', make), 2);
});

test('one that fails is tried again', async () => {
  const recent = new Recent(4);
  await assert.rejects(recent.once('a', () => Promise.reject(new Error('away'))), /away/);
  assert.equal(await recent.once('a', async () => 'back'), 'back');
});
