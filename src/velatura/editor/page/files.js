// Materials, light, objects and textures from and to files, folders and addresses.

import { readPicture } from './render/environment.js';
import { loadObject } from './render/load.js';
import { objectOf } from './render/loader.js';
import * as commands from './state/commands.js';
import { documentOf, enabled, leavesOf } from './state/material.js';
import { mixWith, objectionToMixing } from './state/parts.js';
import { fragmentOf, readFragment } from './state/share.js';

const LETTERS = 60; // of a file name
const DROPPED = 'file:'; // before the names of environments and objects that were dropped on the page

/**
 * What can be done with files.
 *
 * @param {{store, session, call, storage, messages, address: string, saved: function, conflict: function, offer: function,
 *   copy: function}} services `saved()` after the disk has changed; `conflict(file, error)` where it was changed by others;
 *   `offer(blob, name)` hands a file to the browser, `copy(text)` to the clipboard
 */
export function createFiles({ store, session, call, storage, messages, address, saved, conflict, offer, copy }) {
  const dropped = async (name) => {
    const plain = name.slice(DROPPED.length);
    const file = await storage.get(plain);
    if (!file) throw new Error(`${plain}: drop this file on the page again`);
    return file;
  };

  const toClipboard = (text) =>
    copy(text).catch(() => {
      throw new Error('The browser does not let the page write to the clipboard.');
    });

  const files = {
    // Materials

    open(material, place) {
      store.run(commands.openMaterial, material, place);
      messages.say(`Opened ${material.name || 'a material'}.`);
    },
    /** A new material: a coat over a diffuse base. */
    fresh: () => ({ layers: ['interface', 'diffuse'].map((kind) => ({ [kind]: session.layers[kind].fresh })) }),
    begin() {
      store.run(commands.openMaterial, files.fresh());
      messages.say('A new material, not in a file yet.');
    },
    openFile: (file) =>
      messages.attempt('open', async () => {
        const { material, version } = await call('open', { file });
        files.open(material, { file, version });
      }),
    readFile: (file, take = files.open) =>
      messages.attempt('open', async () => {
        take((await call('read', { text: await file.text(), file: file.name })).material);
      }),
    /** Puts a material beside the open one, on a share of the surface. */
    mix(material) {
      const wrong = objectionToMixing(store.get(), material);
      if (wrong) return messages.complain('mix', wrong, { passing: true });
      store.run(mixWith, material);
      return messages.say(`Mixed with ${material.name || 'a material'}.`);
    },
    mixFile: (file) => messages.attempt('open', async () => files.mix((await call('open', { file })).material)),
    async save(file, version) {
      const material = documentOf(store.get());
      const off = leavesOf(store.get()).reduce((sum, { layers }) => sum + layers.length - enabled({ layers }).length, 0);
      try {
        const answer = await call('save', { file, material, version });
        store.aside(commands.saved, material, answer.file, answer.version);
        saved();
        messages.forgive('save');
        messages.say(`Saved ${answer.file}${off ? `, without what is turned off (layers: ${off})` : ''}.`);
      } catch (error) {
        if (error.status === 409) conflict(file, error);
        else messages.fail('save', error);
      }
    },
    overwrite: (file) =>
      messages.attempt('save', async () => files.save(file, (await call('open', { file })).version)),
    download: () =>
      messages.attempt('download', async () => {
        const { text, ending = 'yaml' } = await call('write', { material: documentOf(store.get()) });
        offer(new Blob([text], { type: `application/${ending}` }), files.nameOf(ending));
      }),
    /** Hands what was written of the material to the browser, as a file with an ending. */
    give: (content, ending) => offer(new Blob([content]), files.nameOf(ending)),
    copy: (text) =>
      messages.attempt('copy', async () => {
        await toClipboard(text);
        messages.say('The text is on the clipboard.');
      }),
    /** The file name of the open material: letters and digits of any language, no more than disks take. */
    nameOf(ending) {
      const letters = [...store.get().name.toLowerCase().replace(/[^\p{L}\p{N}]+/gu, '-')];
      return `${letters.slice(0, LETTERS).join('').replace(/^-|-$/g, '') || 'material'}.${ending}`;
    },
    /** Copies an address of the present state to the clipboard. */
    share: () =>
      messages.attempt('share', async () => {
        const fragment = await fragmentOf(store.get(), documentOf(store.get()));
        await toClipboard(address + fragment);
        messages.say('The address is on the clipboard; it opens this material.');
      }),
    openShared: (fragment) =>
      messages.attempt('share', async () => {
        const { material, camera, ...place } = await readFragment(fragment, session);
        const checked = await call('read', { text: JSON.stringify(material ?? null) });
        store.run(commands.openMaterial, checked.material, place);
        store.aside(commands.setCamera, camera);
        messages.say(`Opened ${checked.material.name || 'a material'} from the address.`);
      }),

    // The surroundings of the material

    /** Puts a picture into the folder; the name that it has there. */
    upload: async (file) => (await call('texture', { file: file.name, data: await base64(file) })).file,
    takeEnvironment: (file) =>
      messages.attempt('environment', async () => {
        readPicture(file.name, await file.arrayBuffer());
        await storage.put(file.name, file);
        store.run(commands.setView, { environment: DROPPED + file.name });
      }),
    takeObject: (file) =>
      messages.attempt('object', async () => {
        await loadObject(file);
        await storage.put(file.name, file);
        store.run(commands.setView, { object: DROPPED + file.name });
        store.aside(commands.setCamera, null);
      }),
    /** Opens a file dropped on the page, by its ending. */
    take(file) {
      if (/\.(ya?ml|json)$/i.test(file.name)) return files.readFile(file);
      if (/\.(hdr|exr)$/i.test(file.name)) return files.takeEnvironment(file);
      if (/\.(glb|gltf|obj)$/i.test(file.name)) return files.takeObject(file);
      return messages.complain(
        'drop',
        `${file.name}: drop a material (.yaml, .json), light (.hdr, .exr) or an object (.glb, .gltf, .obj) here,` +
          ' a texture on its value',
        { passing: true },
      );
    },

    // As the viewport takes them, by the names that the state has

    async object(name) {
      if (!name.startsWith(DROPPED)) return name;
      const { parts } = objectOf(await call('object', { name: session.objects[0] }));
      return loadObject(await dropped(name), parts.filter(({ role }) => role !== 'object'));
    },
    async environment(name) {
      if (!name.startsWith(DROPPED))
        return session.environments.find((known) => known.name === name)?.url ?? name;
      const file = await dropped(name);
      return readPicture(file.name, await file.arrayBuffer());
    },
  };
  return files;
}

async function base64(file) {
  const bytes = new Uint8Array(await file.arrayBuffer());
  let text = '';
  for (let at = 0; at < bytes.length; at += 4096)
    text += String.fromCharCode(...bytes.subarray(at, at + 4096));
  return btoa(text);
}
