// The dialog for one of several things, as the materials of a file.

import { html } from 'lit-html';
import { createRef, ref } from 'lit-html/directives/ref.js';

/** `view()`, and `ask(title, options)`, a promise of the chosen option, or of undefined where none is. */
export function createChoice(update) {
  const dialog = createRef();
  let question = null;

  function ask(title, options) {
    return new Promise((resolve) => {
      question = { title, options, resolve };
      update();
      dialog.value.showModal();
    });
  }

  function end(option) {
    dialog.value.close();
    question?.resolve(option);
    question = null;
    update();
  }

  const view = () => html`<dialog class="choice" aria-label=${question?.title ?? 'Choose'} ${ref(dialog)} @cancel=${() => end()}>
    <div class="head">
      <h2>${question?.title}</h2>
      <span class="rest"></span>
      <button type="button" @click=${() => end()}>Cancel</button>
    </div>
    <ul class="names">
      ${question?.options.map((option) => html`<li><button type="button" @click=${() => end(option)}>${option}</button></li>`)}
    </ul>
  </dialog>`;
  return { view, ask };
}
