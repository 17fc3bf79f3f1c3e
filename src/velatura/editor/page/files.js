// Materials, light, objects and textures from and to files, folders and addresses.

import { base64 } from './arrays.js';
import { withImages } from './dropped.js';
import { readPicture } from './render/environment.js';
import { contentsOf, loadObject } from './render/load.js';
import { objectOf } from './render/loader.js';
import { buildScene } from './render/scene.js';
import * as commands from './state/commands.js';
import { documentOf, enabled, leavesOf } from './state/material.js';
import { MOST, cover, mixWith, objectionToMixing } from './state/parts.js';
import { fragmentOf, readFragment } from './state/share.js';

const LETTERS = 60; // of a file name
export const FOREIGN = ['.mtlx', '.gltf', '.glb', '.xml']; // files of other programs that hold a material
const IMAGES = /\.(png|jpe?g|exr|hdr)$/i;
const OBJECT = 'The object';
const DRESSED = 'The object with its materials';
const NAMED = 3; // parameters in a message
const DROPPED = 'file:'; // before the names of environments and objects that were dropped on the page

/**
 * What can be done with files.
 *
 * @param {{store, session, call, lacks, storage, messages, address: string, ask: function, saved: function, conflict: function,
 *   offer: function, copy: function}} services `ask(title, options)` of views/choice.js; `saved()` after the disk has changed; `conflict(file, error)` where it was changed by others;
 *   `offer(blob, name)` hands a file to the browser, `copy(text)` to the clipboard
 */
