// The editor: a store, a viewport that follows it, and views of both.

import { render } from 'lit-html';
import { Offline } from './connection.js';
import { filesOf } from './dropped.js';
import { createFiles } from './files.js';
import { mirrored } from './render/lights.js';
import { Viewport } from './render/viewport.js';
import { lookAhead } from './state/ahead.js';
import * as commands from './state/commands.js';
import { createEdits } from './state/edits.js';
import { chosenOf, enabled, leavesOf } from './state/material.js';
import { createMessages } from './state/messages.js';
import { chooseCovering, coveringName } from './state/parts.js';
import { follow } from './state/picture.js';
import { createSnapshots } from './state/snapshots.js';
import { createStore } from './state/store.js';
import { createStrips } from './state/strips.js';
import { createSwatches } from './state/swatches.js';
import { followTruth } from './state/truth.js';
import { createAim } from './views/aim.js';
import { mountAppearance } from './views/appearance.js';
import { chooseFile, offer } from './views/browser.js';
import { createChoice } from './views/choice.js';
import { mountInspector } from './views/inspector.js';
import { createLayers } from './views/layers.js';
import { createLayout } from './views/layout.js';
import { createPage } from './views/page.js';
import { createModel, createView } from './views/settings.js';
import { createStrip } from './views/strip.js';
import { createToolbar } from './views/toolbar.js';
import { followScrubbing } from './views/scrubbing.js';
import { followTyping, isTyping } from './views/typing.js';

const KEPT = 250; // milliseconds after a change until it is stored
const NO_COLOUR = 'There is no colour to take: choose a place where one picture is shown, or the photograph.';
const NO_HIGHLIGHT = 'There is nothing of the object: choose a place on it, where one picture is shown.';
const COUNTED = 250; // milliseconds between two looks at the count of samples

/**
 * Mounts an editor in an element.
 *
 * @param {HTMLElement} root
 * @param {{call: function, lacks?: function, live: object, session: object, storage: object, fetch?: function, address?: string}}
 *   services `session` is the answer of that call, `storage` of state/persist.js, `fetch` gets pictures by their
 *   addresses; `live` may be null where nothing can go offline; `lacks(name)` says why a verb or
 *   another thing is not there, '' where it is; `address` is that of the page, where it has one.
 * @returns {object} `{store, session, live, viewport, canvas, element, shader, problems, quiet, drag, settle, openFile, openShared,
 *   destroy}`
 */
