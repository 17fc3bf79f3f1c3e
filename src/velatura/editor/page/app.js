// The editor: a store, a viewport that follows it, and views of both.

import { render } from 'lit-html';
import { Offline } from './connection.js';
import { readPicture } from './render/environment.js';
import { loadObject } from './render/load.js';
import { objectOf } from './render/loader.js';
import { Viewport } from './render/viewport.js';
import { lookAhead } from './state/ahead.js';
import * as commands from './state/commands.js';
import { documentOf, enabled } from './state/material.js';
import { follow } from './state/picture.js';
import { fragmentOf, readFragment } from './state/share.js';
import { createStore } from './state/store.js';
import { followTruth } from './state/truth.js';
import { mountAppearance } from './views/appearance.js';
import { mountInspector } from './views/inspector.js';
import { page } from './views/page.js';
import { followTyping, isTyping } from './views/typing.js';

const SETTLED = 400; // milliseconds after which a value that is no longer moved counts as set
const KEPT = 250; // milliseconds after a change until it is stored
const DROPPED = 'file:'; // before the names of environments that were dropped on the page

/**
 * Mounts an editor in an element.
 *
 * @param {HTMLElement} root
 * @param {{call: function, live: object, session: object, storage: object, fetch?: function, address?: string}}
 *   services `session` is the answer of that call, `storage` of state/persist.js, `fetch` gets pictures by their
 *   addresses; `live` may be null where nothing can go offline; `address` is that of the page, where it has one.
 * @returns {object} `{store, viewport, session, onLobes, destroy}`, and what the views do
 */