export function createFiles({ store, session, call, lacks, storage, messages, address, ask, saved, conflict, offer, copy }) {
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

  /** Has `take` called with the material of a file of another program, of the folder or in `data`: with one of several. */
  async function importFile(question, take) {
    const { file } = question;
    let answer = await call('import', question);
    if (answer.names) {
      const name = await ask(`${file} holds ${answer.names.length} materials`, answer.names);
      if (name === undefined) return;
      answer = await call('import', { ...question, name });
    }
    take(answer.material, { imported: { file, left: answer.left } });
  }

  const files = {
    // Materials

    open(material, place) {
      store.run(commands.openMaterial, material, place);
      messages.say(`Opened ${material.name || 'a material'}.${remarks(place?.imported)}`);
    },
    openPreset(name) {
      const known = session.presets.find((preset) => preset.name === name);
      if (known) return files.open(known.material);
      return messages.complain('drop', `${name.slice(0, LETTERS)}: is not the name of a preset`, { passing: true });
    },
    /** A new material: a coat over a diffuse base. */
    fresh: () => ({ layers: ['interface', 'diffuse'].map((kind) => ({ [kind]: session.layers[kind].fresh })) }),
    begin() {
      store.run(commands.openMaterial, files.fresh());
      messages.say('A new material, not in a file yet.');
    },
    openFile: (file, take = files.open) =>
      messages.attempt('open', async () => {
        if (isForeign(file)) return importFile({ file }, take);
        const { material, version } = await call('open', { file });
        return take(material, { file, version });
      }),
    readFile: (file, take = files.open) =>
      messages.attempt('open', async () => {
        if (isForeign(file.name)) return importFile({ file: file.name, data: await base64(file) }, take);
        return take((await call('read', { text: await file.text(), file: file.name })).material);
      }),
    /** Reads the material of a chosen file, or takes its object where that is asked for. */
    readChosen: (file, take = files.open) => (isGltf(file.name) ? files.takeGltf(file, take) : files.readFile(file, take)),
    /** Puts a material beside the open one, on a share of the surface. */
    mix(material, place) {
      const wrong = objectionToMixing(store.get(), material);
      if (wrong) return messages.complain('mix', wrong, { passing: true });
      store.run(mixWith, material);
      return messages.say(`Mixed with ${material.name || 'a material'}.${remarks(place?.imported)}`);
    },
    /** Gives a part of the object, by its name, a material. */
    cover(name, material, place) {
      const wrong = objectionToMixing(store.get(), material);
      if (wrong) return messages.complain('mix', wrong, { passing: true });
      store.run(cover, name, material);
      return messages.say(`${name} is made of ${material.name || 'a material'}.${remarks(place?.imported)}`);
    },
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
    /** Hands what was written of the material to the browser, as a file with an ending, or with a name. */
    give: (content, ending) => files.giveAs(content, files.nameOf(ending)),
    giveAs: (content, name) => offer(new Blob([content]), name),
    /** The material that a program has of a text that was written for it: the stack nearest to its parameters. */
    async readBack(text, ending) {
      const data = await base64(new Blob([text]));
      return (await call('import', { file: `material.${ending}`, data, bare: true })).material;
    },
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
    /** Whether a name is of light or an object that was dropped on the page. */
    isDropped: (name) => name.startsWith(DROPPED),
    /** The name of light as Python knows it: a dropped file is put into the folder. */
    lightOf: async (name) => (name.startsWith(DROPPED) ? files.upload(await dropped(name)) : name),
    /** A dropped object as the triangles that Python takes; undefined of an object that it knows. */
    async meshOf(name) {
      if (!name.startsWith(DROPPED)) return undefined;
      const { parts } = await loadObject(await dropped(name));
      const { positions, normals, uv, triangles, names } = buildScene(parts);
      const sent = Object.entries({ positions, normals, uv, triangles });
      const mesh = Object.fromEntries(await Promise.all(sent.map(async ([key, array]) => [key, await base64(new Blob([array]))])));
      const count = (one) => parts.reduce((sum, part) => sum + (part.name === one ? part.triangles.length / 3 : 0), 0);
      return names.length > 1 ? { ...mesh, parts: names.map((one) => ({ name: one, triangles: count(one) })) } : mesh;
    },
    takeEnvironment: (file) =>
      messages.attempt('environment', async () => {
        readPicture(file.name, await file.arrayBuffer());
        await storage.put(file.name, file);
        store.run(commands.setView, { environment: DROPPED + file.name });
      }),
    /** Puts a photograph on the right of a split screen. */
    takePhotograph: (file) =>
      messages.attempt('photograph', async () => {
        await imageOf(file);
        await storage.put(file.name, file);
        store.run(commands.setView, { mode: 'split', other: { photograph: DROPPED + file.name, title: file.name } });
        messages.say(`${file.name} is beside the picture. An image becomes a texture where it is dropped on a value.`);
      }),
    takeObject: (file) =>
      messages.attempt('object', async () => {
        await loadObject(file);
        await storage.put(file.name, file);
        store.run(commands.setView, { object: DROPPED + file.name });
        store.aside(commands.setCamera, null);
      }),
    /** Takes what a .gltf or .glb holds: its object, one of its materials, or the one of both that is asked for. */
    takeGltf: (file, take = files.open) =>
      messages.attempt('object', async () => {
        const { meshes, materials } = await contentsOf(file);
        if (!meshes && !materials) throw new Error(`${file.name}: holds neither an object nor a material`);
        if (!materials || lacks('import')) return files.takeObject(file);
        if (!meshes) return files.readFile(file, take);
        const chosen = await ask(`${file.name} holds an object and materials`, [OBJECT, ...(take === files.open ? [DRESSED] : []), 'A material']);
        if (!chosen) return null;
        if (chosen === DRESSED) return files.takeDressed(file);
        return chosen === OBJECT ? files.takeObject(file) : files.readFile(file, take);
      }),
    /** Takes the object of a .gltf or .glb, and all of its materials, each for the parts that have it. */
    async takeDressed(file) {
      const data = await base64(file), read = (name) => call('import', { file: file.name, data, name });
      const { names, ...one } = await read();
      if (names?.length > MOST) throw new Error(`${file.name}: holds ${names.length} materials, more than the ${MOST} of a mixture`);
      const answers = [];
      for (const name of names ?? []) answers.push(await read(name));
      const parts = answers.map(({ material }, k) => ({
        ...(k < answers.length - 1 && { weight: 1 / answers.length }),
        material,
        covers: names[k].slice(0, LETTERS),
      }));
      const left = [one, ...answers].flatMap((answer) => answer.left ?? []);
      files.open(one.material ?? { name: file.name.replace(/\.\w+$/, ''), mix: parts }, { imported: { file: file.name, left } });
      return files.takeObject(file);
    },
    /** Takes files dropped at once, `[{file, path}]`: one, or a material with its images, which are put into the folder. */
    async takeAll(list) {
      const material = list.length > 1 && list.find(({ path }) => isForeign(path));
      if (!material) return list.length ? files.take(list[0].file) : null;
      return messages.attempt('images', async () => {
        const names = new Map();
        for (const { file, path } of list.filter(({ path }) => IMAGES.test(path))) names.set(path, await files.upload(file));
        const { file, path } = material;
        if (!names.size || /\.glb$/i.test(path)) return files.take(file);
        return files.take(new File([withImages(await file.text(), path, names)], file.name));
      });
    },
    /** Opens a file dropped on the page, by its ending. */
    take(file) {
      if (/\.(ya?ml|json)$/i.test(file.name)) return files.readFile(file);
      if (/\.(hdr|exr)$/i.test(file.name)) return files.takeEnvironment(file);
      if (isGltf(file.name)) return files.takeGltf(file);
      if (isForeign(file.name)) return files.readFile(file);
      if (/\.obj$/i.test(file.name)) return files.takeObject(file);
      if (/\.(png|jpe?g|webp|avif)$/i.test(file.name)) return files.takePhotograph(file);
      return messages.complain(
        'drop',
        `${file.name}: drop a material (.yaml, .json, ${FOREIGN.join(', ')}), light (.hdr, .exr), an object (.glb, .gltf, .obj) or a` +
          ' photograph (.png, .jpg) here, a texture on its value',
        { passing: true },
      );
    },

    // As the viewport takes them, by the names that the state has

    async object(name) {
      if (!name.startsWith(DROPPED)) return name;
      const { parts } = objectOf(await call('object', { name: session.objects[0] }));
      return loadObject(await dropped(name), parts.filter(({ role }) => role !== 'object'));
    },
    photograph: async (name) => imageOf(await dropped(name)),
    async environment(name) {
      if (!name.startsWith(DROPPED))
        return session.environments.find((known) => known.name === name)?.url ?? name;
      const file = await dropped(name);
      return readPicture(file.name, await file.arrayBuffer());
    },
  };
  return files;
}

/** The image in a file. Raises Error in words. */
const imageOf = (file) =>
  createImageBitmap(file).catch(() => {
    throw new Error(`${file.name}: is no image that this browser reads`);
  });

const isForeign = (name) => FOREIGN.some((ending) => name.toLowerCase().endsWith(ending));
const isGltf = (name) => /\.(glb|gltf)$/i.test(name);

/** What an import has left, as a sentence: a few parameters by name. */
function remarks(imported) {
  if (!imported?.left.length) return '';
  const names = imported.left.slice(0, NAMED).map((line) => line.split(' ')[0]);
  const more = imported.left.length > NAMED ? ', \u2026' : '';
  return ` Not carried from ${imported.file}, or not as it was: ${names.join(', ')}${more}. Layers has the reasons.`;
}