export function mount(root, { call, lacks = nothingLacks, live, session, storage, fetch, address = '' }) {
  const document = root.ownerDocument, window = document.defaultView;
  const element = document.createElement('div');
  element.className = 'velatura';
  root.append(element);

  const kept = storage.load();
  const { present, ...history } = kept ?? { present: beginning(session, storage) };
  const store = createStore(present, { ...history, outside: commands.OUTSIDE });
  const keeper = createKeeper(storage, store);
  let page = null;
  const messages = createMessages(update);
  const canvas = canvasOf(document);
  const viewport = viewportOf(element, canvas, {
    ...{ call, fetch, displayed: session.views[0].text },
    onError: (error) => messages.complain('picture', error.message),
  });
  const aim = createAim({ element, update });
  const swatches = createSwatches(storage, update);
  const edits = createEdits({ store, viewport, messages, colours: { swatches, pick: pickColour } });
  const arrangement = createLayout(storage, update);
  const lobes = createSignal(window);
  const focus = (selector) => element.querySelector(selector)?.focus();
  const choose = (accept) => chooseFile(element, accept);

  const choice = createChoice(update);
  const files = createFiles({
    ...{ store, session, call, lacks, storage, messages, address, ask: choice.ask },
    saved: keeper.flush, // another tab may begin from it
    conflict: (file, error) => messages.complain('save', error.message, { actions: conflict(file) }),
    offer: (blob, name) => offer(document, blob, name),
    copy: async (text) => window.navigator.clipboard.writeText(text),
  });

  // The picture follows the state

  const picture = follow({
    ...{ store, viewport, call, lacks, session, files },
    onShader: update,
    onObject: update,
    onProblem(about, error) {
      if (!error) return messages.forgive(about);
      const number = layerNamed(error.message, store.get());
      const text =
        error instanceof Offline ? 'The server is away: the picture follows when it is back.' : error.message;
      return messages.complain(about, text, { layer: number && enabled(store.get())[number]?.id });
    },
    onBaked: lobes.send,
  });
  const ahead = lookAhead({ store, viewport, call, lacks, session, drawn: () => picture.drawn('a') });
  const truth = followTruth({
    ...{ store, viewport, call, files },
    onProblem: (error) =>
      error ? messages.complain('truth', `The truth: ${error.message}`) : messages.forgive('truth'),
  });
  const snapshots = createSnapshots({ store, viewport, picture, storage, onChange: update });
  const isQuiet = () => picture.quiet && appearance.quiet && ahead.quiet;

  // The page follows both

  const toolbar = createToolbar({
    ...{ store, session, viewport, call, lacks, live, address, files, messages, update, choose },
    /** Opens a target that Python has answered, as a material that has it. */
    openTarget({ material, model, ...said }) {
      appearance.know(material, model, said);
      files.open(material, { model });
      page.show('appearance');
    },
    async savePicture() {
      viewport.paint();
      const blob = await new Promise((resolve) => canvas.toBlob(resolve));
      offer(document, blob, files.nameOf('png'));
    },
  });
  page = createPage({
    ...{ store, session, ...arrangement, edits, messages, picture, canvas, focus, update, lacks, toolbar: toolbar.view },
    choice: choice.view,
    aim: aim.view,
    layers: createLayers({
      ...{ store, session, ...arrangement, lacks, edits, messages, choose, upload: files.upload, focus, update, viewport, mix: toolbar.mix, give: toolbar.give },
      strips: createStrips({ call, lacks, update }),
    }),
    strip: createStrip({ store, snapshots, focus, update }),
    view: createView({ store, session, edits, picture, choose, placeLight, takeEnvironment: files.takeEnvironment }),
    model: createModel({ store, session, lacks, choose, takePhotograph: files.takePhotograph }),
    onFace: () => appearance.follow(),
  });
  update();
  const inspector = mountInspector(element.querySelector('.inspector-slot'), {
    ...{ store, session, viewport, call, lacks, picture },
    onLobes: lobes.listen,
  });
  const appearance = mountAppearance(element.querySelector('.appearance-slot'), {
    ...{ store, session, call, live, viewport, edits, messages, picture, isQuiet },
  });

  function update() {
    if (!page) return;
    render(page.view(), element);
    if (address) document.title = `${store.get().name || 'Material'} - Velatura`;
  }

  /** The colour of a place of the picture that is asked for, each channel from 0 to 1; null where there is none. */
  async function pickColour() {
    const place = await aim.ask('A colour'), rgb = place && viewport.lightAt(place);
    if (place && !rgb) messages.complain('colour', NO_COLOUR, { passing: true });
    if (!rgb) return null;
    const most = Math.max(...rgb);
    if (most > 1) messages.say('That light is brighter than white: its colour is taken at the brightest.');
    return rgb.map((channel) => Math.max(channel, 0) / Math.max(most, 1));
  }

  /** Moves a light to where its highlight is seen at a place of the picture that is asked for. */
  async function placeLight(number) {
    const place = await aim.ask(`Light ${number + 1}`), seen = place && viewport.seenAt(place);
    if (place && !seen) messages.complain('light', NO_HIGHLIGHT, { passing: true });
    if (!seen) return;
    const { lights, rotation } = store.get().view;
    store.run(commands.setView, { lights: lights.with(number, { ...lights[number], ...mirrored(seen, rotation) }) });
  }

  function conflict(file) {
    return [
      { title: 'Reload the file', act: () => messages.forgive('save') || files.openFile(file) },
      { title: 'Save under another name', act: () => messages.forgive('save') || toolbar.saveAs() },
      { title: 'Overwrite it', act: () => files.overwrite(file) },
    ];
  }

  // Input from outside

  store.subscribe(() => {
    messages.done();
    keeper.later();
    update();
  });
  viewport.onCamera((camera) => store.aside(commands.setCamera, camera));
  viewport.onTurn((degrees) => {
    const { rotation } = store.get().view, turned = Math.round(10 * (rotation + degrees)) / 10;
    edits.drag('view.rotation', commands.setView, { rotation: turned - 360 * Math.floor((turned + 180) / 360) });
    edits.settle();
  });
  viewport.onTap((place) => {
    if (viewport.names.length < 2) return;
    const seen = viewport.seenAt(place);
    if (!seen) return;
    store.aside(chooseCovering, seen.name);
    messages.say(`${seen.name} is ${coveringName(store.get(), seen.name)}.`);
  });
  const stopListening = live?.onChange((online) => {
    if (online) {
      messages.forgiveAll('away');
      picture.again();
      truth.again();
    }
    update();
  });
  const ending = new AbortController(), { signal } = ending;
  window.addEventListener('pagehide', keeper.flush, { signal });
  const away = 'The browser has taken the graphics device away: the picture follows when it is back.';
  canvas.addEventListener('webglcontextlost', () => messages.complain('device', away), { signal });
  canvas.addEventListener('webglcontextrestored', () => messages.forgive('device'), { signal });
  root.addEventListener('keydown', (event) => onKey(event, { store, save: lacks('save') ? files.download : toolbar.saveAgain }), { signal });
  followTyping(element, { signal });
  followScrubbing(element, { signal });
  element.addEventListener('input', () => messages.forgiveAll('passing'), { signal });
  root.addEventListener('dragover', (event) => event.preventDefault(), { signal });
  root.addEventListener('drop', (event) => onDrop(event, { files, messages }), { signal });
  const counting = window.setInterval(() => {
    showSamples(element, viewport, picture.stage);
    showDifference(element, viewport);
    snapshots.look();
    toolbar.look(snapshots.current()?.picture);
  }, COUNTED);

  return {
    ...{ store, session, live, viewport, canvas, element },
    ...{ drag: edits.drag, settle: edits.settle, openFile: files.openFile, openShared: files.openShared },
    /** The answer of call("shader") that a slot draws. */
    shader: (slot = 'a') => picture.shader(slot),
    get problems() {
      return messages.problems;
    },
    /** Whether Python has answered all requests for the picture, and those made in advance. */
    get quiet() {
      return isQuiet();
    },
    destroy() {
      ending.abort();
      stopListening?.();
      window.clearInterval(counting);
      edits.stop();
      keeper.flush();
      ahead.stop();
      picture.stop();
      truth.stop();
      inspector.destroy();
      appearance.destroy();
      viewport.dispose();
      element.remove();
    },
  };
}

