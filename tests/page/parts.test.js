// The parts of a mixture: what is chosen, shares that sum to 1, and what is left of a part that goes.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { initial, setValue } from '../../src/velatura/editor/page/state/commands.js';
import { documentOf, flat, pattern, stackOf } from '../../src/velatura/editor/page/state/material.js';
import { coveringOf } from '../../src/velatura/editor/page/render/slot.js';
import * as parts from '../../src/velatura/editor/page/state/parts.js';

const SESSION = {
  default_model: 'velatura',
  names: { dielectrics: {}, conductors: {}, pages: {} },
  schema: { interface: { eta: { kind: 'index', default: null } } },
};
const stack = (name, eta) => ({ name, layers: [{ interface: { eta } }] });
const MASK = { texture: 'mask.png', scale: 14, offset: -2 };
const PAIR = { name: 'Worn', source: 'by hand', mix: [{ weight: 0.25, material: stack('paint', 1.5) }, { material: stack('steel', 2.5) }] };
const NESTED = {
  mix: [
    { weight: MASK, material: { ...stack('dust', 1.3), thin: true } },
    { material: { ...PAIR, mix: [...PAIR.mix.slice(0, 1), { weight: 0.5, material: stack('rust', 1.7) }, ...PAIR.mix.slice(1)] } },
  ],
};
const opened = (material) => initial(material, SESSION);
const weightsOf = (state) => documentOf(state).mix.map(({ weight }) => weight);
const idOf = (state, name) => {
  const found = (nodes) => nodes.flatMap((node) => [node, ...found(node.parts ?? [])]);
  return found(state.parts).find((node) => node.name === name).id;
};

test('a mixture, and one within it, is written as it was read, for any chosen part', () => {
  for (const material of [PAIR, NESTED, { ...PAIR, mix: PAIR.mix.map((part) => ({ ...part, material: { ...part.material, exterior: 1.33 } })) }]) {
    const state = opened(material);
    assert.deepEqual(documentOf(state), { ...material });
    for (const name of ['steel', 'paint']) assert.deepEqual(documentOf(parts.choosePart(state, idOf(state, name))), material);
  }
});

test('layers that change are those of the chosen part', () => {
  const state = parts.choosePart(opened(NESTED), idOf(opened(NESTED), 'rust'));
  assert.deepEqual(stackOf(state), { layers: [{ interface: { eta: 1.7 } }] });
  const changed = setValue(state, state.layers[0].id, 'eta', 1.9);
  const other = parts.choosePart(changed, idOf(changed, 'dust'));
  assert.equal(documentOf(other).mix[1].material.mix[1].material.layers[0].interface.eta, 1.9);
  const values = flat(other, SESSION);
  assert.equal(values.part1_part1_layer0_eta, 1.9);
  assert.equal(values.part1_part0_weight, 0.25);
  assert.equal('part0_weight' in values, false);
});

test('code depends on masks, and neither on shares nor on what is chosen', () => {
  const state = opened(NESTED), of = (change, ...args) => pattern(change(state, ...args));
  assert.equal(of(parts.choosePart, idOf(state, 'steel')), pattern(state));
  assert.equal(of(parts.setWeight, idOf(state, 'rust'), 0.1), pattern(state));
  assert.notEqual(of(parts.setWeight, idOf(state, 'dust'), 0.1), pattern(state));
});

test('weights of another mixture are taken by its parts, and those within them stay', () => {
  const state = opened(NESTED), other = documentOf(parts.setWeight(state, idOf(state, 'dust'), 0.25));
  assert.deepEqual(documentOf(parts.setWeights(state, other)), other);
  assert.deepEqual(documentOf(parts.setWeights(parts.choosePart(state, idOf(state, 'rust')), other)), other);
});

test('a share ends where the others leave nothing', () => {
  const state = opened(NESTED), weights = (next) => documentOf(next).mix[1].material.mix.map(({ weight }) => weight);
  assert.deepEqual(weights(parts.setWeight(state, idOf(state, 'rust'), 0.9)), [0.25, 0.75, undefined]);
});

test('parts that change places keep their shares', () => {
  const state = opened(PAIR), steel = idOf(state, 'steel');
  assert.deepEqual(weightsOf(parts.movePart(state, steel, 0)), [0.75, undefined]);
  const masked = parts.setWeight(state, idOf(state, 'paint'), MASK);
  const turned = parts.movePart(masked, steel, 0);
  assert.deepEqual(weightsOf(turned), [{ ...MASK, scale: -14, offset: 3 }, undefined]);
  assert.deepEqual(documentOf(parts.movePart(turned, steel, 1)), documentOf(masked));
});

test('what several masks leave has no share of its own, and stays last', () => {
  const state = parts.duplicatePart(opened(NESTED), idOf(opened(NESTED), 'dust')), { id } = state.parts.at(-1);
  assert.match(parts.objectionTo(state.parts, id, 0), /^The last part has what masks leave/);
  assert.equal(parts.movePart(state, id, 0), state);
  assert.equal(parts.objectionTo(state.parts, state.parts[0].id, 1), '');
});

