// What the page says, and what becomes of values under the hand.

import assert from 'node:assert/strict';
import { afterEach, beforeEach, mock, test } from 'node:test';

import { Offline } from '../../src/velatura/editor/page/connection.js';
import { createEdits } from '../../src/velatura/editor/page/state/edits.js';
import { createMessages } from '../../src/velatura/editor/page/state/messages.js';
import { createStore } from '../../src/velatura/editor/page/state/store.js';

beforeEach(() => mock.timers.enable({ apis: ['setTimeout'] }));
afterEach(() => mock.timers.reset());

const texts = (messages) => messages.problems.map(({ text }) => text);

test('a problem stays until its cause has gone, the latest last', () => {
  let drawn = 0;
  const messages = createMessages(() => drawn++);
  messages.complain('a', 'first');
  messages.complain('b', 'second', { layer: 7 });
  messages.complain('a', 'third');
  assert.deepEqual(texts(messages), ['second', 'third']);
  assert.equal(messages.problemOf(7), 'second');
  messages.forgive('b');
  messages.forgive('b');
  assert.deepEqual(texts(messages), ['third']);
  assert.equal(drawn, 4);
});

test('what has failed goes with the next act, what the server missed when it is back', async () => {
  const messages = createMessages(() => {});
  await messages.attempt('file', () => Promise.reject(new Error('not readable')));
  await messages.attempt('list', () => Promise.reject(new Offline()));
  messages.complain('picture', 'must hold a layer');
  messages.say('Saved.');
  messages.done();
  assert.deepEqual(texts(messages), ['The server does not answer.', 'must hold a layer']);
  assert.equal(messages.note, '');
  messages.forgiveAll('away');
  assert.deepEqual(texts(messages), ['must hold a layer']);
  await messages.attempt('picture', async () => {});
  assert.deepEqual(texts(messages), []);
});

test('what is passing goes by itself once it has been read, and so does a note', async () => {
  const messages = createMessages(() => {});
  messages.complain('picture', 'must hold a layer');
  await messages.attempt('file', () => Promise.reject(new Error('not readable')));
  mock.timers.tick(6000);
  await messages.attempt('file', () => Promise.reject(new Error('still not readable')));
  messages.say('Saved.');
  mock.timers.tick(6000);
  assert.deepEqual(texts(messages), ['must hold a layer', 'still not readable']);
  assert.equal(messages.note, 'Saved.');
  mock.timers.tick(6000);
  assert.deepEqual(texts(messages), ['must hold a layer']);
  assert.equal(messages.note, '');
});

test('a drag is one step, from the first move until a while after the last', () => {
  const moving = mock.fn();
  const store = createStore({ value: 0 });
  const set = Object.assign((state, value) => ({ ...state, value }), { title: 'set' });
  const messages = createMessages(() => {});
  const edit = createEdits({ store, viewport: { moving }, messages }).of('key', (value) => [set, value], 'thing', 3);
  for (const value of [1, 2, 3]) edit.move(value);
  edit.settle();
  mock.timers.tick(399);
  assert.equal(store.dragging, true);
  mock.timers.tick(1);
  assert.equal(store.dragging, false);
  assert.equal(store.history().past.length, 1);
  assert.deepEqual(moving.mock.calls.at(-1).arguments, [false]);
  edit.move(4);
  edit.set(5);
  assert.equal(store.history().past.length, 3);
  edit.refuse('must be a number');
  assert.equal(messages.problemOf(3), 'must be a number');
});