export function mount(root, { call, live, session, storage, fetch, address = '' }) {
  const window = root.ownerDocument.defaultView;
  const element = root.ownerDocument.createElement('div');
  element.className = 'velatura';
  root.append(element);

  const kept = storage.load();
  const { present, ...history } = kept ?? { present: beginning(session, storage) };
  const store = createStore(present, { ...history, outside: commands.OUTSIDE });
  const problems = new Map(); // what is wrong, by what it is about
  const lobeListeners = new Set();
  const ending = new AbortController();
  const { signal } = ending;
  let settling = null;
  let keeping = null;
  let announcing = null;
  let note = '';
  let picture = null;

  const app = {
    store,
    session,
    call,
    fetch,
    live,
    element,
    dropAt: null,
    face: 'layers', // of the panel
    address,
    update: () => render(page(app), element),

    // Values under the hand

    /** A change that belongs to one step with those before it, until `settle`. */
    drag(key, command, ...args) {
      clearTimeout(settling);
      app.viewport.moving(true);
      store.drag(key, command, ...args);
    },
    settle() {
      clearTimeout(settling);
      settling = setTimeout(() => {
        store.release();
        app.viewport.moving(false);
      }, SETTLED);
    },

    // Words

    /** Says what is wrong: until it is forgiven, what is `passing` until anything is done, and `away` until the server is back. */
    complain(about, text, { layer = null, actions = [], passing = false, away = false } = {}) {
      problems.delete(about); // the latest comes last
      problems.set(about, { text, layer, actions, passing, away });
      app.update();
    },
    /** The same of an act that has failed. */
    fail(about, error) {
      const away = error instanceof Offline;
      app.complain(about, error.message, { away, passing: !away });
    },
    forgive(about) {
      if (problems.delete(about)) app.update();
    },
    say(text) {
      note = text;
      app.update();
    },
    get note() {
      return note;
    },
    get problems() {
      return [...problems].map(([about, problem]) => ({ about, ...problem }));
    },
    problemOf: (layer) => app.problems.find((problem) => problem.layer === layer)?.text,
    /** Does what may fail, and says so in words. */
    async attempt(about, act) {
      try {
        await act();
        app.forgive(about);
      } catch (error) {
        app.fail(about, error);
      }
    },

    // Files

    /** A file of the user's, or undefined where none is chosen. */
    chooseFile(accept) {
      const input = Object.assign(root.ownerDocument.createElement('input'), {
        type: 'file',
        accept,
        hidden: true,
      });
      element.append(input);
      return new Promise((resolve) => {
        const done = () => {
          input.remove();
          resolve(input.files[0]);
        };
        input.addEventListener('change', done);
        input.addEventListener('cancel', done);
        input.click();
      });
    },
    /** Puts a picture into the folder; the name that it has there. */
    upload: async (file) => (await call('texture', { file: file.name, data: await base64(file) })).file,
    open: (material, place) => {
      store.run(commands.openMaterial, material, place);
      app.say(`Opened ${material.name || 'a material'}.`);
    },
    /** Opens a target that Python has answered, as a material that has it. */
    openTarget({ material, model, ...said }) {
      appearance.know(material, model, said);
      app.open(material, { model });
      app.show('appearance');
    },
    openFile: (file) =>
      app.attempt('open', async () => {
        const { material, version } = await call('open', { file });
        app.open(material, { file, version });
      }),
    readFile: (file) =>
      app.attempt('open', async () => app.open((await call('read', { text: await file.text(), file: file.name })).material)),
    async save(file, version) {
      const material = documentOf(store.get());
      const off = store.get().layers.length - enabled(store.get()).length;
      try {
        const answer = await call('save', { file, material, version });
        store.aside(commands.saved, material, answer.file, answer.version);
        flush(); // another tab may begin from it
        app.forgive('save');
        app.say(
          `Saved ${answer.file}${off ? `, without what is turned off (layers: ${off})` : ''}.`,
        );
      } catch (error) {
        if (error.status === 409) app.complain('save', error.message, { actions: conflict(app, file) });
        else app.fail('save', error);
      }
    },
    async download() {
      await app.attempt('download', async () => {
        const { text } = await call('write', { material: documentOf(store.get()) });
        app.offer(new Blob([text], { type: 'application/yaml' }), `${fileName(store.get())}.yaml`);
      });
    },
    async savePicture() {
      app.viewport.paint();
      const blob = await new Promise((resolve) => app.canvas.toBlob(resolve));
      app.offer(blob, `${fileName(store.get())}.png`);
    },
    /** Hands a file to the browser. */
    offer(blob, name) {
      const href = window.URL.createObjectURL(blob);
      const link = Object.assign(root.ownerDocument.createElement('a'), { href, download: name });
      link.click();
      setTimeout(() => window.URL.revokeObjectURL(href), 1000);
    },
    async takeEnvironment(file) {
      await app.attempt('environment', async () => {
        readPicture(file.name, await file.arrayBuffer());
        await storage.put(file.name, file);
        store.run(commands.setView, { environment: DROPPED + file.name });
      });
    },
    async takeObject(file) {
      await app.attempt('object', async () => {
        await loadObject(file);
        await storage.put(file.name, file);
        store.run(commands.setView, { object: DROPPED + file.name });
        store.aside(commands.setCamera, null);
      });
    },
    /** What was dropped on the page, by its ending. */
    take(file) {
      if (/\.(ya?ml|json)$/i.test(file.name)) return app.readFile(file);
      if (/\.(hdr|exr)$/i.test(file.name)) return app.takeEnvironment(file);
      if (/\.(glb|gltf|obj)$/i.test(file.name)) return app.takeObject(file);
      return app.complain(
        'drop',
        `${file.name}: drop a material (.yaml, .json), light (.hdr, .exr) or an object (.glb, .gltf, .obj) here,` +
          ' a texture on its value',
        { passing: true },
      );
    },

    /** An address that opens what is shown, on the clipboard. */
    async share() {
      await app.attempt('share', async () => {
        const fragment = await fragmentOf(store.get(), documentOf(store.get()));
        await window.navigator.clipboard.writeText(address + fragment).catch(() => {
          throw new Error('The browser does not let the page write to the clipboard.');
        });
        app.say('The address is on the clipboard; it opens this material.');
      });
    },
    async openShared(fragment) {
      await app.attempt('share', async () => {
        const { material, camera, ...place } = await readFragment(fragment, session);
        const checked = await call('read', { text: JSON.stringify(material ?? null) });
        store.run(commands.openMaterial, checked.material, place);
        store.aside(commands.setCamera, camera);
        app.say(`Opened ${checked.material.name || 'a material'} from the address.`);
      });
    },

    // The panel

    /** Turns to the layers, or to their appearance. */
    show(face) {
      app.face = face;
      app.update();
      appearance.follow();
    },

    // The picture

    shader: (slot = 'a') => picture?.shader(slot),
    /** The state whose values are drawn, which may be a while behind the store's. */
    given: (slot = 'a') => picture?.given(slot),
    /** Whether Python is, or will be, asked about the picture. */
    get pending() {
      return !picture.quiet;
    },
    /** Whether Python has answered all that it was asked about the picture, and about what may come. */
    get quiet() {
      return !app.pending && appearance.quiet && ahead.quiet;
    },
    /** Calls f(slot) after the values or the material of a slot have changed. Returns what ends that. */
    onLobes(f) {
      lobeListeners.add(f);
      return () => lobeListeners.delete(f);
    },
    /** Focuses what a selector finds, once it is there. */
    focus: (selector) => element.querySelector(selector)?.focus(),
    destroy() {
      ending.abort();
      clearTimeout(settling);
      flush();
      ahead.stop();
      picture.stop();
      truth.stop();
      inspector.destroy();
      appearance.destroy();
      app.viewport.dispose();
      element.remove();
    },
  };

  // The page, and the canvas in it
  app.viewport = idle;
  app.update();
  app.canvas = element.querySelector('canvas');
  app.viewport = viewportOf(app);

  // The picture follows the state, and the page follows both
  const droppedFile = async (name) => {
    const plain = name.slice(DROPPED.length);
    const file = await storage.get(plain);
    if (!file) throw new Error(`${plain}: drop this file on the page again`);
    return file;
  };
  const files = {
    object: async (name) => {
      if (!name.startsWith(DROPPED)) return name;
      const { parts } = objectOf(await call('object', { name: session.objects[0] }));
      return loadObject(await droppedFile(name), parts.filter(({ role }) => role !== 'object'));
    },
    environment: async (name) => {
      if (!name.startsWith(DROPPED))
        return session.environments.find((known) => known.name === name)?.url ?? name;
      const file = await droppedFile(name);
      return readPicture(file.name, await file.arrayBuffer());
    },
  };
  picture = follow({
    ...{ store, viewport: app.viewport, call, session, files },
    onShader: () => app.update(),
    onProblem: (about, error) => {
      if (!error) return app.forgive(about);
      const number = error.message.match(/^layer (\d+)/)?.[1];
      const text =
        error instanceof Offline ? 'The server is away: the picture follows when it is back.' : error.message;
      app.complain(about, text, { layer: number && enabled(store.get())[number]?.id });
    },
    onBaked(slot) {
      announcing ??= window.requestAnimationFrame(() => {
        announcing = null;
        for (const listener of lobeListeners) listener(slot);
      });
    },
  });
  const ahead = lookAhead({ store, viewport: app.viewport, call, drawn: () => picture.drawn('a') });
  const truth = followTruth({
    ...{ store, viewport: app.viewport, call },
    onProblem: (error) => (error ? app.complain('truth', `The truth: ${error.message}`) : app.forgive('truth')),
  });
  const inspector = mountInspector(element.querySelector('.inspector-slot'), app);
  const appearance = mountAppearance(element.querySelector('.appearance-slot'), app);

  store.subscribe(() => {
    forgiveAll('passing');
    note = '';
    clearTimeout(keeping);
    keeping = setTimeout(flush, KEPT);
    app.update();
  });
  app.viewport.onCamera((camera) => store.aside(commands.setCamera, camera));
  const stopListening = live?.onChange((online) => {
    if (online) {
      forgiveAll('away');
      picture.again();
      truth.again();
    }
    app.update();
  });

  /** What is no longer wrong: of all that is `passing`, or `away`. */
  function forgiveAll(kind) {
    for (const [about, problem] of problems) if (problem[kind]) app.forgive(about);
  }

  function flush() {
    clearTimeout(keeping);
    storage.save(store.history());
  }

  window.addEventListener('pagehide', flush, { signal });
  root.addEventListener('keydown', (event) => onKey(app, event), { signal });
  followTyping(element, { signal });
  element.addEventListener('input', () => forgiveAll('passing'), { signal });
  root.addEventListener('dragover', (event) => event.preventDefault(), { signal });
  root.addEventListener('drop', (event) => onDrop(app, event), { signal });
  signal.addEventListener('abort', () => stopListening?.());
  const ticking = window.setInterval(() => showSamples(app), 250);
  signal.addEventListener('abort', () => window.clearInterval(ticking));
  app.update();
  return app;
}

