// Keeps the pictures in step with the state: values go straight to the viewport, shapes over Python.

import { Offline } from '../connection.js';
import { isOfMaterials, isPaired } from './compared.js';
import { coversOf, documentOf, flat, numbersOf, pattern, stacksAsText, stateOf, treeOf, weightsOf } from './material.js';
import { Solutions } from './solutions.js';
import { transformOf } from './transform.js';

const PAUSE = 250; // milliseconds without a change, after which Python is asked whether values are allowed
const NO_LIGHTS = []; // the same in all states without any
const REST = 2; // times as long as an answer took, Python is not asked for values that are foreseen

/** One material in the viewport: the state's own (`a`), that of the other model (`b`), or one beside it (`b` to `d`). */
class Slot {
  shader = null; // what the viewport draws now
  given = null; // and the state whose values it has
  drawn = null; // and the pattern it was asked for
  stage = null; // what takes time now: `solving` by Python, `compiling` by the device, or null
  #name;
  #services;
  #state = null; // to be drawn
  #shape = null; // its pattern
  #wanted = null; // what Python is to be asked next
  #asked = null; // what it was asked last
  #failed = false; // whether it refused that
  #followed = false; // whether it is seen
  #busy = false;
  #timer = null;
  #moved = null; // the state whose values Python is to work out next, with the question
  #moving = false; // whether it is at work on some
  #settled = false; // whether the state is drawn, and not a coarse answer
  #solutions = new Solutions(); // of values that move
  #contents = null; // what is drawn
  #rest = 0; // time until which Python is not asked for what is foreseen

  constructor(name, services) {
    this.#name = name;
    this.#services = services;
  }

  get quiet() {
    return !this.#wanted && !this.#busy && !this.#moving;
  }

