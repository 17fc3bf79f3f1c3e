// Pigments of a medium: what the first one stands for, what is left of the last one, and their colours.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { addPigment, removePigment, setPigment } from '../../src/velatura/editor/page/state/commands.js';
import { pattern } from '../../src/velatura/editor/page/state/material.js';
import { absorptionFor, coefficientsOf, masstone } from '../../src/velatura/editor/page/state/pigments.js';

const GIVEN = { sigma_a: 0.5, sigma_s: 0, g: 0 };
const FRESH = { K: 1, S: 2, concentration: 0.1 };
const stateOf = (keys) => ({ exterior: 1, thin: false, layers: [{ id: 7, kind: 'medium', enabled: true, keys }] });
const keysOf = (state) => state.layers[0].keys;

test('the first pigment is the medium as it was, and the last one leaves it so', () => {
  const own = { depth: 2, g: 0.6, sigma_a: [0.1, 0.5, 2], sigma_s: 3 };
  const state = addPigment(stateOf(own), 7, FRESH, GIVEN);
  assert.deepEqual(keysOf(state), { depth: 2, g: 0.6, pigments: [{ K: [0.2, 1, 4], S: 0.9 }] }); // Gate 1974
  assert.deepEqual(keysOf(removePigment(state, 7, 0)), own);
  assert.deepEqual(keysOf(addPigment(stateOf({}), 7, FRESH, GIVEN)).pigments, [{ K: 1, S: 0 }]);
  const both = addPigment(state, 7, FRESH, GIVEN);
  assert.deepEqual(keysOf(both).pigments.at(-1), FRESH);
  assert.deepEqual(keysOf(removePigment(both, 7, 0)).pigments, [FRESH]);
});

test('coefficients add up by concentration', () => {
  const pigments = [{ K: [2, 0, 1], S: 3 }, { K: 4, S: [6, 0, 3], concentration: 0.5 }];
  assert.deepEqual(coefficientsOf(pigments, 0.5), { sigma_a: [2, 1, 1.5], sigma_s: [16, 8, 12] });
  assert.deepEqual(coefficientsOf([...pigments, { pigment: 'blue.csv' }]), {});
});

test('a masstone is that of Kubelka and Munk, and is had again by K', () => {
  assert.equal(masstone({ K: 0.25, S: 1 }), 0.5);
  assert.deepEqual(masstone({ K: [0, 1, 0], S: [1, 0, 0] }), [1, 0, 1]);
  const light = [0.6, 0.2, 0.05];
  masstone({ K: absorptionFor(light, 7), S: 7 }).forEach((r, k) => assert.ok(Math.abs(r - light[k]) < 1e-5));
});

test('numbers of pigments are values, and tables are code', () => {
  const state = stateOf({ pigments: [FRESH] });
  assert.equal(pattern(setPigment(state, 7, 0, { K: [3, 2, 1], concentration: 0.7 })), pattern(state));
  assert.notEqual(pattern(setPigment(state, 7, 0, { K: { spectrum: [[400, 1], [700, 2]] } })), pattern(state));
});