/** The material of the command line, or the last one of any tab, or the first preset. */
function beginning(session, storage) {
  const { opened } = session;
  if (opened) return commands.initial(opened.material, session, opened);
  return (
    storage.last() ??
    commands.initial(session.presets.find(({ name }) => name === 'coated-gold').material, session)
  );
}

/** Stands for a viewport while there is none. */
const idle = { moving() {} };

function viewportOf(app) {
  try {
    return new Viewport(app.canvas, {
      ...{ call: app.call, fetch: app.fetch },
      onError: (error) => app.complain('picture', error.message),
    });
  } catch (error) {
    app.complain('picture', error.message);
    throw error;
  }
}

function conflict(app, file) {
  return [
    { title: 'Reload the file', act: () => app.forgive('save') || app.openFile(file) },
    { title: 'Save under another name', act: () => app.forgive('save') || app.saveAs() },
    {
      title: 'Overwrite it',
      act: () => app.attempt('save', async () => app.save(file, (await app.call('open', { file })).version)),
    },
  ];
}

const fileName = ({ name }) =>
  name
    .toLowerCase()
    .replace(/[^\p{L}\p{N}]+/gu, '-')
    .replace(/^-|-$/g, '') || 'material';

async function base64(file) {
  const bytes = new Uint8Array(await file.arrayBuffer());
  let text = '';
  for (let at = 0; at < bytes.length; at += 4096)
    text += String.fromCharCode(...bytes.subarray(at, at + 4096));
  return btoa(text);
}

function onKey(app, event) {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
  const key = event.key.toLowerCase();
  const act = {
    z: event.shiftKey ? app.store.redo : app.store.undo,
    y: app.store.redo,
    s: () => app.saveAgain(),
  }[key];
  if (!act || (key !== 's' && isTyping(event.target))) return; // in a field its own undo is meant
  event.preventDefault();
  act();
}

function onDrop(app, event) {
  const [file] = event.dataTransfer?.files ?? [];
  if (!file) return;
  event.preventDefault();
  app.take(file);
}

/** The count of samples, which changes too often to draw the page for it. */
function showSamples(app) {
  const place = app.element.querySelector('.samples');
  const { samples, truth } = app.viewport;
  const shown = Number.isFinite(samples) && samples > 0 ? `${samples} samples` : 'preview';
  place.textContent = truth ? `${shown}, truth ${truth.samples || 'on its way'}` : shown;
}
