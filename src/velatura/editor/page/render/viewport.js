// A material on the stage, seen in a canvas: a preview at once, then paths that are added up.

import { decode } from '../arrays.js';
import { cameraUniforms, listen, orbited } from './camera.js';
import { Device } from './device.js';
import { prepare, readPicture } from './environment.js';
import { adding, blending, display, learning } from './glsl/display.glsl.js';
import { Preview } from './preview.js';
import { NODES_WIDTH, TRIANGLES_WIDTH, buildScene } from './scene.js';
import { Slot } from './slot.js';
import { sobol } from './sobol.js';

const QUIET = 150; // milliseconds without a change, after which paths are traced
const SLOW = 100; // milliseconds for a preview, from which on a quicker one comes before it
const SLICE = 40; // milliseconds that the device may be busy without a break
const FIRST = 4; // samples from which on they are shown
const TRUSTED = 16; // samples from which on the preview shows through no more
const MOST_SAMPLES = 64; // at once, however quick they are
const REFRESH = 100; // milliseconds between two pictures while paths are added up
const MOST_PIXELS = 1_000_000;
const defaultFetch = (address) => fetch(address);

export class Viewport {
  /**
   * Raises Error, in words, where the browser cannot draw.
   *
   * @param {HTMLCanvasElement} canvas
   * @param {{call: function, fetch?: function, files?: string, onError?: function(Error)}} options `files` is
   *   where textures lie.
   */
  constructor(canvas, { call, fetch = defaultFetch, files = '/files/', onError = console.error }) {
    Object.assign(this, { canvas, call, fetch, files, onError });
    this.device = new Device(canvas);
    this.load = this.loading();
    this.slots = { a: new Slot(this.device, this.load), b: new Slot(this.device, this.load) };
    this.preview = new Preview(this.device);
    this.truth = null; // in the place of slot b
    this.settings = { rotation: 0, exposure: 0, mode: 'single', split: 0.5, lobe: null };
    this.camera = { origin: [0, 2.6, 7.2], target: [0, 1, 0], fov: 19.5 };
    this.budget = { samples: 1024, milliseconds: Infinity };
    this.sources = {};
    this.listeners = new Set();
    this.frames = [];
    this.held = false;
    this.took = Infinity; // milliseconds, the last preview with all pixels
    this.rows = 8;
    this.row = 0;
    this.stopped = new AbortController();
    this.ready = this.compile();
    this.setSize(canvas.width, canvas.height);
    this.watch();
    this.run();
  }

  // What is shown

  /** A name that call("object") knows, or {parts, view}; the camera goes where its view says. */
  async setObject(object) {
    const named = typeof object === 'string';
    const { parts, view } = named ? partsOf(await this.call('object', { name: object })) : object;
    this.sources.parts = parts;
    this.view = view;
    this.stage();
    this.setCamera(view);
  }

  /** A name that call("environment") knows, the address of an .exr or .hdr file, or {width, height, data}. */
  async setEnvironment(environment) {
    this.sources.environment = prepare(await this.picture(environment));
    this.sources.name = environment;
    this.light();
    if (this.sources.parts) this.stage();
  }

  async picture(environment) {
    if (typeof environment !== 'string') return environment;
    if (/\.(exr|hdr)$/i.test(environment)) {
      const answer = await this.fetch(environment);
      if (!answer.ok) throw new Error(`${environment}: not found`);
      return readPicture(environment, await answer.arrayBuffer());
    }
    const { picture } = await this.call('environment', { name: environment });
    const { array, shape } = decode(picture);
    return { width: shape[1], height: shape[0], data: array };
  }

  /** A material in slot "a" or "b": the answer of call("shader"), and values by flat name. */
  async setMaterial(slot, shader, values = shader.values) {
    const known = this.slots[slot].shader?.key === shader.key;
    await this.slots[slot].setMaterial(shader, values);
    if (!known) this.forget(slot);
    this.changed();
  }

  /** Makes ready for a material that may come: compiles its programs, and draws a pixel, which some devices wait for. */
  async prepare(shader) {
    const slot = (this.coming ??= new Slot(this.device, this.load));
    await slot.setMaterial(shader, shader.values);
    this.preview.warm(slot.previewed, { ...slot.textures, ...this.uniforms() });
  }

