// Numbers as hands write them.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { evaluated } from '../../src/velatura/editor/page/state/expression.js';

const near = (found, expected, text) => assert.ok(Math.abs(found - expected) <= 1e-12 * Math.abs(expected), `${text}: ${found}`);

test('arithmetic has the order of arithmetic', () => {
  const cases = { '0.31': 0.31, ' 0,31 ': 0.31, '.5': 0.5, '1e-3': 1e-3, '1/3': 1 / 3, '2+3*4': 14, '(2+3)*4': 20, '8/4/2': 1 };
  Object.assign(cases, { '1-2-3': -4, '-3': -3, '2*-3': -6, '30%': 0.3, '50% + 10%': 0.6, '1.5 - (1 - 25%)': 0.75 });
  for (const [text, expected] of Object.entries(cases)) near(evaluated(text), expected, text);
});

test('a unit counts in that of the parameter', () => {
  const cases = [['0.2 mm', 'length', 0.2], ['200 um', 'length', 0.2], ['200 µm', 'length', 0.2], ['1 cm', 'length', 10]];
  cases.push(['0.25 um', 'nm', 250], ['1 µm/4', 'nm', 250], ['250 nm', 'micrometres', 0.25], ['0.5 turn', 'degrees', 180]);
  cases.push(['45°', 'degrees', 45], ['3.141592653589793 rad/2', 'degrees', 90], ['250', 'nm', 250]);
  for (const [text, unit, expected] of cases) near(evaluated(text, unit), expected, text);
});

test('what is no number is none', () => {
  const wrong = ['', ' ', 'abc', '1 mm', '1/', '*2', '(1', '1)', '1 2', '1..2', 'alert(1)', '__proto__', 'constructor', '1;2'];
  for (const text of wrong) assert.ok(Number.isNaN(evaluated(text)), text);
  assert.ok(Number.isNaN(evaluated('2 mm', 'degrees')));
  assert.ok(Number.isNaN(evaluated(`${'('.repeat(60)}1`)));
  assert.ok(Number.isNaN(evaluated('1'.repeat(65))));
  assert.equal(evaluated('1/0'), Infinity); // which no range takes
});