test('a copy and a new part take half of a share', () => {
  const state = opened(PAIR);
  assert.deepEqual(weightsOf(parts.duplicatePart(state, idOf(state, 'paint'))), [0.125, 0.125, undefined]);
  assert.deepEqual(weightsOf(parts.duplicatePart(state, idOf(state, 'steel'))), [0.25, 0.375, undefined]);
  const mixed = parts.mixWith(state, stack('dust', 1.3));
  assert.deepEqual(documentOf(mixed).mix.map(({ weight, material }) => [weight, material.name]), [
    [0.125, 'dust'],
    [0.125, 'paint'],
    [undefined, 'steel'],
  ]);
  assert.equal(mixed.part, idOf(mixed, 'dust'));
});

test('a stack is mixed, and is itself again when the other part goes', () => {
  const state = opened({ ...stack('gold', 2.5), source: 'a book' });
  const mixed = parts.mixWith(state, stack('paint', 1.5));
  assert.equal(documentOf(mixed).name, 'gold with paint');
  assert.deepEqual(weightsOf(mixed), [0.5, undefined]);
  const ids = mixed.parts.flatMap(({ id, layers }) => [id, ...layers.map((layer) => layer.id)]);
  assert.equal(new Set(ids).size, ids.length);
  assert.deepEqual(documentOf(parts.removePart(mixed, mixed.part)), documentOf(state));
});

test('a part that goes leaves its share to the last one, and a mixture of one part is that part', () => {
  const state = opened(NESTED);
  assert.deepEqual(documentOf(parts.removePart(state, idOf(state, 'dust'))), { ...NESTED.mix[1].material });
  const [fewer] = [parts.removePart(parts.removePart(state, idOf(state, 'paint')), idOf(state, 'steel'))];
  assert.deepEqual(documentOf(fewer), { mix: [NESTED.mix[0], { material: stack('rust', 1.7) }] });
});

test('materials of another exterior, and too many, are not mixed', () => {
  const state = opened(PAIR);
  assert.equal(parts.objectionToMixing(state, stack('dust', 1.3)), '');
  assert.match(parts.objectionToMixing(state, { ...stack('pebble', 1.5), exterior: 1.33 }), /^The exterior of all parts is one: here 1, in pebble 1.33/);
  const many = { mix: [...Array(15)].map((_, k) => ({ ...(k < 14 && { weight: 0.01 }), material: stack('', 1.5) })) };
  assert.match(parts.objectionToMixing(state, many), /16 stacks at most, and this would be 17/);
});

test('a part of an object gets a material, another one, and goes back to the rest', () => {
  const covers = (state) => documentOf(state).mix.map(({ covers: name, weight, material }) => [name, weight, material.name]);
  const once = parts.cover(opened(stack('paint', 1.5)), 'Foot', stack('steel', 2.5));
  assert.deepEqual(covers(once), [['Foot', 0.5, 'steel'], [undefined, undefined, 'paint']]);
  assert.equal(once.layers[0].keys.eta, 2.5);
  const twice = parts.cover(once, 'Bulb', PAIR);
  assert.deepEqual(covers(twice), [['Foot', 0.5, 'steel'], ['Bulb', 0.25, 'Worn'], [undefined, undefined, 'paint']]);
  assert.deepEqual(covers(parts.cover(twice, 'Foot', stack('rust', 1.7)))[0], ['Foot', 0.5, 'rust']);
  assert.equal(parts.coveringName(twice, 'Bulb'), 'Worn');
  assert.equal(parts.coveringName(twice, 'Base'), 'as the rest');
  assert.equal(parts.chooseCovering(twice, 'Base').layers[0].keys.eta, 1.5);
  const moved = parts.setCovers(twice, idOf(twice, 'Worn'), 'Foot');
  assert.deepEqual(covers(moved).map(([name]) => name), [undefined, 'Foot', undefined]);
  assert.deepEqual(documentOf(parts.removePart(once, idOf(once, 'steel'))).layers, stack('', 1.5).layers);
});

test('a mixture becomes the rest as a whole, and one that covers is written as it was read', () => {
  const worn = parts.cover(opened(PAIR), 'Foot', stack('steel', 2.5));
  assert.deepEqual(documentOf(worn).mix[1].material.mix, PAIR.mix);
  const material = { mix: [{ weight: 0.5, material: stack('steel', 2.5), covers: 'Foot' }, { material: PAIR, covers: 'Shade' }] };
  assert.deepEqual(documentOf(opened(material)), material);
});

test('the stacks of what covers a part are numbered for the picture; where shares hold by 0', () => {
  const found = (names, covers) => [...coveringOf(names, covers)].slice(0, 3);
  assert.deepEqual(found(['Shade', 'Foot', 'Bulb'], ['Foot', 'Shade', '']), [2, 1, 3]);
  assert.deepEqual(found([''], ['Foot', '']), [0, 0, 0]);
  assert.deepEqual(found(['Foot'], null), [0, 0, 0]);
});
