// The files of the folder in the dialog that opens them: renamed, removed, and put back.

import { html, nothing } from 'lit-html';
import { repeat } from 'lit-html/directives/repeat.js';
import { fileRenamed } from '../state/commands.js';
import { iconButton } from './controls.js';

const OWN = /\.(ya?ml|json)$/i; // files that are renamed and removed here

/** `read()`, which lists the folder, and `view(sought, open)` of the names with a text; `open(file)` is called by a click. */
export function createLibrary({ store, call, lacks, messages, update }) {
  let listed = null; // files
  let renaming = null; // a file
  let removed = null; // {name, file}: how the last one was called, and is called where it was put

  const attempt = async (act) => {
    await messages.attempt('library', act);
    await read();
  };

  async function read() {
    if (!lacks('list')) await messages.attempt('list', async () => (listed = (await call('list', {})).files));
    update();
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
    renaming = null;
    const ending = file.match(OWN)[0], name = typed.endsWith(ending) ? typed : `${typed}${ending}`;
    if (name === file || typed === '') return update();
    return attempt(async () => store.aside(fileRenamed, file, (await call('rename', { file, name })).file));
  }

  function entry(file, open) {
    if (renaming === file) return nameField(file);
    const begin = () => {
      renaming = file;
      update();
    };
    return html`<li class="file">
      <button type="button" @click=${() => open(file)}>${file}</button>
      ${
        OWN.test(file)
          ? html`${iconButton({ label: `Rename ${file}`, icon: 'rename', act: begin })}
            ${iconButton({ label: `Delete ${file}`, icon: 'remove', act: () => remove(file) })}`
          : nothing
      }
    </li>`;
  }

  function nameField(file) {
    const onKey = (event) => {
      if (event.key !== 'Enter' && event.key !== 'Escape') return;
      event.preventDefault(); // Escape would close the dialog
      event.stopPropagation();
      rename(file, event.key === 'Enter' ? event.target.value.trim() : '');
    };
    return html`<li class="file">
      <input type="text" aria-label=${`Name of ${file}`} spellcheck="false" autofocus .value=${file} @keydown=${onKey} />
    </li>`;
  }

  function view(sought, open) {
    const found = (listed ?? []).filter((file) => file.toLowerCase().includes(sought));
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
      ${found.length ? nothing : html`<p>${none}</p>`}
      <ul class="names">
        ${repeat(
          found,
          (file) => file,
          (file) => entry(file, open),
        )}
      </ul>`;
  }

  return { read, view };
}