  /** What paths have told of one material holds for no other. */
  forget(slot) {
    this.slots[slot].forget();
  }

  /** Other values of the same material: nothing is compiled. */
  setValues(slot, values) {
    this.slots[slot].setValues(values);
    this.changed();
  }

  /** Some of {rotation (degrees), exposure (stops), mode, split, lobe (its number, or null for all)}. */
  setView(view) {
    const before = this.settings;
    if (Object.entries(view).every(([key, value]) => before[key] === value)) return;
    this.settings = { ...before, ...view };
    const { rotation, mode, lobe } = this.settings;
    if (lobe !== before.lobe) Object.values(this.slots).forEach((slot) => slot.setLobe(lobe));
    if (rotation !== before.rotation) this.moved();
    else if (mode !== before.mode || lobe !== before.lobe) this.changed();
    else this.show();
  }

  /**
   * A picture {width, height, data: RGB, linear, from the upper left, samples} in the place of slot b, or
   * null.
   */
  setTruth(truth) {
    this.device.free(this.truth?.texture);
    const { width, height } = this.canvas;
    const texture =
      truth?.data && this.device.texture('RGBA32F', width, height, stretched(truth, width, height));
    this.truth = truth && { ...truth, texture };
    this.wake?.();
    this.show();
  }

  setCamera(camera) {
    this.camera = { ...this.camera, ...camera };
    this.preview.outdated = true;
    this.moved();
  }

  /** Calls f with every camera that hands have moved to. Returns a function that ends this. */
  onCamera(f) {
    this.listeners.add(f);
    return () => this.listeners.delete(f);
  }

  setBudget(budget) {
    this.budget = { ...this.budget, ...budget };
    this.wake?.();
  }

  /**
   * Whether something is being dragged: until it is let go, previews in fewer pixels are all that is drawn.
   */
  moving(held) {
    if (this.held && !held) this.outdate();
    this.held = held;
    this.lastChange = performance.now();
    this.wake?.();
  }

  // What is told

  /** Whether the browser has taken the graphics device away; it comes back by itself. */
  get lost() {
    return this.device.gl.isContextLost();
  }

  get samples() {
    return Math.min(...this.seen().map((slot) => slot.samples));
  }

  /** Whether there is nothing to do but to trace paths. */
  get idle() {
    return this.previewed > 0 && !this.held && this.budget.samples > 0;
  }

  /** Whether the preview has been there, as it is, for so many milliseconds. */
  rested(milliseconds) {
    return this.previewed > 0 && performance.now() - this.previewed > milliseconds;
  }

  /** Of previews, over the last second in which there were any. */
  get framesPerSecond() {
    const last = this.frames.at(-1);
    const recent = this.frames.filter((time) => time > last - 1000);
    return recent.length < 2 ? 0 : (1000 * (recent.length - 1)) / (last - recent[0]);
  }

  /** Mean light of slot "a", or another: {width, height, data: RGBA, linear, from the upper left}. */
  radiance(slot = 'a') {
    const { sum } = this.slots[slot];
    const { width, height } = sum;
    const pixels = this.device.read(sum);
    const data = new Float32Array(pixels.length);
    for (let y = 0; y < height; y++) {
      data.set(pixels.subarray(4 * y * width, 4 * (y + 1) * width), 4 * (height - 1 - y) * width);
    }
    for (let i = 0; i < data.length; i += 4) {
      const weight = data[i + 3] || 1;
      data.set([data[i] / weight, data[i + 1] / weight, data[i + 2] / weight, 1], i);
    }
    return { width, height, data };
  }

