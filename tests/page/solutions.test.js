// Solutions of values that move: what lies between and beyond those that Python has worked out.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { Solutions } from '../../src/velatura/editor/page/state/solutions.js';

/** The answer for a roughness, with texels that are a function of it. */
function answer(alpha, texel, layout = 0) {
  const encoded = (...numbers) => ({
    dtype: 'float32',
    shape: [numbers.length],
    data: Buffer.from(new Float32Array(numbers).buffer).toString('base64'),
  });
  const solution = { texels: encoded(texel(alpha), 1), remainder: encoded(alpha, 0.5, 0.5), layout: encoded(layout) };
  return { values: values(alpha), films: null, solution };
}

const values = (alpha) => ({ exterior: 1, layer0_alpha_u: alpha, layer0_alpha_v: alpha, layer1_sigma_a: [1, 2, 3] });
const numbers = (given) => Object.values(given).flat();
const at = (alpha) => numbers(values(alpha));
const linear = (alpha) => 3 * alpha + 0.25;
const near = (a, b) => assert.ok(Math.abs(a - b) < 1e-6, `${a} is not ${b}`);

function known(...answers) {
  const solutions = new Solutions();
  for (const each of answers) solutions.add(each, numbers(each.values));
  return solutions;
}

test('solutions of a line are foreseen between known ones, and twice as far beyond as these are apart', () => {
  const solutions = known(answer(0.1, linear), answer(0.2, linear));
  for (const alpha of [0.01, 0.13, 0.2, 0.29, 0.39]) {
    const { contents } = solutions.foresee(at(alpha));
    near(contents.solution.texels.array[0], linear(alpha));
    near(contents.solution.remainder.array[0], alpha);
    near(contents.values.layer0_alpha_u, alpha);
    assert.deepEqual(contents.values.layer1_sigma_a, [1, 2, 3]);
  }
  assert.equal(solutions.foresee(at(0.41)), null);
  assert.equal(known(answer(0.1, linear)).foresee(at(0.11)), null);
});

test('what was worked out is drawn as it is', () => {
  const solutions = known(answer(0.1, Math.exp), answer(0.2, Math.exp));
  const { contents, close } = solutions.foresee(at(0.2));
  assert.equal(contents.solution.texels.array[0], Math.fround(Math.exp(0.2)));
  assert.equal(close, true);
});

test('Python is asked until solutions that were foreseen have been close', () => {
  const solutions = known(answer(0.1, linear), answer(0.12, linear));
  assert.equal(solutions.foresee(at(0.14)).close, false);
  solutions.add(answer(0.14, linear), at(0.14));
  assert.equal(solutions.foresee(at(0.16)).close, true);
  assert.equal(solutions.foresee(at(0.18)).close, false);
  const jump = (alpha) => (alpha > 0.15 ? 9 : 1);
  solutions.add(answer(0.16, jump), at(0.16));
  assert.equal(solutions.foresee(at(0.175)).close, false);
});

test('nothing is foreseen off the line of known solutions, nor between those of other layouts', () => {
  const solutions = known(answer(0.1, linear), answer(0.2, linear));
  assert.equal(solutions.foresee(numbers({ ...values(0.15), exterior: 1.2 })), null);
  assert.equal(known(answer(0.1, linear), answer(0.2, linear, 1)).foresee(at(0.15)), null);
  solutions.clear();
  assert.equal(solutions.foresee(at(0.1)), null);
});

test('answers without a solution are returned as they are', () => {
  const plain = { values: values(0.1), films: null, solution: null };
  assert.deepEqual(new Solutions().add(plain, at(0.1)), plain);
});
