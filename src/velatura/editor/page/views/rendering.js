// The dialog for pictures that Mitsuba renders into the folder: a step a call, while the page goes on.

import { html, nothing } from 'lit-html';
import { createRef, ref } from 'lit-html/directives/ref.js';
import { sent } from '../arrays.js';
import { documentOf } from '../state/material.js';
import { transformOf } from '../state/transform.js';
import { TURNS, frameNames, turned } from '../state/turntable.js';
import { flag, menu, numberField } from './controls.js';

const BUSY = 503; // status of an answer that is late: the step is asked for again,
const PAUSE = 1000; // after so many milliseconds
const SIDE = { low: 1, high: 4096 };
const SAMPLES = { low: 1, high: 65536, default: 128 };
const FRAMES = { low: 1, high: 999, default: 1 };
const NUMBERS = [
  ['width', 'Width', SIDE, 10],
  ['height', 'Height', SIDE, 10],
  ['samples', 'Samples', SAMPLES, 1],
  ['frames', 'Frames', FRAMES, 1],
];

/** `view()`, `show()`, which opens it, and `title`, of its button. */
export function createRendering({ store, session, viewport, call, address, files, messages, update }) {
  const dialog = createRef();
  const asked = { width: 1280, height: 720, samples: 128, frames: 1, turns: 'object', walk: false, ending: 'png', transparent: false, denoised: session.denoises };
  let under = null; // what is under way: {frame, frames, step, steps, stopped}
  let done = []; // the files of the last one

  const set = (changes) => {
    Object.assign(asked, changes);
    update();
  };

  /** The body of call("render") of the first frame, of the state as it is now. */
  async function question() {
    const { model, switches, camera, view } = store.get();
    const { object, rotation, exposure, transform } = view, { width, height, samples, walk, transparent, denoised } = asked;
    const size = [width, height], environment = await files.lightOf(view.environment), mesh = await files.meshOf(view.object);
    const light = view.lights?.length ? await sent(viewport.lighting) : undefined;
    const shot = { object, mesh, environment, light, rotation, exposure, view: transformOf(transform, session).name, camera: camera ?? viewport.camera };
    return { ...shot, size, samples, walk, transparent, denoised, material: documentOf(store.get()), model, switches };
  }

  /** The names of the files: that of the material, or of its frames in their order. */
  async function names() {
    const { frames, ending } = asked, name = files.nameOf(ending);
    if (frames === 1) return [name];
    return frameNames(name.slice(0, -ending.length - 1), ending, frames, (await call('list')).textures);
  }

  /** Has a picture made, step by step, unless it is stopped: the name of its file. */
  async function picture(work, given) {
    const key = `${Date.now()}`;
    work.step = 0;
    while (!work.stopped) {
      const first = work.step ? { mesh: undefined, light: undefined } : {}; // which the first step takes alone
      const answer = await call('render', { ...given, key, step: work.step, ...first }).catch(async (error) => {
        if (error.status !== BUSY) throw error;
        await new Promise((resolve) => setTimeout(resolve, PAUSE));
        return {};
      });
      if (answer.file) return answer.file;
      Object.assign(work, answer);
      update();
    }
    return undefined;
  }

  async function render() {
    const { frames, turns } = asked, work = (under = { frame: 0, frames, step: 0, steps: 0, stopped: false });
    done = [];
    update();
    await messages.attempt('render', async () => {
      const given = await question();
      for (const file of await names()) {
        const written = await picture(work, { ...given, ...turned(given, turns, work.frame / frames), file });
        if (!written) break;
        done = [...done, written];
        work.frame += 1;
        work.step = 0;
        update();
      }
    });
    under = null;
    if (done.length) messages.say(`${counted(done)} in the folder.`);
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
        ${
          asked.frames > 1
            ? menu({ label: 'What turns', value: asked.turns, options: TURNS, choose: (turns) => set({ turns }) })
            : nothing
        }
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
      ${done.length ? result(done, address) : nothing}
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

const share = ({ frame, frames, step, steps }) => (frame + (steps ? step / steps : 0)) / frames;

const counted = (done) => (done.length === 1 ? `${done[0]} is` : `${done.length} frames, ${done[0]} to ${done.at(-1)}, are`);

/** What was written; the last picture is seen where the page has the server's addresses. */
function result(done, address) {
  const last = done.at(-1);
  return html`<figure>
    ${address && last.endsWith('.png') ? html`<img src=${`/files/${encodeURIComponent(last)}`} alt="The picture" />` : nothing}
    <figcaption>${counted(done)} in the folder</figcaption>
  </figure>`;
}