  /** A small square picture of another material on the same object, from here; an ImageData. */
  async thumbnail(shader, values, size, samples) {
    const slot = (this.small ??= new Slot(this.device, this.load));
    if (slot.pass?.width !== size) slot.setSize(size, size);
    await slot.setMaterial(shader, values);
    slot.samples = 0;
    const uniforms = this.uniforms({ width: size, height: size });
    while (slot.samples < samples) {
      const sample = { ...slot.uniforms(), ...uniforms, ...sobol(slot.samples), sample_number: slot.samples };
      this.device.draw(slot.traced, sample, slot.pass);
      slot.add(this.adding);
      await this.device.done();
    }
    const shown = this.device.target(size, size, ['RGBA32F']);
    const [picture] = slot.sum.textures;
    const { exposure } = this.settings;
    this.device.draw(
      this.display,
      { picture_a: picture, picture_b: picture, exposure, split: 1, difference: false },
      shown,
    );
    const pixels = this.device.read(shown);
    this.device.free(shown);
    const image = new ImageData(size, size);
    for (let y = 0; y < size; y++) {
      const row = pixels.subarray(4 * y * size, 4 * (y + 1) * size);
      image.data.set(
        row.map((value) => 255 * value),
        4 * (size - 1 - y) * size,
      );
    }
    return image;
  }

  dispose() {
    this.stopped.abort();
    this.wake?.();
    this.device.gl.getExtension('WEBGL_lose_context')?.loseContext();
  }

  // On the device

  async compile() {
    const { device } = this;
    [this.adding, this.blending, this.learning, this.display] = await Promise.all(
      [adding, blending, learning, display].map((text) => device.program(text)),
    );
    await this.preview.compile();
  }

  stage() {
    const { device, sources } = this;
    const scene = buildScene(sources.parts.filter(({ role }) => stands(role, sources.name)));
    this.preview.setScene(scene);
    device.free(this.nodes, this.triangles);
    this.nodes = device.texture('RGBA32UI', NODES_WIDTH, scene.nodes.length / (4 * NODES_WIDTH), scene.nodes);
    this.triangles = device.texture(
      'RGBA32F',
      TRIANGLES_WIDTH,
      scene.packed.length / (4 * TRIANGLES_WIDTH),
      scene.packed,
    );
    this.traversal = {
      scene_nodes: this.nodes,
      scene_triangles: this.triangles,
      scene_count: scene.count,
      grid_origin: scene.grid.origin,
      grid_scale: scene.grid.scale,
    };
    this.moved();
  }

  light() {
    const { device, sources } = this;
    const { width, height, light, steps: sums, blurred } = sources.environment;
    device.free(this.light_, this.steps, this.blurred);
    this.light_ = device.texture('RGBA32F', width, height, light);
    this.steps = device.texture('R32F', width + 1, height - 1, sums);
    const soft = { filter: 'LINEAR', wrap: 'REPEAT', mipmaps: true };
    this.blurred = device.texture(device.soft, width, height, blurred, soft);
    this.moved();
  }

  loading() {
    const kept = new Map();
    const once = (key, load) => {
      const tried = () =>
        load().catch((error) => {
          kept.delete(key);
          throw error;
        });
      if (!kept.has(key)) kept.set(key, tried());
      return kept.get(key);
    };
    return {
      tables: (key) =>
        once(key, async () => {
          const { array, shape } = decode((await this.call('tables', { key })).texture);
          return this.device.texture('RGBA32F', shape[1], shape[0], array);
        }),
      table: (name) => once(`table ${name}`, async () => decode((await this.call('table', { name })).table)),
      image: (name, encoding) => once(`${encoding} ${name}`, () => this.image(name, encoding)),
    };
  }

  async image(name, encoding) {
    const answer = await this.fetch(this.files + encodeURIComponent(name));
    if (!answer.ok) throw new Error(`${name}: no such texture`);
    const bitmap = await createImageBitmap(await answer.blob(), {
      colorSpaceConversion: 'none',
      premultiplyAlpha: 'none',
    });
    return this.device.image(bitmap, encoding);
  }

  setSize(width, height) {
    Object.assign(this.canvas, { width, height });
    this.preview.setSize(width, height);
    for (const slot of Object.values(this.slots)) slot.setSize(width, height);
    if (this.truth) this.setTruth(this.truth);
    this.changed();
  }

  uniforms({ width, height } = this.canvas) {
    const turn = (this.settings.rotation * Math.PI) / 180;
    return {
      ...cameraUniforms(this.camera, width, height),
      environment_picture: this.light_,
      environment_steps: this.steps,
      environment_blurred: this.blurred,
      environment_turn: [Math.cos(turn), Math.sin(turn)],
      irradiance: this.sources.environment.irradiance,
      ...this.traversal,
    };
  }