/** The number of the layer of the chosen stack that a message of Python begins with. */
function layerNamed(message, state) {
  const { prefix } = leavesOf(state)[chosenOf(state)], parts = prefix.replace(/part(\d+)_/g, 'mix: part $1: material: ');
  return message.startsWith(parts) ? message.slice(parts.length).match(/^layer (\d+)/)?.[1] : undefined;
}

/** Why something is not there, where all is. */
const nothingLacks = () => '';

/** The material of the command line, or the last one of any tab, or the first preset. */
function beginning(session, storage) {
  const { opened } = session;
  if (opened) return commands.initial(opened.material, session, opened);
  return (
    storage.last() ??
    commands.initial(session.presets.find(({ name }) => name === 'coated-gold').material, session)
  );
}

/** Stores the history: a while after changes, or at once. */
function createKeeper(storage, store) {
  let timer = null;
  const flush = () => {
    clearTimeout(timer);
    storage.save(store.history());
  };
  const later = () => {
    clearTimeout(timer);
    timer = setTimeout(flush, KEPT);
  };
  return { flush, later };
}

/** `listen(f)` has f called with a slot after its values or its material have changed, once a frame. */
function createSignal(window) {
  const listeners = new Set();
  let frame = null;
  return {
    listen(f) {
      listeners.add(f);
      return () => listeners.delete(f);
    },
    send(slot) {
      frame ??= window.requestAnimationFrame(() => {
        frame = null;
        for (const listener of listeners) listener(slot);
      });
    },
  };
}

function canvasOf(document) {
  const canvas = document.createElement('canvas');
  canvas.setAttribute('aria-label', 'The material on an object; arrow keys turn it, with Shift the light; plus and minus come closer');
  canvas.setAttribute('role', 'img');
  return canvas;
}

/** Where the browser cannot draw, the element says so. */
function viewportOf(element, canvas, options) {
  try {
    return new Viewport(canvas, options);
  } catch (error) {
    element.textContent = error.message;
    throw error;
  }
}

function onKey(event, { store, save }) {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
  const key = event.key.toLowerCase();
  const act = { z: event.shiftKey ? store.redo : store.undo, y: store.redo, s: save }[key];
  if (!act || (key !== 's' && isTyping(event.target))) return; // in a field its own undo is meant
  event.preventDefault();
  act();
}

/** Takes files and folders, or the name of a preset that is dragged as text; text that is dropped into a field is the field's. */
function onDrop(event, { files: { takeAll, openPreset }, messages }) {
  const { dataTransfer } = event, holdsFiles = dataTransfer?.files.length > 0;
  const name = dataTransfer?.getData('text/plain').trim();
  if (!holdsFiles && (!name || event.target.matches?.('input, textarea'))) return;
  event.preventDefault();
  if (!holdsFiles) return void openPreset(name);
  const dropped = filesOf(dataTransfer);
  messages.attempt('files', async () => takeAll(await dropped));
}

const counted = (count, noun) => `${count} ${noun}${count === 1 ? '' : 's'}`;

async function showDifference(element, viewport) {
  const mean = await viewport.difference();
  const place = element.querySelector('.measure');
  if (place && mean !== null) place.textContent = `mean ${mean.toFixed(4)}`;
}

const STAGES = { solving: 'solving the layers \u2026', compiling: 'compiling the shader \u2026' };

/** The count of samples, which changes too often to draw the page for it, or what the picture waits for. */
function showSamples(element, { samples, truth, lost, warming, previewed }, stage) {
  const waits = lost ? 'no graphics device' : STAGES[warming && !previewed ? 'compiling' : stage];
  if (waits) {
    element.querySelector('.samples').textContent = waits;
    return;
  }
  const shown = Number.isFinite(samples) && samples > 0 ? counted(samples, 'sample') : 'preview';
  const place = element.querySelector('.samples');
  place.textContent = truth ? `${shown}, truth ${truth.samples || 'on its way'}` : shown;
}
