// What can be done to a material, and undone.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import * as commands from '../../src/velatura/editor/page/state/commands.js';
import { besideOf, keptOf, slotBeside } from '../../src/velatura/editor/page/state/compared.js';
import { documentOf, isOpaque, layerName, objectionToEnabling, pattern, variantOf } from '../../src/velatura/editor/page/state/material.js';
import { tileCorner, tileSize } from '../../src/velatura/editor/page/render/tiles.js';
import { lookOf } from '../../src/velatura/editor/page/state/snapshots.js';
import { createStore } from '../../src/velatura/editor/page/state/store.js';

const SESSION = { default_model: 'velatura' };
const NAMES = {
  dielectrics: { bk7: 1.5168 },
  conductors: { Al: { eta: [1.65749, 0.880369, 0.521229], k: [9.22387, 6.26952, 4.837] } },
  pages: { 'main/Ti/Johnson': { title: 'Titanium', opaque: true, eta: [2.74, 2.54, 2.27], k: [3.81, 3.43, 3.04] } },
};
const FRESH = { interface: { eta: 1.5, alpha: 0.1 }, diffuse: { albedo: [0.5, 0.5, 0.5] } };
const MATERIAL = {
  name: 'Lacquer',
  layers: [
    { interface: { eta: 'bk7', alpha: 0.1 } },
    { medium: { depth: 1, sigma_a: [0.1, 0.5, 2] } },
    { interface: { conductor: 'Al', alpha: [0.1, 0.3], rotation: 30 } },
  ],
};

const opened = () => commands.initial(MATERIAL, SESSION);
const kinds = (state) => state.layers.map(({ kind }) => kind);

test('a material that is opened is the document that was read', () => {
  assert.deepEqual(documentOf(opened()), MATERIAL);
  assert.equal(commands.isChanged(opened()), false);
});

test('defaults stand in no document', () => {
  const state = commands.setThin(commands.setExterior(opened(), 1), false);
  assert.deepEqual(Object.keys(documentOf(state)), ['name', 'layers']);
  assert.equal(documentOf(commands.setExterior(state, 1.33)).exterior, 1.33);
});

test('a value that is changed and changed back leaves the material as it was opened', () => {
  const once = commands.setValue(opened(), 1, 'alpha', 0.2);
  assert.equal(commands.isChanged(once), true);
  assert.equal(commands.isChanged(commands.setValue(once, 1, 'alpha', 0.1)), false);
});

test('a coat goes on top, a medium between interfaces, a base below everything', () => {
  assert.deepEqual(kinds(commands.addLayer(opened(), 'interface')), ['interface', ...kinds(opened())]);
  const coated = commands.addLayer(commands.addLayer(opened(), 'interface'), 'medium');
  assert.deepEqual(kinds(coated), ['interface', 'medium', 'interface', 'medium', 'interface']);
  const painted = commands.addLayer(opened(), 'diffuse');
  assert.equal(painted.layers.at(-1).kind, 'diffuse');
  assert.deepEqual(
    documentOf(painted).layers.map((layer) => Object.keys(layer)[0]),
    ['interface', 'medium', 'diffuse'],
    'the metal that the base would cover is turned off',
  );
});

test('a layer goes where it is put, with an index that shows', () => {
  const fresh = { eta: 1.5, alpha: 0.1 };
  const lowest = commands.addLayer(opened(), 'interface', fresh, 1).layers[1];
  assert.deepEqual(lowest.keys, { eta: 1.5, alpha: 0.1 }, 'a name is no number to keep away from');
  const glass = { layers: [{ interface: { eta: 1.5 } }] };
  const pane = commands.addLayer(commands.initial(glass, SESSION), 'interface', fresh, 1);
  assert.deepEqual(documentOf(pane).layers[1].interface.eta, 1, 'a pane ends in the exterior');
  const coated = commands.addLayer(commands.initial(glass, SESSION), 'interface', fresh, 0);
  assert.deepEqual(documentOf(coated).layers[0].interface.eta, 1.33);
});