  seen() {
    return this.settings.mode === 'single' || this.truth ? [this.slots.a] : [this.slots.a, this.slots.b];
  }

  // Over time

  /** Other values: what paths have told about shadows may stay. */
  changed() {
    for (const slot of Object.values(this.slots)) {
      if (slot.samples >= TRUSTED) slot.learn(this.learning, this.preview.seen.textures[0]);
      slot.samples = 0;
    }
    this.row = 0;
    this.outdate();
    this.lastChange = this.started = performance.now();
    this.wake?.();
  }

  /** Asks for another preview. */
  outdate() {
    this.previewed = 0; // the time from which on there is a preview
    this.quick = false;
    this.drawing = null;
  }

  /** Another view, or other light. */
  moved() {
    for (const slot of Object.values(this.slots)) slot.forget();
    this.changed();
  }

  async run() {
    await this.ready.catch(this.onError);
    while (!this.stopped.signal.aborted) {
      try {
        await this.step();
      } catch (error) {
        this.onError(error);
        await this.sleep(1000);
      }
    }
  }

  async step() {
    if (!this.nodes || !this.light_ || this.seen().some((slot) => !slot.shader)) return this.sleep(1000);
    if (!this.previewed) return this.drawPreview();
    const quiet = performance.now() - this.lastChange;
    if (this.held || quiet < QUIET) return this.sleep(this.held ? 1000 : QUIET - quiet);
    const { samples, milliseconds } = this.budget;
    if (this.samples >= samples || performance.now() - this.started > milliseconds) return this.sleep(1000);
    return this.trace();
  }

  /** Until so much time has gone, or something has changed. */
  sleep(milliseconds) {
    return new Promise((resolve) => {
      const timer = setTimeout(resolve, milliseconds);
      this.wake = () => {
        clearTimeout(timer);
        resolve();
      };
    });
  }

  /** In fewer pixels while something is dragged, and at first, where the last one with all of them took long. */
  async drawPreview() {
    const quick = this.held || (!this.quick && this.took > SLOW);
    const drawing = (this.drawing = {});
    const uniforms = this.uniforms(), start = performance.now();
    this.preview.update(uniforms.camera_projection);
    for (const slot of this.seen()) slot.drawPreview(this.preview, uniforms, quick);
    this.show();
    const time = await this.device.done();
    if (!quick) this.took = time - start;
    this.frames = [...this.frames.slice(-100), time];
    if (this.drawing !== drawing) return; // for something has changed
    this.quick = quick && !this.held;
    this.previewed = this.quick ? 0 : time;
  }

  /**
   * A few rows of a sample of all slots that are seen, or several samples: as many as fit into a slice of
   * time. The device works on them while we wait for those before.
   */
  async trace() {
    const uniforms = this.uniforms();
    let rows = 0;
    while (rows < this.rows && this.samples < this.budget.samples) {
      const left = this.canvas.height - this.row;
      const parts = Math.ceil(left / (this.rows - rows));
      rows += this.traceRows(uniforms, Math.ceil(left / parts));
    }
    const before = this.slice;
    this.slice = { rows, start: performance.now(), done: this.device.done() };
    if (before) this.pace(before.rows, (await before.done) - before.start);
    this.slice.start = performance.now();
  }

  traceRows(uniforms, rows) {
    const slots = this.seen();
    for (const slot of slots) {
      const sample = { ...slot.uniforms(), ...uniforms, ...sobol(slot.samples), sample_number: slot.samples };
      this.device.draw(slot.traced, sample, slot.pass, { rows: [this.row, this.row + rows] });
    }
    this.row = (this.row + rows) % this.canvas.height;
    if (this.row === 0) {
      for (const slot of slots) slot.add(this.adding);
      if (performance.now() - (this.lastShown ?? 0) > REFRESH) this.show();
    }
    return rows;
  }

  /** Takes more rows next time, or fewer, after some have taken so many milliseconds. */
  pace(rows, took) {
    const scale = Math.min(Math.max(SLICE / Math.max(took, 1), 0.25), 2);
    this.rows = Math.min(Math.max(Math.round(rows * scale), 1), MOST_SAMPLES * this.canvas.height);
  }

