// The files of the folder in the dialog that opens them: with pictures and tags; renamed, removed, and put back.

import { html, nothing } from 'lit-html';
import { ref } from 'lit-html/directives/ref.js';
import { repeat } from 'lit-html/directives/repeat.js';
import { fileRenamed, isChanged, placeOf } from '../state/commands.js';
import { iconButton } from './controls.js';

const OWN = /\.(ya?ml|json)$/i; // files that are renamed and removed here
const focused = (field) => field && queueMicrotask(() => field.focus()); // once it is on the page
const JPEG = 'data:image/jpeg;base64,';

/**
 * `read()`, which lists the folder, and `view(sought, seek, open)` of the names and tags with a text; `seek(text)` looks for another
 * one, `open(file)` is called by a click. `look(picture)` keeps a picture, an address, of the material that is open.
 */
export function createLibrary({ store, call, lacks, messages, update }) {
  let listed = null; // files
  let kept = {}; // of files by name: {tags, thumbnail}
  let written = null; // {file, what}: the name or the tags of a file that are being written
  let removed = null; // {name, file}: how the last one was called, and is called where it was put
  let looked = ''; // the file and the picture that was kept last

  const attempt = async (act) => {
    await messages.attempt('library', act);
    await read();
  };

  async function read() {
    if (!lacks('list')) await messages.attempt('list', async () => ({ files: listed, kept } = await call('list', {})));
    update();
  }

  /** Keeps the picture of the material that is open, where it is as its file is. */
  async function look(picture) {
    const { file } = placeOf(store.get());
    if (!file || !picture?.startsWith(JPEG) || looked === file + picture || lacks('keep') || isChanged(store.get())) return;
    looked = file + picture;
    await call('keep', { file, thumbnail: picture.slice(JPEG.length) }).catch(() => {}); // the file may be gone, or the server
  }

  const remove = (name) =>
    attempt(async () => {
      removed = { name, file: (await call('remove', { file: name })).file };
    });

  const restore = () =>
    attempt(async () => {
      await call('restore', removed);
      removed = null;
    });

  function rename(file, typed) {
    const ending = file.match(OWN)[0], name = typed.endsWith(ending) ? typed : `${typed}${ending}`;
    if (name === file || typed === '') return update();
    return attempt(async () => store.aside(fileRenamed, file, (await call('rename', { file, name })).file));
  }

  const tag = (file, typed) =>
    attempt(() => call('keep', { file, tags: typed.split(',').map((word) => word.trim()).filter(Boolean) }));

  const tagsOf = (file) => kept[file]?.tags ?? [];

  function entry(file, open) {
    const tags = tagsOf(file), picture = kept[file]?.thumbnail;
    const begin = (what) => () => {
      written = { file, what };
      update();
    };
    const is = (what) => written?.file === file && written.what === what;
    if (is('name')) return html`<li class="file">${field({ label: `Name of ${file}`, value: file, done: (typed) => rename(file, typed) })}</li>`;
    return html`<li class="file">
      <button type="button" @click=${() => open(file)}>
        ${picture ? html`<img src=${JPEG + picture} alt="" width="48" height="36" />` : nothing}<span>${file}</span>
      </button>
      ${iconButton({ label: `Tags of ${file}`, icon: 'tag', act: begin('tags') })}
      ${
        OWN.test(file)
          ? html`${iconButton({ label: `Rename ${file}`, icon: 'rename', act: begin('name') })}
            ${iconButton({ label: `Delete ${file}`, icon: 'remove', act: () => remove(file) })}`
          : nothing
      }
      ${
        is('tags')
          ? field({ label: `Tags of ${file}, between commas`, value: tags.join(', '), done: (typed) => tag(file, typed), empty: '' })
          : html`<span class="tags">${tags.join(', ')}</span>`
      }
    </li>`;
  }

  /** A field whose text is taken by Enter; Escape leaves what was, as `empty` does. */
  function field({ label, value, done, empty = null }) {
    const onKey = (event) => {
      if (event.key !== 'Enter' && event.key !== 'Escape') return;
      event.preventDefault(); // Escape would close the dialog
      event.stopPropagation();
      written = null;
      const typed = event.target.value.trim();
      if (event.key === 'Enter' && (typed || empty !== null)) done(typed);
      else update();
    };
    return html`<input type="text" aria-label=${label} spellcheck="false" ${ref(focused)} .value=${value} @keydown=${onKey} />`;
  }

  /** Every tag, as a button that looks for it alone. */
  function allTags(sought, seek) {
    const all = [...new Set((listed ?? []).flatMap(tagsOf))].sort((a, b) => a.localeCompare(b));
    const one = (name) => {
      const on = sought === name.toLowerCase();
      return html`<button type="button" aria-pressed=${on} @click=${() => seek(on ? '' : name)}>${name}</button>`;
    };
    return all.length ? html`<div class="choices" role="group" aria-label="Tags">${all.map(one)}</div>` : nothing;
  }

  function view(sought, seek, open) {
    const has = (text) => text.toLowerCase().includes(sought);
    const found = (listed ?? []).filter((file) => has(file) || tagsOf(file).some(has));
    if (sought && !found.length) return nothing;
    const problem = messages.problems.find(({ about }) => about === 'library');
    const none = lacks('list') || (listed ? 'There are none.' : 'Reading the folder.');
    return html`<h2>Files of the folder</h2>
      ${problem ? html`<p class="problem">${problem.text}</p>` : nothing}
      ${
        removed
          ? html`<p role="status">${removed.name} is deleted. <button type="button" @click=${restore}>Undo the deletion</button></p>`
          : nothing
      }
      ${allTags(sought, seek)}
      ${found.length ? nothing : html`<p>${none}</p>`}
      <ul class="names">
        ${repeat(
          found,
          (file) => file,
          (file) => entry(file, open),
        )}
      </ul>`;
  }

  return { read, view, look };
}