test('no order that hands make is refused, and what had to wait is on again', () => {
  const begun = commands.addLayer(commands.addLayer(opened(), 'interface', FRESH.interface, 0), 'diffuse', FRESH.diffuse);
  const ids = begun.layers.map(({ id }) => id);
  const stands = ({ layers, thin }) => {
    const on = layers.filter(({ enabled }) => enabled), opaque = on.findIndex(isOpaque);
    assert.ok(on.length && on.at(-1).kind !== 'medium' && (opaque < 0 || (opaque === on.length - 1 && !thin)));
  };
  const acts = [
    (state, id, at) => commands.moveLayer(state, id, at),
    (state, id, at) => commands.enableLayer(state, id, at % 2 === 0),
    (state, id) => commands.duplicateLayer(state, id),
    (state, id) => commands.setVariant(state, id, 'metal', NAMES, FRESH),
    (state, id) => commands.setVariant(state, id, 'dielectric', NAMES, FRESH),
  ];
  for (const act of acts) for (const next of acts) for (const id of ids) for (const other of ids) for (let at = 0; at < ids.length; at++) {
    if (begun.layers.find((layer) => layer.id === id).kind === 'medium' && act !== acts[0]) continue; // has no such kinds
    const once = act(begun, id, at);
    stands(once);
    const layer = once.layers.find((each) => each.id === other);
    if (layer.kind === 'medium' && next !== acts[0]) continue;
    if (next === acts[1] && (objectionToEnabling(once.layers, once.layers.indexOf(layer)) || alone(once, layer))) continue;
    stands(next(once, other, at));
  }
  const metal = begun.layers.findIndex(isOpaque), { id } = begun.layers[metal];
  const on = (state) => state.layers.map(({ enabled }) => enabled);
  const up = commands.moveLayer(commands.enableLayer(begun, id, true), id, 0);
  assert.deepEqual(on(up), [true, false, false, false, false]);
  assert.deepEqual(on(commands.enableLayer(up, id, false)), [false, true, true, true, true]);
});

/** Whether a layer is the last that a material stands on, which the page does not turn off. */
const alone = ({ layers }, layer) => layers.filter(({ enabled, kind }) => enabled && kind !== 'medium').every((each) => each === layer);

test('a base that becomes clear ends in the exterior', () => {
  const varnish = { layers: [{ interface: { eta: 1.5 } }, { diffuse: { albedo: 0.5 } }] };
  const state = commands.initial(varnish, SESSION);
  const pane = commands.setVariant(state, state.layers[1].id, 'dielectric', NAMES, FRESH);
  assert.equal(pane.layers[1].keys.eta, 1);
  const block = commands.setVariant(commands.removeLayer(state, 1), 2, 'dielectric', NAMES, FRESH);
  assert.equal(block.layers[0].keys.eta, 1.5, 'what is alone shows');
});

test('what cannot stand is turned off', () => {
  const painted = commands.addLayer(opened(), 'diffuse', FRESH.diffuse);
  const bare = commands.removeLayer(painted, painted.layers.at(-1).id);
  assert.deepEqual(
    documentOf(bare).layers.map((layer) => Object.keys(layer)[0]),
    ['interface'],
    'a medium above nothing',
  );
  const metal = commands.setVariant(painted, 1, 'metal', NAMES, FRESH);
  assert.deepEqual(documentOf(metal).layers, [{ interface: { conductor: 'Al', alpha: 0.1 } }]);
});

test('any base becomes any other', () => {
  const paths = ['diffuse', 'metal', 'custom', 'mirror', 'diffuse', 'dielectric', 'diffuse', 'custom', 'dielectric'];
  let state = commands.removeLayer(opened(), 2);
  for (const variant of paths) {
    state = commands.setVariant(state, 3, variant, NAMES, FRESH);
    assert.equal(variantOf(state.layers.at(-1)), variant);
  }
  assert.equal(documentOf(state).layers.length, 2);
});

