// Questions to Python under the hand.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { oneAtATime } from '../../src/velatura/editor/page/views/appearance/questions.js';

test('of what is asked for meanwhile the latest alone is done, though the one before has failed', async () => {
  const done = [];
  let rest;
  const rested = new Promise((resolve) => (rest = resolve));
  const questions = oneAtATime(async (next) => {
    await null;
    done.push(next);
    if (next === 1) throw new Error('failed');
  }, rest);
  const failing = questions.want(1);
  questions.want(2);
  questions.want(3);
  await assert.rejects(failing, /failed/);
  await rested;
  assert.deepEqual([done, questions.busy], [[1, 3], false]);
});
