// The toolbar: files, history, the picture, and whether the server is there; the dialogs that it opens.

import { html, nothing } from 'lit-html';
import { ref, createRef } from 'lit-html/directives/ref.js';
import { isChanged, placeOf } from '../state/commands.js';
import { iconButton } from './controls.js';

export function toolbar(app) {
  const { store } = app;
  const { file } = placeOf(store.get());
  const changed = isChanged(store.get());
  app.dialogs ??= { open: createRef(), save: createRef() };
  app.saveAs ??= () => app.dialogs.save.value.showModal();
  app.saveAgain ??= () => {
    const place = placeOf(store.get());
    return place.file ? app.save(place.file, place.version) : app.saveAs();
  };
  return html`
    <header class="toolbar" role="toolbar" aria-label="File and history">
      <span class="brand">Velatura</span>
      <button type="button" @click=${() => openDialog(app)}>Open</button>
      <button type="button" @click=${app.saveAgain} title="Ctrl-S">Save</button>
      <button type="button" @click=${app.saveAs}>Save as</button>
      <button type="button" @click=${app.download} title="Download as YAML">Download</button>
      ${
        app.address
          ? html`<button type="button" @click=${app.share} title="Copy an address that opens this material">
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
      <button type="button" @click=${app.savePicture} title="As PNG">Save picture</button>
      <span class="presence" role="status">${app.live?.online === false ? 'Offline, trying again' : ''}</span>
    </header>
    ${openPanel(app)} ${savePanel(app)}
  `;
}

const step = (word, icon, act, can, title) =>
  iconButton({ label: can ? `${word}: ${title}` : word, icon, act, disabled: !can });

// Open -----------------------------------------------------------------------------------------------

async function openDialog(app) {
  app.files = null;
  app.update();
  app.dialogs.open.value.showModal();
  await app.attempt('list', async () => (app.files = (await app.call('list', {})).files));
  app.update();
  await app.attempt('targets', async () => (app.targets ??= (await app.call('targets', {})).targets));
  app.update();
}

function openPanel(app) {
  const close = () => app.dialogs.open.value.close();
  const entry = (title, act) =>
    html`<li>
      <button type="button" @click=${() => close() || act()}>${title}</button>
    </li>`;
  const fromHere = async () => {
    const file = await app.chooseFile('.yaml,.yml,.json');
    if (file) app.readFile(file);
  };
  return html`<dialog class="open" aria-label="Open a material" ${ref(app.dialogs.open)}>
    <h2>Presets</h2>
    <ul class="names">
      ${app.session.presets.map(({ title, material }) => entry(title, () => app.open(material)))}
    </ul>
    <h2>From the papers</h2>
    ${app.targets ? nothing : html`<p>On their way.</p>`}
    <ul class="names">
      ${(app.targets ?? []).map((target) => entry(target.title, () => app.openTarget(target)))}
    </ul>
    <h2>Files of the folder</h2>
    ${app.files?.length === 0 ? html`<p>There are none.</p>` : nothing}
    <ul class="names">
      ${(app.files ?? []).map((file) => entry(file, () => app.openFile(file)))}
    </ul>
    <div class="actions">
      <button type="button" @click=${() => close() || fromHere()}>From this computer</button>
      <button type="button" @click=${close}>Cancel</button>
    </div>
  </dialog>`;
}

// Save -----------------------------------------------------------------------------------------------

function savePanel(app) {
  const { file } = placeOf(app.store.get());
  const close = () => app.dialogs.save.value.close();
  const submit = (event) => {
    event.preventDefault();
    const typed = event.target.elements.file.value.trim();
    const name = /\.(ya?ml|json)$/i.test(typed) ? typed : `${typed}.yaml`;
    const place = placeOf(app.store.get());
    close();
    app.save(name, name === place.file ? place.version : null);
  };
  const suggested =
    file ??
    `${
      app.store
        .get()
        .name.toLowerCase()
        .replace(/[^a-z0-9]+/g, '-') || 'material'
    }.yaml`;
  return html`<dialog class="save" aria-label="Save as" ${ref(app.dialogs.save)}>
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