test('a page of refractiveindex.info is a metal', () => {
  const base = (state) => documentOf(state).layers.at(-1).interface;
  const page = { refractiveindex: 'main/Ti/Johnson' };
  const surface = { alpha: [0.1, 0.3], rotation: 30 };
  const metal = commands.setVariant(commands.removeLayer(opened(), 2), 3, 'metal', NAMES, FRESH);
  const measured = commands.setMetal(metal, 3, 'main/Ti/Johnson', NAMES);
  assert.deepEqual(base(metal), { conductor: 'Al', ...surface });
  assert.deepEqual(base(measured), { eta: page, k: page, ...surface });
  assert.equal(variantOf(measured.layers.at(-1)), 'metal');
  assert.equal(layerName(measured.layers.at(-1), {}), 'main/Ti/Johnson');
  assert.deepEqual(base(commands.setMetal(measured, 3, 'Al', NAMES)), { conductor: 'Al', ...surface });
  const numbers = commands.setVariant(measured, 3, 'custom', NAMES, FRESH);
  assert.deepEqual(base(numbers), { eta: [2.74, 2.54, 2.27], k: [3.81, 3.43, 3.04], ...surface });
  assert.equal(base(commands.setVariant(measured, 3, 'dielectric', NAMES, FRESH)).eta, 1, 'a pane ends in the exterior');
});

test('layers have identities of their own', () => {
  let state = opened();
  for (const kind of ['interface', 'medium', 'interface']) state = commands.addLayer(state, kind);
  state = commands.duplicateLayer(commands.removeLayer(state, 2), 1);
  const ids = state.layers.map(({ id }) => id);
  assert.equal(new Set(ids).size, ids.length);
});

test('a layer moves to a place, and no further than the ends', () => {
  assert.deepEqual(
    commands.moveLayer(opened(), 3, 0).layers.map(({ id }) => id),
    [3, 1, 2],
  );
  assert.deepEqual(
    commands.moveLayer(opened(), 1, 99).layers.map(({ id }) => id),
    [2, 3, 1],
  );
  const state = opened();
  assert.equal(commands.moveLayer(state, 2, 1), state);
});

test('a metal that becomes custom keeps its indices, and the surface its roughness', () => {
  const [, , { keys }] = commands.setVariant(opened(), 3, 'custom', NAMES).layers;
  assert.equal(variantOf({ kind: 'interface', keys }), 'custom');
  assert.deepEqual(keys.eta, [1.657, 0.8804, 0.5212]);
  assert.deepEqual([keys.alpha, keys.rotation], [[0.1, 0.3], 30]);
  assert.equal(layerName({ kind: 'interface', keys }), 'metal');
});

test('numbers leave the pattern as it is; kinds, axes and textures change it', () => {
  const state = opened();
  assert.equal(pattern(commands.setValue(state, 1, 'alpha', 0.9)), pattern(state));
  assert.equal(pattern(commands.setValue(state, 2, 'sigma_a', 0.5)), pattern(state));
  const others = [
    commands.setValue(state, 1, 'alpha', [0.1, 0.2]),
    commands.setValue(state, 1, 'alpha', { texture: 'wood.png' }),
    commands.setThin(state, true),
    commands.enableLayer(state, 2, false),
    commands.setPhase(state, 2, 'rayleigh'),
    commands.setPhase(state, 2, { eta: 1.5, size: 1 }),
    commands.setPhase(state, 2, { eta: 1.5, size: 2 }),
  ];
  const patterns = [state, ...others].map(pattern);
  assert.equal(new Set(patterns).size, patterns.length);
});

test('a medium has one phase function, by g or by its keys', () => {
  const forwards = commands.setValue(opened(), 2, 'g', 0.5);
  const scattered = commands.setPhase(forwards, 2, 'rayleigh');
  assert.deepEqual(documentOf(scattered).layers[1].medium, { depth: 1, sigma_a: [0.1, 0.5, 2], phase: 'rayleigh' });
  assert.deepEqual(documentOf(commands.setPhase(scattered, 2)).layers[1].medium, MATERIAL.layers[1].medium);
});

test('an appearance keeps what is turned off', () => {
  const hidden = commands.enableLayer(opened(), 2, false);
  const material = { layers: [{ interface: { eta: 1.3 } }, { interface: { conductor: 'Al' } }] };
  const next = commands.setAppearance(hidden, material);
  assert.deepEqual(documentOf(next).layers, material.layers);
  assert.deepEqual(
    next.layers.map(({ id }) => id),
    [1, 2, 3],
  );
});

test('messages number the layers that count', () => {
  const state = commands.enableLayer(opened(), 1, false);
  assert.deepEqual(
    [1, 2, 3].map((id) => commands.numberOf(state, id)),
    [-1, 0, 1],
  );
});