  /** Draws the canvas, once for all that was asked since the last frame of the page. */
  show() {
    this.asked ??= requestAnimationFrame(() => {
      this.asked = null;
      this.lastShown = performance.now();
      this.paint();
    });
  }

  paint() {
    if (!this.display || !this.nodes) return;
    const { mode, split, exposure } = this.settings;
    const [a, b = this.truth?.texture ?? a] = this.seen().map((slot) => this.blended(slot));
    const uniforms = { picture_a: a, picture_b: b, exposure, split: mode === 'split' ? split : 1 };
    this.device.draw(this.display, { ...uniforms, difference: mode === 'difference' }, null);
  }

  /** The texture that stands for a slot: the preview, the sum of paths, or in between both. */
  blended(slot) {
    if (slot.samples < FIRST) return slot.preview.textures[0];
    if (slot.samples >= TRUSTED) return slot.sum.textures[0];
    const [, spare] = slot.sums;
    const trust = slot.samples / (slot.samples + 2);
    const uniforms = { picture: slot.preview.textures[0], sum: slot.sum.textures[0], trust };
    this.device.draw(this.blending, uniforms, spare);
    return spare.textures[0];
  }

  // From outside

  watch() {
    const { canvas, stopped } = this;
    const { signal } = stopped;
    const orbit = (...by) => {
      this.setCamera(orbited(this.camera, ...by));
      this.listeners.forEach((f) => f(this.camera));
    };
    listen(canvas, { move: orbit, begin: () => this.moving(true), end: () => this.moving(false) }, signal);

    const fit = new ResizeObserver(() => {
      const { clientWidth, clientHeight } = canvas;
      if (!clientWidth || !clientHeight) return;
      const fine = Math.min(devicePixelRatio, Math.sqrt(MOST_PIXELS / (clientWidth * clientHeight)));
      const size = [clientWidth, clientHeight].map((length) => Math.max(Math.round(length * fine), 1));
      if (size[0] !== canvas.width || size[1] !== canvas.height) this.setSize(...size);
    });
    fit.observe(canvas);
    signal.addEventListener('abort', () => fit.disconnect());

    const lost = (event) => {
      event.preventDefault();
      this.nodes = null;
    };
    canvas.addEventListener('webglcontextlost', lost, { signal });
    canvas.addEventListener('webglcontextrestored', () => this.restore().catch(this.onError), { signal });
  }

  /** All that the lost context held, from what the page has kept. */
  async restore() {
    this.device.restore();
    this.small = this.coming = null;
    this.load = this.loading();
    const { width, height } = this.canvas;
    this.preview = new Preview(this.device);
    this.preview.setSize(width, height);
    this.ready = this.compile();
    await this.ready;
    for (const [name, { shader, values, lobe }] of Object.entries(this.slots)) {
      this.slots[name] = new Slot(this.device, this.load);
      this.slots[name].lobe = lobe;
      this.slots[name].setSize(width, height);
      if (shader) await this.slots[name].setMaterial(shader, values);
    }
    if (this.truth) this.setTruth(this.truth);
    if (this.sources.environment) this.light();
    if (this.sources.parts) this.stage();
  }
}

/** {parts, view} of an answer of call("object"), as setObject takes it. */
export function partsOf({ parts, view }) {
  const decoded = parts.map(({ role, ...arrays }) => ({
    role,
    ...Object.fromEntries(Object.entries(arrays).map(([key, value]) => [key, decode(value).array])),
  }));
  return { parts: decoded, view };
}

/** An RGB picture as RGBA of another size, from the lower row on; pixels stay pixels. */
function stretched({ width, height, data }, columns, rows) {
  const found = new Float32Array(4 * columns * rows);
  for (let y = 0; y < rows; y++) {
    const row = Math.floor(((rows - 1 - y) * height) / rows);
    for (let x = 0; x < columns; x++) {
      const from = 3 * (row * width + Math.floor((x * width) / columns));
      found.set([data[from], data[from + 1], data[from + 2], 1], 4 * (y * columns + x));
    }
  }
  return found;
}

/** Only the sky ends at a horizon, and in a furnace the object floats alone. */
function stands(role, environment) {
  if (role === 'ground') return environment === 'sky';
  return role === 'object' || environment !== 'furnace';
}
