// The dialog for pictures that Mitsuba renders into the folder: a step a call, while the page goes on.

import { html, nothing } from 'lit-html';
import { createRef, ref } from 'lit-html/directives/ref.js';
import { documentOf } from '../state/material.js';
import { transformOf } from '../state/transform.js';
import { flag, menu, numberField } from './controls.js';

const BUSY = 503; // status of an answer that is late: the step is asked for again,
const PAUSE = 1000; // after so many milliseconds
const SIDE = { low: 1, high: 4096 };
const SAMPLES = { low: 1, high: 65536, default: 128 };
const NUMBERS = [
  ['width', 'Width', SIDE, 10],
  ['height', 'Height', SIDE, 10],
  ['samples', 'Samples', SAMPLES, 1],
];

/** `view()`, `show()`, which opens it, and `title`, of its button. */
export function createRendering({ store, session, viewport, call, address, files, messages, update }) {
  const dialog = createRef();
  const asked = { width: 1280, height: 720, samples: 128, walk: false, ending: 'png', transparent: false, denoised: session.denoises };
  let under = null; // the picture under way: {step, steps, stopped}
  let done = ''; // the file of the last one

  const set = (changes) => {
    Object.assign(asked, changes);
    update();
  };

  /** The body of call("render"), of the state as it is now. */
  async function question() {
    const { model, switches, camera, view } = store.get();
    const { object, rotation, exposure, transform } = view, { width, height, ending, ...others } = asked;
    const size = [width, height], environment = await files.lightOf(view.environment), mesh = await files.meshOf(view.object);
    const shot = { object, mesh, environment, rotation, exposure, view: transformOf(transform, session).name, camera: camera ?? viewport.camera };
    return { ...others, ...shot, size, material: documentOf(store.get()), model, switches, file: files.nameOf(ending), key: `${Date.now()}` };
  }

  async function render() {
    const picture = (under = { step: 0, steps: 0, stopped: false });
    done = '';
    update();
    await messages.attempt('render', async () => {
      const given = await question();
      for (let answer = picture; !picture.stopped && answer.file === undefined;) {
        answer = await call('render', { ...given, step: picture.step, mesh: picture.step ? undefined : given.mesh }).catch(async (error) => {
          if (error.status !== BUSY) throw error;
          await new Promise((resolve) => setTimeout(resolve, PAUSE));
          return {};
        });
        Object.assign(picture, answer);
        update();
      }
      done = picture.file ?? '';
    });
    under = null;
    if (done) messages.say(`${done} is in the folder.`);
    update();
  }

  function view() {
    const problem = messages.problems.find(({ about }) => about === 'render');
    const { model } = store.get();
    const title = session.models.find(({ name }) => name === model).title;
    const edit = (key) => ({
      move: (value) => set({ [key]: Math.round(value) }),
      set: (value) => set({ [key]: Math.round(value) }),
      settle() {},
      refuse: (text) => messages.complain('render', text, { passing: true }),
    });
    return html`<dialog class="render" aria-label="Render" ${ref(dialog)}>
      <h2>Render with Mitsuba</h2>
      <fieldset class="options" ?disabled=${under}>
        ${NUMBERS.map(
          ([key, label, spec, step]) => html`<label>${label} ${numberField({ label, value: asked[key], spec, step, edit: edit(key) })}</label>`,
        )}
        ${menu({
          label: 'Light by',
          value: String(asked.walk),
          options: [['false', `Model, ${title}`], ['true', 'Walk through the layers']],
          choose: (walk) => set({ walk: walk === 'true' }),
        })}
        ${menu({
          label: 'Format of the picture',
          value: asked.ending,
          options: [['png', 'PNG, as on the page'], ['exr', 'EXR, linear']],
          choose: (ending) => set({ ending }),
        })}
        ${flag({ label: 'Transparent ground', value: asked.transparent, choose: (transparent) => set({ transparent }) })}
        ${flag({
          label: 'Denoise',
          value: asked.denoised,
          title: 'Open Image Denoise, after the last sample',
          lacks: session.denoises ? '' : 'Needs Open Image Denoise: pip install "velatura[denoise]"',
          choose: (denoised) => set({ denoised }),
        })}
      </fieldset>
      ${problem ? html`<p class="problem">${problem.text}</p>` : nothing}
      ${under ? html`<progress aria-label="Progress" max="1" .value=${share(under)}></progress>` : nothing}
      ${done ? result(done, address) : nothing}
      <div class="actions">
        ${
          under
            ? html`<button type="button" @click=${() => (under.stopped = true)}>Stop</button>`
            : html`<button type="button" class="main" @click=${render}>Render</button>`
        }
        <button type="button" @click=${() => dialog.value.close()}>${under ? 'Close, and go on' : 'Close'}</button>
      </div>
    </dialog>`;
  }

  return {
    view,
    show: () => dialog.value.showModal(),
    get title() {
      return under ? `Rendering ${Math.floor(100 * share(under))} %` : 'Render';
    },
  };
}

const share = ({ step, steps }) => (steps ? step / steps : 0);

/** What was written, and is seen where the page has the server's addresses. */
const result = (file, address) => html`<figure>
  ${address && file.endsWith('.png') ? html`<img src=${`/files/${encodeURIComponent(file)}`} alt="The picture" />` : nothing}
  <figcaption>${file}, in the folder</figcaption>
</figure>`;
