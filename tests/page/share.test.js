// A material in an address, and what outlives the page.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import * as commands from '../../src/velatura/editor/page/state/commands.js';
import { documentOf } from '../../src/velatura/editor/page/state/material.js';
import { browserStorage } from '../../src/velatura/editor/page/state/persist.js';
import { fragmentOf, isShared, readFragment } from '../../src/velatura/editor/page/state/share.js';

const SESSION = {
  default_model: 'velatura',
  models: ['velatura', 'belcour2018'].map((name) => ({ name, switches: { tir: ['on', 'off'] } })),
  objects: ['ball', 'sphere'],
  environments: [{ name: 'studio' }, { name: 'city' }],
  views: [{ name: 'soft' }, { name: 'agx' }],
};
const MATERIAL = { name: 'Été – 漆', layers: [{ interface: { eta: 1.5, alpha: [0.1, 0.3] } }] };

const shown = () =>
  commands.setView(commands.initial(MATERIAL, SESSION), { object: 'sphere', environment: 'city', rotation: 30 });

test('an address gives back the material with what is shown', async () => {
  const state = commands.setModel(shown(), 'belcour2018', { tir: 'off' });
  const fragment = await fragmentOf(state, documentOf(state));
  assert.ok(isShared(fragment));
  assert.match(fragment, /^#m=[\w-]+$/);
  const found = await readFragment(fragment, SESSION);
  assert.deepEqual(found.material, MATERIAL);
  assert.deepEqual([found.model, found.switches], ['belcour2018', { tir: 'off' }]);
  assert.deepEqual(found.view, { object: 'sphere', environment: 'city', rotation: 30, exposure: 0, transform: 'soft', lights: [] });
});

test('an address that was cut off is refused in words', async () => {
  const fragment = await fragmentOf(shown(), MATERIAL);
  for (const text of [fragment.slice(0, 20), '#m=', '#m=%%%'])
    await assert.rejects(readFragment(text, SESSION), /cut off, or changed/);
});

const fragmentFor = (found) => fragmentOf({ ...shown(), ...found }, found.material);

test('an address that holds anything else is refused in words, or without what is not known', async () => {
  const stranger = { constructor: 'off' };
  await assert.rejects(readFragment(await fragmentFor({ switches: stranger }), SESSION), /a switch that .* constructor/);
  await assert.rejects(readFragment(await fragmentFor({ switches: { tir: '<b>' } }), SESSION), /a switch/);
  await assert.rejects(readFragment(await fragmentFor({ model: { toString: 1 } }), SESSION), /a model that is not known/);
  for (const switches of [null, 3, []]) {
    const found = await readFragment(await fragmentFor({ switches, camera: 'none' }), SESSION);
    assert.deepEqual([found.switches, found.camera], [{}, null]);
  }
  const bomb = await fragmentFor({ material: { name: 'x'.repeat(3e6) } });
  assert.ok(bomb.length < 6000);
  await assert.rejects(readFragment(bomb, SESSION), /cut off, or changed/);
});

test('an unknown model is named, and an unknown view left out', async () => {
  const state = commands.setView(shown(), { object: 'teapot', exposure: NaN, transform: 'filmic' });
  const { view } = await readFragment(await fragmentOf(state, MATERIAL), SESSION);
  assert.deepEqual(view, { environment: 'city', rotation: 30, lights: [] });
  const other = await fragmentOf(commands.setModel(shown(), 'disney'), MATERIAL);
  await assert.rejects(readFragment(other, SESSION), /not known here: disney/);
});

test('lights are shared, and those that are none left out', async () => {
  const light = { azimuth: 45, elevation: 30, size: 20, strength: 10, colour: [1, 0.5, 0] };
  const shared = async (lights) =>
    (await readFragment(await fragmentOf(commands.setView(shown(), { lights }), MATERIAL), SESSION)).view.lights;
  assert.deepEqual(await shared([light]), [light]);
  for (const wrong of [[{ ...light, size: 'wide' }], [{ ...light, strength: -1 }], [{ ...light, colour: [1] }], [null], Array(9).fill(light), 'two'])
    assert.equal(await shared(wrong), undefined);
});

/** Storage that holds so many characters. */
function storage(room) {
  const held = new Map();
  return {
    getItem: (key) => held.get(key) ?? null,
    setItem(key, text) {
      if (text.length > room) throw new Error('QuotaExceededError');
      held.set(key, text);
    },
  };
}

test('where there is no room for all steps, the oldest are forgotten', () => {
  const past = Array.from({ length: 64 }, (_, k) => ({ state: 'x'.repeat(100), title: `${k}` }));
  const kept = browserStorage({ sessionStorage: storage(2000), localStorage: storage(2000) });
  kept.save({ present: 'now', past, future: [] });
  const found = kept.load();
  assert.equal(found.present, 'now');
  assert.ok(found.past.length >= 4 && found.past.length < 64);
  assert.equal(found.past.at(-1).title, '63');
  assert.equal(kept.last(), 'now');
});

test('a storage that is full, or of another form, is as good as empty', () => {
  const full = browserStorage({ sessionStorage: storage(0), localStorage: storage(0) });
  full.save({ present: 'now', past: [], future: [] });
  assert.equal(full.load(), null);
  const old = { getItem: () => '{"form":0,"value":1}' };
  assert.equal(browserStorage({ sessionStorage: old, localStorage: old }).load(), null);
});
