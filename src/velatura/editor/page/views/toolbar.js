// The toolbar: files, history, the picture, and whether the server is there; the dialogs that it opens.

import { html, nothing } from 'lit-html';
import { live } from 'lit-html/directives/live.js';
import { ref, createRef } from 'lit-html/directives/ref.js';
import { isChanged, placeOf } from '../state/commands.js';
import { FOREIGN } from '../files.js';
import { iconButton } from './controls.js';
import { createExports } from './exporting.js';
import { createLibrary } from './library.js';
import { createRendering } from './rendering.js';

const OPENING = { label: 'Open a material' };

/**
 * `view()`, `saveAs()` and `saveAgain()` as its buttons do, `mix()`, which chooses what the material is mixed with, `give(name)`, what a part of the object is made of,
 * and `look(picture)`, which keeps a picture of the file that is open.
 */
export function createToolbar(services) {
  const { store, files } = services;
  const dialogs = { open: createRef(), save: createRef() };
  const bar = {
    ...services,
    exports: createExports(services),
    rendering: createRendering(services),
    dialogs,
    library: createLibrary(services),
    targets: null, // of the papers
    isOpening: false, // whether the dialog shows what can be opened
    sought: '', // in the titles of it
    choosing: OPENING, // what is done with what is chosen
    saveAs: () => dialogs.save.value.showModal(),
    saveAgain() {
      const { file, version } = placeOf(store.get());
      return file ? files.save(file, version) : bar.saveAs();
    },
  };
  const mix = () => openDialog(bar, { label: 'Mix with a material', take: files.mix });
  const give = (name) => openDialog(bar, { label: `Material of ${name}`, take: (material, place) => files.cover(name, material, place) });
  return { view: () => toolbar(bar), saveAs: bar.saveAs, saveAgain: bar.saveAgain, mix, give, look: bar.library.look };
}

function toolbar(bar) {
  const { store } = bar;
  const { file } = placeOf(store.get());
  const changed = isChanged(store.get());
  return html`
    <header class="toolbar" aria-label="File and history">
      <h1 class="brand">Velatura</h1>
      <button type="button" @click=${bar.files.begin} title="A coat over a diffuse base">New</button>
      <button type="button" @click=${() => openDialog(bar)}>Open</button>
      <button type="button" ?disabled=${bar.lacks('save')} @click=${bar.saveAgain} title=${bar.lacks('save') || 'Ctrl-S'}>
        Save
      </button>
      <button type="button" ?disabled=${bar.lacks('save')} @click=${bar.saveAs} title=${bar.lacks('save')}>Save as</button>
      <button type="button" @click=${bar.files.download} title="Download as a file">Download</button>
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
        ${file ?? (changed ? 'Not saved' : nothing)}${file && changed ? ' · unsaved changes' : nothing}
      </span>
      <button type="button" @click=${bar.exports.show} title="For other programs">Export</button>
      <button type="button" ?disabled=${bar.lacks('render')} @click=${bar.rendering.show} title=${bar.lacks('render') || 'By Mitsuba, into the folder'}>
        ${bar.rendering.title}
      </button>
      <button type="button" @click=${bar.savePicture} title="As PNG">Save picture</button>
      <span class="presence" role="status">${bar.live?.online === false ? 'Offline, trying again' : ''}</span>
    </header>
    ${openPanel(bar)} ${savePanel(bar)} ${bar.exports.view()} ${bar.rendering.view()}
  `;
}

const step = (word, icon, act, can, title) =>
  iconButton({ label: can ? `${word}: ${title}` : word, icon, act, disabled: !can });

// Open -----------------------------------------------------------------------------------------------

async function openDialog(bar, choosing = OPENING) {
  bar.choosing = choosing;
  bar.sought = '';
  bar.isOpening = true;
  bar.update();
  bar.dialogs.open.value.showModal();
  await bar.library.read();
  bar.update();
  if (choosing === OPENING && !bar.lacks('targets')) await bar.messages.attempt('targets', async () => (bar.targets ??= (await bar.call('targets', {})).targets));
  bar.update();
}

