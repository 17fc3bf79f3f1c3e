// The notebook's entry: the editor in a cell, with Python's `stack` and `model` as its material and model.

import { mount } from './app.js';
import { Refused, latest } from './connection.js';
import './editor.css';
import * as commands from './state/commands.js';
import { documentOf } from './state/material.js';
import { memoryStorage } from './state/persist.js';

/** Calls as messages to the widget in Python, which sends them back answered. */
function connect(model) {
  const page = Math.random().toString(36).slice(2); // the same widget may be shown in others
  const sent = new Map(); // id -> {resolve, reject}
  let count = 0;

  function settle({ id, answer, error, status }, buffers) {
    if (!sent.has(id)) return;
    const { resolve, reject } = sent.get(id);
    sent.delete(id);
    if (error === undefined) resolve({ answer, buffers });
    else reject(new Refused(error, status));
  }

  function send(verb, body) {
    const id = `${page}-${(count += 1)}`;
    model.send({ id, verb, body });
    return new Promise((resolve, reject) => sent.set(id, { resolve, reject }));
  }

  model.on('msg:custom', settle);
  return {
    call: async (verb, body = {}) => (await send(verb, body)).answer,
    fetch: async (address) => new Response((await send('file', { address })).buffers[0]),
    close: () => model.off('msg:custom', settle),
  };
}

/** What Python has of a state, by the name of its trait. */
const shared = (state) => ({
  stack: documentOf(state),
  model: { name: state.model, switches: state.switches },
});

const isSame = (a, b) => JSON.stringify(a) === JSON.stringify(b);

/** Keeps the traits and the state equal when either changes. Returns a function that stops it. */
function synchronise(model, app) {
  const heard = {
    stack: (material) => app.drag('python', commands.setMaterial, material),
    model: ({ name, switches }) => app.drag('python', commands.setModel, name, switches),
  };
  const ends = Object.entries(heard).map(([key, hear]) => {
    const listen = () => {
      if (isSame(model.get(key), shared(app.store.get())[key])) return;
      hear(model.get(key));
      app.settle();
    };
    model.on(`change:${key}`, listen);
    return () => model.off(`change:${key}`, listen);
  });
  const unsubscribe = app.store.subscribe((state) => {
    for (const [key, value] of Object.entries(shared(state))) {
      if (!isSame(model.get(key), value)) model.set(key, value);
    }
    model.save_changes();
  });
  return () => [unsubscribe, ...ends].forEach((end) => end());
}

async function render({ model, el }) {
  el.classList.add('velatura-cell');
  el.style.height = `${model.get('height')}px`;

  // Keys that are pressed here are not the notebook's, and JupyterLab is not to swallow Enter in a field
  el.dataset.lmSuppressShortcuts = 'true';
  el.addEventListener('beforeinput', (event) => event.stopPropagation(), { capture: true });

  const { call, fetch, close } = connect(model);
  const session = await call('session');
  const { name, switches } = model.get('model');
  const present = commands.setModel(commands.initial(model.get('stack'), session), name, switches);
  const app = mount(el, {
    ...{ call, fetch, session },
    live: { online: true, onChange: () => () => {}, ask: latest(call) },
    storage: { ...memoryStorage(), load: () => ({ present }) },
  });

  el.velatura = app; // as the page has it as its window's

  // JupyterLab's theme, where it is there, and else the browser's
  const { jpThemeLight } = el.ownerDocument.body.dataset;
  if (jpThemeLight) app.element.style.colorScheme = jpThemeLight === 'true' ? 'light' : 'dark';

  const part = synchronise(model, app);
  return () => {
    part();
    app.destroy();
    close();
  };
}

export default { render };
