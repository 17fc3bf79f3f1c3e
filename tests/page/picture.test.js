// The picture follows values that move, drawn between answers of Python.

import assert from 'node:assert/strict';
import { mock, test } from 'node:test';

import { follow } from '../../src/velatura/editor/page/state/picture.js';

const SESSION = {
  views: [{ name: 'soft', text: '' }],
  default_model: 'velatura',
  names: { dielectrics: {}, conductors: {}, pages: {} },
  schema: { interface: { eta: { kind: 'index', default: 1.5 }, alpha: { kind: 'pair', default: 0.1 } } },
};

const stateOf = (alpha) => ({
  ...{ name: '', source: '', exterior: 1, thin: false, model: 'velatura', switches: {}, document: null, camera: null },
  layers: [{ id: 1, kind: 'interface', enabled: true, keys: { eta: 1.5, alpha } }],
  view: { object: 'ball', environment: 'studio', mode: 'one' },
});

/** An answer whose texel is the roughness. */
function answer({ material }) {
  const { eta, alpha } = (material.mix?.[0].material ?? material).layers[0].interface;
  const encoded = (...numbers) => ({ array: new Float32Array(numbers), shape: [numbers.length] });
  return {
    ...{ key: 'k', parts: [{ shown: [] }], films: null },
    values: { exterior: 1, layer0_eta: eta }, // what the code reads, which a roughness is not
    solution: { texels: encoded(alpha), remainder: encoded(alpha), layout: encoded(0) },
  };
}

let clock = 0; // milliseconds
mock.method(performance, 'now', () => clock);

const pause = () => new Promise((resolve) => setImmediate(resolve));

/** A picture of a roughness in a held viewport, with the texels that are drawn and the requests that wait. */
async function held(alpha, shapeOf = stateOf) {
  const drawn = [], waiting = [], values = [];
  let changed = null;
  let state = shapeOf(alpha);
  const viewport = {
    ...{ held: true, slots: { a: null }, camera: null },
    ...{ setView: () => {}, setCamera: () => {}, setObject: () => {}, setEnvironment: () => {}, forget: () => {} },
    setMaterial: () => {},
    setContents: (_, contents) => drawn.push(contents.solution.texels.array[0]) && values.push(contents.values),
  };
  const picture = follow({
    ...{ viewport, session: SESSION, lacks: () => '', onProblem: () => {}, onBaked: () => {}, onShader: () => {} },
    store: { get: () => state, subscribe: (listener) => ((changed = listener), () => {}) },
    files: { object: () => null, environment: () => null },
    call: (verb, question) =>
      verb === 'shader' ? answer(question) : new Promise((resolve) => waiting.push(() => resolve(answer(question)))),
  });
  await pause();
  const move = (to) => changed((state = shapeOf(to)));
  const reply = async () => {
    waiting.shift()();
    await pause();
  };
  return { picture, drawn, values, waiting, move, reply };
}

test('values that move are drawn at once where solutions lie beside them, and asked for one at a time', async () => {
  const { picture, drawn, waiting, move, reply } = await held(0.1);
  const last = () => drawn.at(-1);
  move(0.2);
  move(0.22);
  assert.equal(waiting.length, 1);
  await reply(); // the second one follows
  await reply();
  assert.equal(last(), Math.fround(0.22));
  const before = drawn.length;
  move(0.24);
  assert.equal(drawn.length, before + 1);
  assert.ok(Math.abs(last() - 0.24) < 1e-6);
  assert.equal(waiting.length, 1);
  // What was foreseen was close: the next values need no answer
  await reply();
  move(0.26);
  assert.ok(Math.abs(last() - 0.26) < 1e-6);
  assert.equal(waiting.length, 0);
  picture.stop();
});

test('an answer that comes late does not take the picture back', async () => {
  const { picture, drawn, move, reply } = await held(0.1);
  move(0.2);
  await reply();
  move(0.22);
  await reply();
  move(0.24); // foreseen, and asked for
  move(0.25);
  await reply();
  assert.ok(Math.abs(drawn.at(-1) - 0.25) < 1e-6);
  picture.stop();
});

test('Python rests after an answer, while values are foreseen', async () => {
  const { picture, drawn, waiting, move, reply } = await held(0.1);
  for (const alpha of [0.2, 0.21]) {
    move(alpha);
    clock += 50;
    await reply();
  }
  move(0.225); // foreseen, but farther than any that was close
  assert.equal(waiting.length, 0);
  assert.ok(Math.abs(drawn.at(-1) - 0.225) < 1e-6);
  clock += 101;
  move(0.226);
  assert.equal(waiting.length, 1);
  picture.stop();
});

test('shares that move are drawn without a question', async () => {
  const part = (id, weight) => ({ id, weight, name: '', source: '', thin: false, layers: stateOf(0.1).layers });
  const mixed = (share) => ({ ...stateOf(0.1), parts: [part(1, share), part(2, null)], part: 1 });
  const { picture, drawn, values, waiting, move } = await held(0.5, mixed);
  const before = drawn.length;
  move(0.4);
  move(0.3);
  assert.equal(drawn.length, before + 2);
  assert.equal(values.at(-1).part0_weight, 0.3);
  assert.equal(waiting.length, 0);
  picture.stop();
});
