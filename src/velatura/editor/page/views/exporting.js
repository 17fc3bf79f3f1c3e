// The dialog that writes the material for other programs, or draws it on one page: what is written, before it is taken.

import { html, nothing } from 'lit-html';
import { createRef, ref } from 'lit-html/directives/ref.js';
import { decode } from '../arrays.js';
import { compareWith } from '../state/commands.js';
import { documentOf } from '../state/material.js';
import { flag, menu, numberField } from './controls.js';

/** Formats by what they are for, those that artists want first. */
const GROUPS = {
  Programs: {
    blender: 'Blender, OSL in Cycles',
    'blender-principled': 'Blender, Principled BSDF',
    openpbr: 'OpenPBR, MaterialX',
    gltf: 'glTF 2.0',
    'gltf-coat': 'glTF 2.0, with a coat',
    usd: 'USD, OpenPBR, lobes and preview',
    three: 'three.js, material',
    'three-webgpu': 'three.js, material for WebGPU',
    babylon: 'Babylon.js, material',
    godot: 'Godot 4, material',
    unity: 'Unity, Shader Graph function',
    unreal: 'Unreal 5, Substrate slabs',
    mtlx: 'MaterialX, by closures',
    'mitsuba-principled': 'Mitsuba 3, principled',
    'mitsuba-xml': 'Mitsuba 3, this plugin',
    'bsdf-xml': 'WINDOW and Radiance, Klems matrices',
  },
  'One page': {
    'page-png': 'Layers, ball and lobes, PNG',
    'page-svg': 'Layers, ball and lobes, SVG',
    'page-pdf': 'Layers, ball and lobes, PDF',
  },
  Parameters: { json: 'Numbers, JSON', python: 'Script, Python' },
  'Shader code': {
    osl: 'OSL',
    glsl: 'GLSL ES 3.00',
    glsl450: 'GLSL 4.50',
    vulkan: 'GLSL for Vulkan',
    hlsl: 'HLSL',
    slang: 'Slang',
    wgsl: 'WGSL',
  },
};
const TITLES = Object.assign({}, ...Object.values(GROUPS));

/** Options of the command line that are switches. */
const SWITCHES = {
  constant: ['fixed', 'Fixed values', 'Values are worked in, and cannot change later; the code is shorter'],
  baked: ['baked', 'Baked lobes', 'Lobes over direction are read from a texture; of materials without textures'],
  half: ['half', 'Half floats', 'Textures have halves of floats'],
  tables: ['tables', 'Shared tables', 'All tables in one file, which several materials share'],
};
const SHOWN = { '.png': 'image/png', '.svg': 'image/svg+xml' }; // pictures, by their endings
const NUMBERS = { group: 'Group of textures', binding: 'First binding' };
const WHOLE = { low: 0, high: 65536, default: 0 };

