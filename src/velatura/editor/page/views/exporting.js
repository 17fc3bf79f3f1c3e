// The dialog that writes the material for other programs: its text, and how much of it there is, before it is taken.

import { html, nothing } from 'lit-html';
import { createRef, ref } from 'lit-html/directives/ref.js';
import { decode } from '../arrays.js';
import { documentOf } from '../state/material.js';
import { flag, menu } from './controls.js';

/** Formats by what they are for, those that artists want first. */
const GROUPS = {
  Programs: {
    blender: 'Blender, OSL in Cycles',
    'blender-principled': 'Blender, Principled BSDF',
    openpbr: 'OpenPBR, MaterialX',
    gltf: 'glTF 2.0',
    mtlx: 'MaterialX, by closures',
    'mitsuba-principled': 'Mitsuba 3, principled',
    'mitsuba-xml': 'Mitsuba 3, this plugin',
    'bsdf-xml': 'WINDOW and Radiance, Klems matrices',
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

/** `view()`, and `show()`, which opens it. */
export function createExports({ store, session, call, lacks, files, messages, update }) {
  const dialog = createRef();
  const asked = { to: session.formats.find(({ name }) => !lacks(name)).name, fixed: false };
  let made = null; // the answer of call("export")

  const show = () => {
    dialog.value.showModal();
    write();
  };

  async function write(changes = {}) {
    Object.assign(asked, changes);
    made = null;
    update();
    const { model, switches } = store.get();
    const question = { ...asked, material: documentOf(store.get()), model, switches };
    await messages.attempt('export', async () => {
      const answer = await call('export', question);
      if (question.to === asked.to && question.fixed === asked.fixed) made = answer;
    });
    update();
  }

  function view() {
    const problem = messages.problems.find(({ about }) => about === 'export');
    const { fixed } = session.formats.find(({ name }) => name === asked.to);
    const known = session.formats.map(({ name }) => name);
    const option = (name) => [name, TITLES[name] ?? name, lacks(name)];
    const offered = (titles) => Object.keys(titles).filter((name) => known.includes(name)).map(option);
    const groups = Object.entries(GROUPS).map(([group, titles]) => ({ group, options: offered(titles) }));
    const options = [...groups, ...known.filter((name) => !TITLES[name]).map(option)];
    return html`<dialog class="export" aria-label="Export" ${ref(dialog)}>
      <div class="head">
        ${menu({ label: 'Format', value: asked.to, options, choose: (to) => write({ to }) })}
        ${
          fixed && !lacks('fixed')
            ? flag({
                label: 'Fixed values',
                value: asked.fixed,
                title: 'Values are worked in, and cannot change later; the code is shorter',
                choose: (on) => write({ fixed: on }),
              })
            : nothing
        }
        <span class="rest"></span>
        <button type="button" @click=${() => dialog.value.close()}>Close</button>
      </div>
      ${problem ? html`<p class="problem">${problem.text}</p>` : nothing}
      ${made ? content(made) : problem ? nothing : html`<p>Writing ...</p>`}
    </dialog>`;
  }

  function content({ text, ending, beside, costs }) {
    const file = (size, name, data) =>
      html`<button type="button" @click=${() => files.give(data, name.slice(1))}>Download ${name} (${bytes(size)})</button>`;
    const others = Object.entries(beside).map(([name, array]) => [name, decode(array).array]);
    return html`<p>${text.split('\n').length} lines</p>
      ${
        Object.keys(costs).length
          ? html`<table class="costs" aria-label="What a call costs">
              ${Object.entries(costs).map(([name, cost]) => html`<tr><th scope="row"><code>${name}</code></th><td>${cost}</td></tr>`)}
            </table>`
          : nothing
      }
      <textarea readonly spellcheck="false" aria-label="What is written" .value=${text}></textarea>
      <div class="actions">
        ${file(new Blob([text]).size, ending, text)}
        ${others.map(([name, data]) => file(data.byteLength, name, data))}
        <button type="button" @click=${() => files.copy(text)}>Copy the text</button>
      </div>`;
  }

  return { view, show };
}

/** A size in words. */
function bytes(count) {
  return count < 1e3 ? `${count} bytes` : count < 1e6 ? `${(count / 1e3).toFixed(1)} kB` : `${(count / 1e6).toFixed(1)} MB`;
}