/** It is empty while it is closed, since the page is written anew with each change of the material. */
function openPanel(bar) {
  const dialog = bar.dialogs.open;
  const closed = () => {
    bar.isOpening = dialog.value.open; // again, where it was opened at once
    bar.update();
  };
  return html`<dialog class="open" aria-label=${bar.choosing.label} ${ref(dialog)} @close=${closed}>
    ${bar.isOpening ? openable(bar) : nothing}
  </dialog>`;
}

function openable(bar) {
  const close = () => bar.dialogs.open.value.close();
  const { take = bar.files.open } = bar.choosing, opening = bar.choosing === OPENING;
  const sought = bar.sought.trim().toLowerCase();
  const found = (entries) => entries.filter(({ title, name = '' }) => [title.toLowerCase(), name].some((text) => text.includes(sought)));
  const fromHere = async () => {
    const file = await bar.choose(['.yaml', '.yml', '.json', ...(bar.lacks('import') ? [] : FOREIGN)].join());
    if (file) bar.files.readChosen(file, take);
  };
  const seek = (text) => {
    bar.sought = text;
    bar.update();
  };
  const first = (event) => {
    if (event.key === 'Enter') event.currentTarget.closest('dialog').querySelector('li button')?.click();
  };
  const presets = bar.session.presets.map(({ name, title, group, material }) => ({
    name,
    title,
    group,
    picture: bar.address && new URL(`thumbnails/${name}.jpg`, bar.address).href,
    act: () => take(material),
  }));
  const groups = [...new Set(presets.map(({ group }) => group))].sort();
  const targets = (bar.targets ?? []).map((target) => ({ title: target.title, act: () => bar.openTarget(target) }));
  const section = (title, entries, empty = nothing) => html`
    <h2>${title}</h2>
    ${entries.length ? nothing : empty}
    <ul class=${entries[0]?.picture ? 'cards' : 'names'}>
      ${entries.map((entry) => card(entry, close))}
    </ul>
  `;
  const some = (title, entries, empty) => {
    const these = found(entries);
    return these.length || (empty && !sought) ? section(title, these, empty) : nothing;
  };
  return html`<div class="head">
      <input type="search" aria-label="Search" placeholder="Search" .value=${live(bar.sought)} @input=${({ target }) => seek(target.value)} @keydown=${first} />
      ${
        opening
          ? nothing
          : html`<button type="button" @click=${() => close() || take(bar.files.fresh())}>A new stack</button>`
      }
      <button type="button" @click=${() => close() || fromHere()}>From this computer</button>
      <button type="button" @click=${close}>Cancel</button>
    </div>
    ${groups.map((name) => some(name, byTitle(presets.filter(({ group }) => group === name))))}
    ${bar.library.view(sought, seek, (file) => close() || bar.files.openFile(file, take))}
    ${opening ? some('From the papers', targets, html`<p>${bar.lacks('targets') || 'On their way.'}</p>`) : nothing}`;
}

const byTitle = (entries) => entries.sort((a, b) => a.title.localeCompare(b.title));

function card({ title, picture, act }, close) {
  return html`<li>
    <button type="button" @click=${() => close() || act()}>
      ${picture ? html`<img src=${picture} alt="" width="160" height="120" loading="lazy" />` : nothing}${title}
    </button>
  </li>`;
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
  const suggested = file ?? bar.files.nameOf('yaml');
  return html`<dialog class="save" aria-label="Save as" ${ref(bar.dialogs.save)}>
    <form @submit=${submit}>
      <h2>Save as</h2>
      <label
        >File name <input name="file" type="text" required spellcheck="false" .value=${suggested}
      /></label>
      <p>In the folder that the editor was started in; the ending is .yaml or .json.</p>
      <div class="actions">
        <button type="submit">Save</button>
        <button type="button" @click=${close}>Cancel</button>
      </div>
    </form>
  </dialog>`;
}