/** `view()`, and `show()`, which opens it. */
export function createExports({ store, session, call, lacks, files, messages, update }) {
  const dialog = createRef();
  const asked = { to: session.formats.find(({ name }) => !lacks(name)).name };
  let made = null; // the answer of call("export")
  let drawn = ''; // address of its picture

  const format = () => session.formats.find(({ name }) => name === asked.to);
  const takes = (option) => !lacks('options') && format().options.includes(option);

  /** The body of call("export"): of the options those that the format takes. */
  function question() {
    const { model, switches } = store.get();
    const keys = [...Object.entries(SWITCHES).map(([option, [key]]) => [option, key]), ...['prefix', 'group', 'binding'].map((key) => [key, key])];
    const chosen = keys.filter(([option, key]) => takes(option) && asked[key]).map(([, key]) => [key, asked[key]]);
    const file = files.nameOf(format().ending.slice(1));
    return { to: asked.to, ...Object.fromEntries(chosen), file, material: documentOf(store.get()), model, switches };
  }

  const show = () => {
    dialog.value.showModal();
    write();
  };

  async function write(changes = {}) {
    Object.assign(asked, changes);
    made = null;
    URL.revokeObjectURL(drawn);
    update();
    const given = question(), text = JSON.stringify(given);
    await messages.attempt('export', async () => {
      const answer = await call('export', given);
      if (text !== JSON.stringify(question())) return;
      made = answer;
      if (made.picture) drawn = URL.createObjectURL(new Blob([decode(made.picture).array], { type: SHOWN[made.ending] }));
    });
    update();
  }

  /** Puts what a program has of the material beside it: the stack nearest to what was fitted. */
  const compare = () =>
    messages.attempt('export', async () => {
      store.run(compareWith, await files.readBack(made.text, made.ending.slice(1)), TITLES[asked.to]);
      dialog.value.close();
      messages.say(`B is what ${TITLES[asked.to]} has of the material, as the nearest stack.`);
    });

  function view() {
    const problem = messages.problems.find(({ about }) => about === 'export');
    const known = session.formats.map(({ name }) => name);
    const option = (name) => [name, TITLES[name] ?? name, lacks(name)];
    const offered = (titles) => Object.keys(titles).filter((name) => known.includes(name)).map(option);
    const groups = Object.entries(GROUPS).map(([group, titles]) => ({ group, options: offered(titles) }));
    const options = [...groups, ...known.filter((name) => !TITLES[name]).map(option)];
    return html`<dialog class="export" aria-label="Export" ${ref(dialog)}>
      <div class="head">
        ${menu({ label: 'Format', value: asked.to, options, choose: (to) => write({ to }) })}
        <span class="rest"></span>
        <button type="button" @click=${() => dialog.value.close()}>Close</button>
      </div>
      ${choices()} ${problem ? html`<p class="problem">${problem.text}</p>` : nothing}
      ${made ? (made.picture ? onePage(made) : content(made)) : problem ? nothing : html`<p>Writing ...</p>`}
    </dialog>`;
  }

  /** Controls of the options that the format takes. */
  function choices() {
    const shown = Object.entries(SWITCHES).filter(([option]) => takes(option));
    const numbers = Object.entries(NUMBERS).filter(([option]) => takes(option));
    if (!shown.length && !takes('prefix')) return nothing;
    const edit = (key) => {
      const put = (value) => write({ [key]: value });
      return { move: put, set: put, settle() {}, refuse: (text) => messages.complain('export', text, { passing: true }) };
    };
    return html`<div class="options">
      ${shown.map(([, [key, label, title]]) => flag({ label, title, value: asked[key] ?? false, choose: (on) => write({ [key]: on }) }))}
      ${
        takes('prefix')
          ? html`<label title="Begins all names in the code">
              Prefix
              <input type="text" size="8" placeholder="vt" spellcheck="false" .value=${asked.prefix ?? ''} @change=${({ target }) => write({ prefix: target.value.trim() })} />
            </label>`
          : nothing
      }
      ${numbers.map(([key, label]) => html`<label>${label} ${numberField({ label, value: asked[key] ?? 0, spec: WHOLE, step: 1, edit: edit(key) })}</label>`)}
    </div>`;
  }

  /** A picture of the material, to look at and to take. */
  function onePage({ picture, ending }) {
    const data = decode(picture).array;
    return html`${
        SHOWN[ending]
          ? html`<figure><img src=${drawn} alt="The material on one page: its layers, a ball, and its lobes" /></figure>`
          : html`<p>A page for print.</p>`
      }
      <div class="actions">
        <button type="button" @click=${() => files.give(data, ending.slice(1))}>Download ${ending} (${bytes(data.byteLength)})</button>
      </div>`;
  }

  function content({ text, ending, beside, apart = {}, costs, loss = [], left = [], notes = [], facts = '' }) {
    const button = (title, size, act) => html`<button type="button" @click=${act}>Download ${title} (${bytes(size)})</button>`;
    const file = (size, name, data) => button(name, size, () => files.give(data, name.slice(1)));
    const arrays = (given) => Object.entries(given).map(([name, array]) => [name, decode(array).array]);
    return html`${lost(loss, left)}
      ${notes.map((note) => html`<p>${note}</p>`)}
      <p>${text.split('\n').length} lines</p>
      ${
        Object.keys(costs).length
          ? html`<table class="costs" aria-label="What a call costs">
              ${Object.entries(costs).map(([name, cost]) => html`<tr><th scope="row"><code>${name}</code></th><td>${cost}</td></tr>`)}
            </table>`
          : nothing
      }
      <textarea readonly spellcheck="false" aria-label="What is written" .value=${text}></textarea>
      <div class="actions">
        ${file(new Blob([text]).size, ending, text)} ${arrays(beside).map(([name, data]) => file(data.byteLength, name, data))}
        ${arrays(apart).map(([name, data]) => button(name, data.byteLength, () => files.giveAs(data, name)))}
        ${facts ? button('the facts', new Blob([facts]).size, () => files.give(facts, `${ending.slice(1)}.json`)) : nothing}
        <button type="button" @click=${() => files.copy(text)}>Copy the text</button>
        ${facts ? html`<button type="button" title="What a program needs to know to use the file" @click=${() => files.copy(facts)}>Copy the facts</button>` : nothing}
        ${format().read && !lacks('import') ? html`<button type="button" title="What is written, read back, in slot B" @click=${compare}>Compare</button>` : nothing}
      </div>`;
  }

  return { view, show };
}

/** What is lost of the light, as a number and a line, and what is not held at all. */
function lost(loss, left) {
  if (!loss.length) return nothing;
  const variations = loss.map(({ variation }) => variation), mean = variations.reduce((a, b) => a + b) / loss.length;
  const percent = (share) => `${(100 * share).toFixed(1)} %`;
  const most = Math.max(...loss.map(({ albedo }) => albedo)).toFixed(3);
  const angles = loss.map(({ cosine, variation }) => `cosine ${cosine}: ${percent(variation)}`).join(', ');
  return html`<p class="loss" title=${`Total variation by the cosine of incidence: ${angles}`}>
      <b>${percent(mean)}</b> of the light goes elsewhere (${percent(Math.max(...variations))} at most); albedo up to ${most} off
    </p>
    ${left.length ? html`<ul class="lost" aria-label="Not held">${left.map((line) => html`<li>${line}</li>`)}</ul>` : nothing}`;
}

/** A size in words. */
function bytes(count) {
  return count < 1e3 ? `${count} bytes` : count < 1e6 ? `${(count / 1e3).toFixed(1)} kB` : `${(count / 1e6).toFixed(1)} MB`;
}