test('a pinned material and the open one swap places', () => {
  const changed = commands.setValue(commands.pin(opened()), 1, 'alpha', 0.7);
  assert.deepEqual(changed.view.other.material, MATERIAL);
  const back = commands.swap(commands.setModel(changed, 'belcour2018'));
  assert.deepEqual(documentOf(back), MATERIAL);
  assert.equal(back.model, 'velatura');
  assert.equal(back.view.other.model, 'belcour2018');
  assert.equal(back.view.other.material.layers[0].interface.alpha, 0.7);
  const again = commands.swap(back);
  assert.deepEqual(documentOf(again), documentOf(changed));
});

test('commands leave the state that they are given as it is', () => {
  const frozen = (value) => {
    if (value && typeof value === 'object') Object.values(Object.freeze(value)).forEach(frozen);
    return value;
  };
  const state = frozen(structuredClone(opened()));
  const done = [
    commands.addLayer(state, 'medium'),
    commands.removeLayer(state, 1),
    commands.moveLayer(state, 1, 2),
    commands.duplicateLayer(state, 3),
    commands.setValue(state, 1, 'alpha', 0.5),
    commands.setVariant(state, 1, 'mirror', NAMES),
    commands.setSwitch(state, 'tir', 'off'),
    commands.setView(state, { object: 'sphere' }),
  ];
  for (const next of done) assert.notEqual(next, state);
});

test('every command has the title that undo shows', () => {
  const { initial, placeOf, isChanged, numberOf, OUTSIDE, ...titled } = commands;
  assert.ok([initial, placeOf, isChanged, numberOf].every((each) => typeof each === 'function'));
  assert.ok(OUTSIDE.includes('camera'));
  for (const [name, command] of Object.entries(titled)) assert.ok(command.title, name);
});

// History

test('a drag of many events is one step, and comes back in one', () => {
  const store = createStore(opened(), { outside: commands.OUTSIDE });
  for (let k = 1; k <= 1000; k++) store.drag('alpha', commands.setValue, 1, 'alpha', k / 1000);
  store.release();
  assert.equal(store.history().past.length, 1);
  assert.equal(store.undoes, 'change a value');
  store.undo();
  assert.deepEqual(documentOf(store.get()), MATERIAL);
  store.redo();
  assert.equal(store.get().layers[0].keys.alpha, 1);
});

test('two drags of one value are two steps once the first was released', () => {
  const store = createStore(opened());
  store.drag('alpha', commands.setValue, 1, 'alpha', 0.2);
  store.release();
  store.drag('alpha', commands.setValue, 1, 'alpha', 0.3);
  assert.equal(store.history().past.length, 2);
});

test('undo leaves camera and disk as they are', () => {
  const store = createStore(opened(), { outside: commands.OUTSIDE });
  store.run(commands.rename, 'Varnish');
  const camera = { origin: [0, 0, 1], target: [0, 0, 0], fov: 40 };
  store.aside(commands.setCamera, camera);
  store.undo();
  assert.equal(store.get().name, 'Lacquer');
  assert.deepEqual(store.get().camera, camera);
});

test('what is done after an undo ends what could be done again', () => {
  const store = createStore(opened());
  store.run(commands.rename, 'Varnish');
  store.undo();
  assert.ok(store.canRedo);
  store.run(commands.rename, 'Paint');
  assert.ok(!store.canRedo);
});

test('the history forgets the oldest of many steps', () => {
  const store = createStore(opened());
  for (let k = 0; k < 500; k++) store.run(commands.rename, `${k}`);
  assert.equal(store.history().past.length, 200);
});

test('listeners follow every change until they stop', () => {
  const store = createStore(opened());
  const seen = [];
  const stop = store.subscribe(({ name }) => seen.push(name));
  store.run(commands.rename, 'Varnish');
  store.undo();
  stop();
  store.redo();
  assert.deepEqual(seen, ['Varnish', 'Lacquer']);
});

test('what is gone back to looks as it did, and keeps its layers that are off and its file', () => {
  const begun = commands.saved(opened(), MATERIAL, 'gold.yaml', 1);
  const off = commands.enableLayer(begun, begun.layers[0].id, false);
  const other = commands.openMaterial(off, { layers: [{ interface: { conductor: 'Ag' } }] });
  const back = commands.goBack(other, keptOf(off));
  assert.equal(lookOf(back), lookOf(off));
  assert.notEqual(lookOf(back), lookOf(begun));
  assert.notEqual(lookOf(back), lookOf(other));
  assert.deepEqual(back.layers, off.layers);
  assert.equal(commands.placeOf(back).file, 'gold.yaml');
});