  stop() {
    clearTimeout(this.#timer);
  }

  /** The picture is seen no more, and what is wrong with it is of no interest. */
  leave() {
    this.#followed = false;
    this.#services.onProblem(this.#name, null);
  }

  /** Brings the picture to a state. */
  follow(state) {
    this.#followed = true;
    const { model, switches } = state;
    const shape = JSON.stringify([pattern(state), model, switches]);
    const material = documentOf(state);
    const text = JSON.stringify([material, model, switches]);
    if (this.#asked === text && !this.#failed) return this.#rename(state);
    const known = shape === this.drawn;
    this.#asked = text;
    this.#failed = false;
    this.#settled = false;
    this.#state = state;
    this.#shape = shape;
    this.#wanted = { material, model, switches, shape };
    clearTimeout(this.#timer);
    this.#timer = null;
    const { viewport, session, lacks } = this.#services, asks = isWorkedOut(this.shader);
    if (!known || !viewport.held) this.#solutions.clear();
    if (!known || (asks && (!viewport.held || lacks('values')))) return this.#ask();
    this.#timer = setTimeout(() => {
      this.#timer = null;
      this.#ask();
    }, PAUSE);
    if (!asks) return this.#setContents(contentsOf(this.shader, state, session), state);
    if (!this.#contents.coarse && stacksAsText(state) === stacksAsText(this.given)) return this.#weigh(state);
    const found = this.#foresee(state);
    if (found && (found.close || performance.now() < this.#rest)) return;
    this.#moved = { state, shape, question: { material, model, switches, coarse: true } };
    return this.#move();
  }

  /** Draws other shares of the same stacks, whose solutions stay. */
  #weigh(state) {
    const values = { ...this.#contents.values, ...Object.fromEntries(weightsOf(treeOf(state) ?? [])) };
    this.#setContents({ ...this.#contents, values }, state);
  }

  /** Draws values that Python has not worked out, where there are solutions beside them; what was drawn, or null. */
  #foresee(state) {
    const found = this.#solutions.foresee(numbersOf(state, this.#services.session));
    if (found) this.#setContents({ ...found.contents, coarse: true }, state);
    return found;
  }

  /** Takes a state of the same material, opened anew maybe, for the one that was asked for. */
  #rename(state) {
    if (this.given === this.#state) this.given = state;
    this.#state = state;
  }

  #setContents(contents, state) {
    const { viewport, onBaked } = this.#services, name = this.#name;
    if (state.document !== this.given?.document) viewport.forget(name);
    viewport.setContents(name, { ...contents, covers: coversOf(state) });
    this.#contents = contents;
    this.given = state;
    onBaked(name);
  }

  /** Has Python work out what is drawn of values that move, one request at a time and only the latest. */
  async #move() {
    if (this.#moving) return;
    this.#moving = true;
    while (this.#moved) {
      const { state, shape, question } = this.#moved;
      this.#moved = null;
      try {
        const begin = performance.now();
        const { call, session } = this.#services;
        const contents = this.#solutions.add(await call('values', question), numbersOf(state, session));
        const end = performance.now();
        this.#rest = end + REST * (end - begin);
        if (shape !== this.drawn || this.#settled) continue;
        const later = state === this.#state ? null : this.#foresee(this.#state);
        if (later) this.#moved = null;
        else this.#setContents({ ...contents, coarse: true }, state);
      } catch {
        // The reason is shown when the shader is asked for, after a pause
      }
    }
    this.#moving = false;
  }

  /** Requests the shader of the wanted state, one request at a time and only the latest. */
  async #ask() {
    if (this.#busy) return;
    const { call, onProblem } = this.#services;
    this.#busy = true;
    while (this.#wanted && this.#timer === null) {
      const { shape, ...question } = this.#wanted;
      this.#wanted = null;
      this.stage = 'solving';
      try {
        const shader = await call('shader', question);
        if (!this.#wanted) await this.#accept(shader, shape);
      } catch (error) {
        this.#failed = true;
        if (!this.#wanted && this.#followed) onProblem(this.#name, error);
        if (error instanceof Offline) break;
      }
    }
    this.stage = null;
    this.#busy = false;
  }

  async #accept(shader, shape) {
    const { viewport, session, onShader, onProblem } = this.#services, state = this.#state;
    const contentsNow = () => (isWorkedOut(shader) ? shader : contentsOf(shader, this.#state, session));
    if (shader.key !== this.shader?.key) {
      this.stage = 'compiling';
      await viewport.setMaterial(this.#name, shader, contentsNow());
      this.given = state;
    }
    this.shader = shader; // by one program, solutions may be interpolated or not
    this.drawn = shape;
    this.#settled = !this.#wanted;
    if (shape === this.#shape) this.#setContents(contentsNow(), isWorkedOut(shader) ? state : this.#state);
    onProblem(this.#name, null);
    onShader(this.#name, shader);
  }
}

/** Whether Python works out what a shader reads whenever a value changes: its lobes, or its films. */
const isWorkedOut = (shader) => Boolean(shader?.solution || shader?.films);

/** What a shader whose material is not solved takes of a state: values, three for what may be a colour. */
export function contentsOf(shader, state, session) {
  const values = flat(state, session);
  const shaped = ([key, old]) => {
    const value = values[key] ?? old;
    return [key, Array.isArray(old) && !Array.isArray(value) ? old.map(() => value) : value];
  };
  return { values: Object.fromEntries(Object.entries(shader.values).map(shaped)), films: null, solution: null };
}

const isSame = (a, b) => ['origin', 'target', 'fov'].every((key) => String(a[key]) === String(b[key]));

/** The state of the second picture: of a material that was pinned, or of this one by another model. */
function otherOf(state, session) {
  const { model = session.default_model, switches = {}, material = null } = state.view.other ?? {};
  if (!material) return { ...state, model, switches };
  return { ...state, model, switches, ...stateOf(material), document: material };
}

/**
 * Follows a store: `{shader(slot), drawn(slot), given(slot), stage, quiet, again(), stop()}`; `given` is the state that is
 * drawn, `stage` what takes time (`solving`, `compiling` or null), and `again` asks anew what could not be asked.
 */
export function follow({ store, viewport, call, lacks, session, files, onProblem, onBaked, onShader, onObject }) {
  const part = { viewport, call, lacks, session, onShader, onProblem, onBaked };
  const slots = Object.fromEntries(Object.keys(viewport.slots).map((name) => [name, new Slot(name, part)]));
  const shown = {};
  const placed = new Set(); // keys of the view that something is shown of
  let home = null; // the camera that the object's own view asks for

  /** Does something for a key of the view, once for every value of it; it is tried again where it failed. */
  async function once(key, value, act) {
    if (shown[key] === value) return;
    shown[key] = value;
    try {
      await act(value);
      onProblem(key, null);
    } catch (error) {
      if (shown[key] === value) shown[key] = undefined;
      onProblem(key, error);
    }
  }

  /** Shows what a name stands for; and where that is lost, and nothing is shown yet, `first`, which never is. */
  async function place(key, name, first, load, show) {
    try {
      await show(await load(name));
      placed.add(key);
    } catch (error) {
      if (!placed.has(key) && name !== first) await place(key, first, first, load, show).catch(() => {});
      throw error;
    }
  }

  function update(state) {
    const { object, environment, rotation, exposure, transform, mode, split, lobe, other, tiles = [], lights = NO_LIGHTS } = state.view;
    const seen = { a: state };
    if (isOfMaterials(state.view)) seen.b = otherOf(state, session);
    if (mode === 'tiles') for (const { slot, kept } of tiles) seen[slot] = { ...state, ...kept };
    for (const [name, slot] of Object.entries(slots)) {
      if (seen[name]) slot.follow(seen[name]);
      else slot.leave();
    }
    viewport.setView({
      rotation,
      exposure,
      displayed: transformOf(transform, session).text,
      mode,
      split,
      tiles: tiles.map(({ slot }) => slot).join(''),
      lobe: lobe < slots.a.shader?.parts.flatMap(({ shown }) => shown).length ? lobe : null,
    });
    once('object', object, (name) =>
      place('object', name, session.objects?.[0], files.object, async (given) => {
        await viewport.setObject(given);
        home = viewport.camera;
        viewport.setCamera(store.get().camera ?? home);
        onObject();
      }),
    );
    once('environment', environment, (name) =>
      place('environment', name, session.environments?.[0]?.name, files.environment, (given) => viewport.setEnvironment(given)),
    );
    once('lights', lights, async () => viewport.setLights(lights));
    const beside = isPaired(state.view) && other?.photograph;
    once('photograph', beside || null, async (name) => viewport.setPhotograph(name && (await files.photograph(name))));
    const camera = state.camera ?? home;
    if (camera && !isSame(camera, viewport.camera)) viewport.setCamera(camera);
  }

  const unsubscribe = store.subscribe(update);
  update(store.get());
  return {
    shader: (slot) => slots[slot].shader,
    drawn: (slot) => slots[slot].drawn,
    given: (slot) => slots[slot].given,
    get stage() {
      return Object.values(slots).find(({ stage }) => stage)?.stage ?? null;
    },
    get quiet() {
      return Object.values(slots).every((slot) => slot.quiet);
    },
    again: () => update(store.get()),
    stop() {
      unsubscribe();
      for (const slot of Object.values(slots)) slot.stop();
    },
  };
}
