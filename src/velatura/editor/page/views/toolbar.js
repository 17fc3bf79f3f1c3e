// The toolbar: files, history, the picture, and whether the server is there; the dialogs that it opens.

import { html, nothing } from 'lit-html';
import { ref, createRef } from 'lit-html/directives/ref.js';
import { isChanged, placeOf } from '../state/commands.js';
import { iconButton } from './controls.js';

/** `view()`, and `saveAs()` and `saveAgain()` as its buttons do. */
export function createToolbar(services) {
  const { store, files } = services;
  const dialogs = { open: createRef(), save: createRef() };
  const bar = {
    ...services,
    dialogs,
    listed: null, // files of the folder
    targets: null, // of the papers
    saveAs: () => dialogs.save.value.showModal(),
    saveAgain() {
      const { file, version } = placeOf(store.get());
      return file ? files.save(file, version) : bar.saveAs();
    },
  };
  return { view: () => toolbar(bar), saveAs: bar.saveAs, saveAgain: bar.saveAgain };
}

function toolbar(bar) {
  const { store } = bar;
  const { file } = placeOf(store.get());
  const changed = isChanged(store.get());
  return html`
    <header class="toolbar" role="toolbar" aria-label="File and history">
      <span class="brand">Velatura</span>
      <button type="button" @click=${() => openDialog(bar)}>Open</button>
      <button type="button" @click=${bar.saveAgain} title="Ctrl-S">Save</button>
      <button type="button" @click=${bar.saveAs}>Save as</button>
      <button type="button" @click=${bar.files.download} title="Download as YAML">Download</button>
      ${
        bar.address
          ? html`<button type="button" @click=${bar.files.share} title="Copy an address that opens this material">
              Share
            </button>`
          : nothing
      }
      <span class="gap"></span>
      ${step('Undo', 'undo', store.undo, store.canUndo, store.undoes)}
      ${step('Redo', 'redo', store.redo, store.canRedo, store.redoes)}
      <span class="gap"></span>
      <span class="document" title=${changed ? 'There are changes that are not saved' : ''}>
        ${file ?? 'not in a file'}${changed ? ' · unsaved changes' : nothing}
      </span>
      <span class="rest"></span>
      <button type="button" @click=${bar.savePicture} title="As PNG">Save picture</button>
      <span class="presence" role="status">${bar.live?.online === false ? 'Offline, trying again' : ''}</span>
    </header>
    ${openPanel(bar)} ${savePanel(bar)}
  `;
}

const step = (word, icon, act, can, title) =>
  iconButton({ label: can ? `${word}: ${title}` : word, icon, act, disabled: !can });

// Open -----------------------------------------------------------------------------------------------

async function openDialog(bar) {
  bar.listed = null;
  bar.update();
  bar.dialogs.open.value.showModal();
  await bar.messages.attempt('list', async () => (bar.listed = (await bar.call('list', {})).files));
  bar.update();
  await bar.messages.attempt('targets', async () => (bar.targets ??= (await bar.call('targets', {})).targets));
  bar.update();
}

function openPanel(bar) {
  const close = () => bar.dialogs.open.value.close();
  const entry = (title, act) =>
    html`<li>
      <button type="button" @click=${() => close() || act()}>${title}</button>
    </li>`;
  const fromHere = async () => {
    const file = await bar.choose('.yaml,.yml,.json');
    if (file) bar.files.readFile(file);
  };
  return html`<dialog class="open" aria-label="Open a material" ${ref(bar.dialogs.open)}>
    <h2>Presets</h2>
    <ul class="names">
      ${bar.session.presets.map(({ title, material }) => entry(title, () => bar.files.open(material)))}
    </ul>
    <h2>From the papers</h2>
    ${bar.targets ? nothing : html`<p>On their way.</p>`}
    <ul class="names">
      ${(bar.targets ?? []).map((target) => entry(target.title, () => bar.openTarget(target)))}
    </ul>
    <h2>Files of the folder</h2>
    ${bar.listed?.length === 0 ? html`<p>There are none.</p>` : nothing}
    <ul class="names">
      ${(bar.listed ?? []).map((file) => entry(file, () => bar.files.openFile(file)))}
    </ul>
    <div class="actions">
      <button type="button" @click=${() => close() || fromHere()}>From this computer</button>
      <button type="button" @click=${close}>Cancel</button>
    </div>
  </dialog>`;
}

// Save -----------------------------------------------------------------------------------------------

function savePanel(bar) {
  const { file } = placeOf(bar.store.get());
  const close = () => bar.dialogs.save.value.close();
  const submit = (event) => {
    event.preventDefault();
    const typed = event.target.elements.file.value.trim();
    const name = /\.(ya?ml|json)$/i.test(typed) ? typed : `${typed}.yaml`;
    const place = placeOf(bar.store.get());
    close();
    bar.files.save(name, name === place.file ? place.version : null);
  };
  const suggested =
    file ??
    `${
      bar.store
        .get()
        .name.toLowerCase()
        .replace(/[^a-z0-9]+/g, '-') || 'material'
    }.yaml`;
  return html`<dialog class="save" aria-label="Save as" ${ref(bar.dialogs.save)}>
    <form @submit=${submit}>
      <label
        >File name <input name="file" type="text" required spellcheck="false" .value=${suggested}
      /></label>
      <div class="actions">
        <button type="submit">Save</button>
        <button type="button" @click=${close}>Cancel</button>
      </div>
    </form>
  </dialog>`;
}