test('up to three materials are put beside the open one, and taken away', () => {
  const names = (state) => besideOf(state).map(({ slot, number }) => `${slot}${number}`);
  let state = opened();
  for (const number of [1, 2, 3, 4]) state = commands.putBeside(state, keptOf(state), number);
  assert.deepEqual(names(state), ['b1', 'c2', 'd3']);
  assert.equal(slotBeside(state), undefined);
  state = commands.takeAway(state, 'b');
  assert.deepEqual(names(commands.putBeside(state, keptOf(state), 5)), ['c2', 'd3', 'b5']);
  for (const slot of ['c', 'd']) state = commands.takeAway(state, slot);
  assert.equal(state.view.mode, 'single');
  assert.deepEqual(names(state), []);
});

test('pictures side by side lie within the canvas, and none over another', () => {
  const canvas = { width: 101, height: 55 };
  for (let count = 1; count <= 4; count++) {
    const { width, height } = tileSize(count, canvas), seen = new Set();
    for (let place = 0; place < count; place++) {
      const [left, low] = tileCorner(place, count, canvas);
      assert.ok(left >= 0 && low >= 0 && left + width <= canvas.width && low + height <= canvas.height);
      for (let x = left; x < left + width; x++) for (let y = low; y < low + height; y++) seen.add(y * canvas.width + x);
    }
    assert.equal(seen.size, count * width * height);
    assert.ok(seen.size > 0.9 * canvas.width * canvas.height || count === 3);
  }
});

test('films are added below the others, changed, moved and removed', () => {
  const [film, other] = [{ eta: 2, thickness_nm: 250 }, { eta: 1.38, thickness_nm: 100 }];
  const filmsOf = (state) => state.layers[0].keys.films;
  let state = commands.addFilm(commands.addFilm(opened(), 1, film), 1, other);
  assert.deepEqual(filmsOf(state), [film, other]);
  state = commands.setFilm(state, 1, 1, 'thickness_nm', 320);
  assert.deepEqual(filmsOf(state), [film, { ...other, thickness_nm: 320 }]);
  assert.deepEqual(documentOf(state).layers[0].interface.films, filmsOf(state));
  state = commands.moveFilm(state, 1, 1, 0);
  assert.deepEqual(filmsOf(state), [{ ...other, thickness_nm: 320 }, film]);
  assert.equal(commands.moveFilm(state, 1, 0, 0), state);
  state = commands.removeFilm(commands.removeFilm(state, 1, 0), 1, 0);
  assert.deepEqual(documentOf(state), MATERIAL, 'no films are no key');
});

test('films stay on an interface that becomes a dielectric, a metal of its own or a mirror', () => {
  const film = { eta: 2, k: 0.1, thickness_nm: 250 };
  const coated = commands.addFilm(opened(), 3, film);
  const become = (variant) => commands.setVariant(coated, 3, variant, NAMES, FRESH).layers[2].keys.films;
  assert.deepEqual(become('custom'), [film]);
  assert.deepEqual(become('dielectric'), [film]);
  assert.deepEqual(become('mirror'), [film]);
});

test('code depends on whether there are films, and whether any absorbs, and on nothing else about them', () => {
  const film = (thickness_nm, k) => ({ eta: 2, thickness_nm, ...(k && { k }) });
  const shape = (...films) => pattern(films.reduce((state, next) => commands.addFilm(state, 1, next), opened()));
  assert.equal(shape(film(100)), shape(film(900), film(50)));
  assert.notEqual(shape(), shape(film(100)));
  assert.equal(shape(), shape(film(0)), 'a thickness of 0 is no film');
  assert.notEqual(shape(film(100)), shape(film(100, 0.1)));
  assert.equal(shape(film(100, [0, 0, 0.2])), shape(film(50), film(100, 0.1)));
  assert.equal(shape(film(100)), shape(film(100), film(0, 0.1), film(50, [0, 0, 0])));
});
