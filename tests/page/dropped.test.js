// Folders that are dropped, and the images that a material names.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { filesOf, withImages } from '../../src/velatura/editor/page/dropped.js';

const fileEntry = (name) => ({ name, isDirectory: false, file: (resolve) => resolve({ name }) });
function folderEntry(name, ...inside) {
  const portions = [inside.slice(0, 1), inside.slice(1)].filter(({ length }) => length);
  return { name, isDirectory: true, createReader: () => ({ readEntries: (resolve) => resolve(portions.shift() ?? []) }) };
}
const dropOf = (...entries) => ({ items: entries.map((entry) => ({ webkitGetAsEntry: () => entry })), files: [] });

test('files of a folder have their paths', async () => {
  const drop = dropOf(folderEntry('chair', fileEntry('chair.gltf'), folderEntry('textures', fileEntry('a.png'), fileEntry('b.png'))));
  const paths = (await filesOf(drop)).map(({ path }) => path);
  assert.deepEqual(paths, ['chair/chair.gltf', 'chair/textures/a.png', 'chair/textures/b.png']);
  assert.deepEqual(await filesOf({ items: [], files: [{ name: 'a.yaml' }] }), [{ file: { name: 'a.yaml' }, path: 'a.yaml' }]);
});

test('a drop is bounded', async () => {
  await assert.rejects(filesOf(dropOf(folderEntry('many', ...Array.from({ length: 300 }, (_, k) => fileEntry(`${k}.png`))))), /256 files at most/);
  const deep = Array.from({ length: 10 }).reduce((inner, _, k) => folderEntry(`f${k}`, inner), fileEntry('a.png'));
  await assert.rejects(filesOf(dropOf(deep)), /8 deep at most/);
});

test('images are called as they lie in the folder', () => {
  const names = new Map([['chair/wood/a.png', 'a-2.png'], ['chair/metal/a.png', 'a.png'], ['chair/wood/old oak.png', 'old oak.png']]);
  const images = [{ uri: 'wood/a.png' }, { uri: './metal/a.png' }, { uri: 'wood/old%20oak.png' }, { uri: 'data:image/png;base64,AA' }, { bufferView: 0 }];
  const gltf = JSON.parse(withImages(JSON.stringify({ images }), 'chair/chair.gltf', names));
  assert.deepEqual(gltf.images, [{ uri: 'a-2.png' }, { uri: 'a.png' }, { uri: 'old%20oak.png' }, images[3], images[4]]);
  assert.equal(JSON.parse(withImages('{}', 'chair.gltf', names)).images, undefined);
  const flat = new Map([['a.png', 'a&b.png']]);
  const mtlx = '<m fileprefix="wood/"><input type="filename" value="a.png"/><input value="0.5"/></m>';
  assert.equal(withImages(mtlx, 'm.mtlx', flat), '<m><input type="filename" value="a&amp;b.png"/><input value="0.5"/></m>');
  assert.equal(withImages(mtlx, 'm.mtlx', new Map([['b.png', 'b.png']])), mtlx);
});
