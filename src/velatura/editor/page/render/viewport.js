// A material on the stage, seen in a canvas: a preview at once, then paths that are added up.

import { listen, orbited, rayOf } from './camera.js';
import { Device } from './device.js';
import { prepare } from './environment.js';
import { GBuffer } from './gbuffer.js';
import { withLights } from './lights.js';
import { Loader } from './loader.js';
import { buildScene, namesOf } from './scene.js';
import { Bands, Schedule } from './schedule.js';
import { Screen, isTrusted } from './screen.js';
import { Slot } from './slot.js';
import { Stage } from './stage.js';
import { Thumbnails, radianceOf } from './stills.js';
import { tileCorner, tileSize } from './tiles.js';

const REFRESH = 100; // milliseconds between two pictures while paths are added up
const WARMING = 10; // milliseconds until the next look while a program draws for the first time
const RETRY = 1000; // milliseconds until the next look after an error, and while something is missing
const MOST_PIXELS = 1_000_000;
const PAIR = ['a', 'b']; // the slots that are compared over the whole canvas
const SLOTS = [...PAIR, 'c', 'd']; // those that are shown side by side
const defaultFetch = (address) => fetch(address);

export class Viewport {
  canvas;
  camera = { origin: [0, 2.6, 7.2], target: [0, 1, 0], fov: 19.5 };
  settings = { rotation: 0, exposure: 0, displayed: '', mode: 'single', split: 0.5, lobe: null, tiles: '' };
  schedule = new Schedule();
  sources = { lights: [] }; // of object and light: {parts, environment, name, picture, lights}, from which a lost device gets them again

  // On the device, and lost with it
  device;
  loader;
  gbuffer;
  stage;
  screen;
  slots;
  coming; // the slot of a material that may come
  thumbnails;
  ready; // when all is compiled that no material changes

  #standing = []; // parts of the object
  #services;
  #onError;
  #listeners = new Set(); // to the camera
  #turners = new Set(); // of the light
  #tappers = new Set(); // of places of the picture
  #stopped = new AbortController();
  #bands = new Bands();
  #slice = null; // of paths that the device is at work on
  #asked = false; // whether the canvas is to be drawn in the next frame of the page
  #painted = 0; // when it was
  #wake = () => {};

  /**
   * Raises Error, in words, where the browser cannot draw.
   *
   * @param {HTMLCanvasElement} canvas
   * @param {{call: function, displayed: string, fetch?: function, files?: string, onError?: function(Error)}} options
   *   `displayed` is the view transform, of call("session"); `files` is where textures lie.
   */
  constructor(canvas, { call, displayed, fetch = defaultFetch, files = '/files/', onError = console.error }) {
    this.canvas = canvas;
    this.settings.displayed = displayed;
    this.#services = { call, fetch, files };
    this.#onError = onError;
    this.device = new Device(canvas);
    this.#build();
    this.setSize(canvas.width, canvas.height);
    this.#watch();
    this.#run();
  }

  // Contents

  /** A name for call("object"), or {parts, view}; the camera takes its view. */
  async setObject(object) {
    const { parts, view } = typeof object === 'string' ? await this.loader.object(object) : object;
    this.sources.parts = parts;
    this.#placeObject();
    this.setCamera(view);
  }

  /** A name that call("environment") knows, the address of an .exr or .hdr file, or {width, height, data}. */
  async setEnvironment(environment) {
    const named = typeof environment === 'string';
    this.sources.picture = named ? await this.loader.environment(environment) : environment;
    this.sources.name = environment;
    this.setLights(this.sources.lights);
    if (this.sources.parts) this.#placeObject();
  }

  /** Lights, of render/lights.js, in addition to the environment. */
  setLights(lights) {
    this.sources.lights = lights;
    if (!this.sources.picture) return;
    this.sources.environment = prepare(this.lighting);
    this.#placeLight();
  }

  /** The picture of all light: {width, height, data: linear RGB from the top}. */
  get lighting() {
    return withLights(this.sources.picture, this.sources.lights);
  }

  /** A material in a slot, "a" to "d": the answer of call("shader"), and maybe another one of call("values"). */
  async setMaterial(slot, shader, contents = shader) {
    const known = this.slots[slot].shader?.key === shader.key;
    await this.slots[slot].setMaterial(shader, contents);
    if (!known) this.forget(slot);
    this.#changed();
  }

  /** Makes ready for a material that may come: compiles its programs, and draws a pixel, which some devices wait for. */
  async prepare(shader) {
    const slot = (this.coming ??= new Slot(this.device, this.loader));
    await slot.setMaterial(shader, shader);
    await slot.warm(this.gbuffer, this.uniforms());
  }

  /** Shadows that were learnt from paths of one material hold for no other. */
  forget(slot) {
    this.slots[slot].forget();
  }

  /** Other values of the same material: nothing is compiled. Of `coarse` ones no paths are traced. */
  setContents(slot, contents) {
    this.slots[slot].setContents(contents);
    this.#changed();
  }

  /**
   * Some of {rotation (degrees), exposure (stops), displayed (a view transform in GLSL), mode (single, split, difference or tiles), split, lobe (its number, or
   * null for all), tiles (names of the slots beside "a", such as "bc")}.
   */
  setView(view) {
    const before = this.settings, { width, height } = this.frame;
    if (Object.entries(view).every(([key, value]) => before[key] === value)) return;
    this.settings = { ...before, ...view };
    const { rotation, displayed, mode, lobe, tiles } = this.settings, { frame } = this;
    if (displayed !== before.displayed) {
      this.ready = this.screen.compile(displayed);
      this.ready.then(() => this.#show(), this.#onError);
    }
    if (lobe !== before.lobe) Object.values(this.slots).forEach((slot) => slot.setLobe(lobe));
    if (frame.width !== width || frame.height !== height) this.#fit();
    if (rotation !== before.rotation) this.#moved();
    else if (mode !== before.mode || lobe !== before.lobe || tiles !== before.tiles) this.#changed();
    else this.#show();
  }

  /**
   * A picture {width, height, data: RGB, linear, from the upper left, samples} in the place of slot b, or
   * null.
   */
  setTruth(truth) {
    this.screen.setTruth(truth, this.canvas);
    this.#wake();
    this.#show();
  }

  /** A photograph, an ImageBitmap, in the place of slot b, or null. */
  setPhotograph(image) {
    this.screen.setPhotograph(image, this.canvas);
    this.#wake();
    this.#show();
  }

  setCamera(camera) {
    this.camera = { ...this.camera, ...camera };
    this.gbuffer.outdate();
    this.#moved();
  }

  /** Calls f with every camera that hands have moved to. Returns a function that ends this. */
  onCamera(f) {
    this.#listeners.add(f);
    return () => this.#listeners.delete(f);
  }

  /** Calls f with the degrees that hands turn the light by. */
  onTurn(f) {
    this.#turners.add(f);
  }

  /** Calls f with a place of the canvas on the page, `{x, y}`, that was clicked. Returns a function that ends this. */
  onTap(f) {
    this.#tappers.add(f);
    return () => this.#tappers.delete(f);
  }

  setBudget(budget) {
    this.schedule.budget = { ...this.schedule.budget, ...budget };
    this.#wake();
  }

  setSize(width, height) {
    this.canvas.width = width;
    this.canvas.height = height;
    this.#fit();
    this.#changed();
  }

  /** Whether something is being dragged: until it is let go, coarse previews are all that is drawn. */
  moving(held) {
    this.schedule.hold(held, performance.now());
    this.#wake();
  }

  // Where it stands

  /** Whether the browser has taken the graphics device away; it comes back by itself. */
  get lost() {
    return this.device.gl.isContextLost();
  }

  /** The size of one picture in pixels: of the canvas, or of a part of it where several are side by side. */
  get frame() {
    return tileSize(this.#names().length, this.canvas);
  }

  /** The names of the parts of the object; '' alone where it has none. */
  get names() {
    return namesOf(this.#standing);
  }

  get truth() {
    return this.screen.truth;
  }

  get samples() {
    return Math.min(...this.#seen().map((slot) => slot.samples));
  }

  get budget() {
    return this.schedule.budget;
  }

  get held() {
    return this.schedule.held;
  }

  /** The time at which the preview of the current state was drawn; 0 before that. */
  get previewed() {
    return this.schedule.previewed;
  }

  /** Whether the device is busy with programs that draw for the first time, and any question to it would wait. */
  get warming() {
    return this.device.warming > 0;
  }

  /** Whether there is nothing to do but to trace paths. */
  get idle() {
    return this.schedule.idle && !this.warming;
  }

  /** Whether the preview has been there, as it is, for so many milliseconds, and the device can be asked for more. */
  rested(milliseconds) {
    return this.schedule.rested(milliseconds, performance.now()) && !this.warming;
  }

  /** Mean light of slot "a", or another: {width, height, data: RGBA, linear, from the upper left}. */
  radiance(slot = 'a') {
    return radianceOf(this.device, this.slots[slot].sum);
  }

  /** The mean absolute difference in luminance, exposed, of what is compared; null where nothing is, yet. */
  async difference() {
    const seen = this.#seen(), isPair = this.truth || seen.length > 1;
    if (this.settings.mode !== 'difference' || !isPair || !this.screen.ready || this.lost) return null;
    return this.screen.difference(seen, this.settings);
  }

  /**
   * What a place of the canvas on the page shows of the object: the `name` of the part, the normal there, and the direction `ray`
   * to it from the camera; null where it shows nothing of it, and beside others.
   */
  seenAt(place) {
    if (this.lost || this.#names().length > 1) return null;
    const uniforms = this.uniforms(), [x, y] = this.#pixelOf(place);
    this.gbuffer.update(uniforms.camera_projection);
    const found = this.gbuffer.at(x, y);
    return found && { name: this.names[found.part], normal: found.normal, ray: rayOf(uniforms, x + 0.5, y + 0.5).toArray() };
  }

  /**
   * The linear light of a place of the canvas on the page, exposed, the mean of a few pixels; of a photograph that of its bytes. Null
   * where there is none, of a difference, and beside others.
   */
  lightAt(place) {
    const { mode, split, exposure } = this.settings, [x, y] = this.#pixelOf(place);
    if (this.lost || mode === 'difference' || this.#names().length > 1) return null;
    const isRight = mode === 'split' && x + 0.5 >= split * this.frame.width, [a, b = a] = this.#seen();
    return this.screen.lightAt(isRight ? b : a, { x, y, isRight, exposure });
  }

  /** The pixel at a place of the canvas on the page, from the lower left. */
  #pixelOf({ x, y }) {
    const { width, height, clientWidth, clientHeight } = this.canvas;
    const within = (share, length) => Math.min(Math.max(Math.floor(share * length), 0), length - 1);
    return [within(x / clientWidth, width), within(1 - y / clientHeight, height)];
  }

  /** A small square picture of another material on the same object, from here; an ImageData. */
  thumbnail(shader, contents, size, samples) {
    const uniforms = this.pathUniforms({ width: size, height: size });
    return this.thumbnails.draw(shader, contents, { size, samples, exposure: this.settings.exposure, uniforms });
  }

  /** The middle of the picture of slot "a", alone and as it is now, in a size: a data URL. */
  snapshot(width, height) {
    const copy = Object.assign(this.canvas.ownerDocument.createElement('canvas'), { width, height });
    const { frame, canvas } = this;
    const scale = Math.max(width / frame.width, height / frame.height);
    const [w, h] = [width / scale, height / scale];
    const [x, y] = [(frame.width - w) / 2, canvas.height - (frame.height + h) / 2]; // of the lower left corner
    this.screen.paint([this.slots.a], { ...this.settings, mode: 'single' });
    copy.getContext('2d').drawImage(canvas, x, y, w, h, 0, 0, width, height);
    this.paint(); // the canvas, in the same frame of the page
    return copy.toDataURL('image/jpeg', 0.85);
  }

  /** The uniforms of object, light and camera, for a picture of a size. */
  uniforms(size = this.frame) {
    return this.stage.uniforms(this.camera, size, this.settings.rotation);
  }

  /** The same for pictures of paths. */
  pathUniforms(size = this.frame) {
    return this.stage.pathUniforms(this.camera, size, this.settings.rotation);
  }

  dispose() {
    this.#stopped.abort();
    this.#wake();
    this.device.gl.getExtension('WEBGL_lose_context')?.loseContext();
  }

  // On the device

  /** All that lives on the device, empty. */
  #build() {
    const { device } = this;
    this.loader = new Loader(device, this.#services);
    this.gbuffer = new GBuffer(device);
    this.stage = new Stage(device);
    this.#standing = [];
    this.screen = new Screen(device);
    this.slots = Object.fromEntries(SLOTS.map((name) => [name, new Slot(device, this.loader)]));
    this.coming = null;
    this.thumbnails = new Thumbnails(device, this.loader, this.screen);
    this.ready = Promise.all([this.screen.compile(this.settings.displayed), this.gbuffer.compile(), this.slots.a.compile()]);
  }

  /** Restores all data of the lost context from the page's own copies. */
  async #restore() {
    const { slots, truth, sources } = this, { photograph } = this.screen;
    this.device.restore();
    this.#build();
    this.#fit();
    if (truth) this.setTruth(truth);
    if (photograph) this.setPhotograph(photograph.image);
    await this.ready;
    for (const [name, { shader, contents, lobe }] of Object.entries(slots)) {
      this.slots[name].setLobe(lobe);
      if (shader) await this.slots[name].setMaterial(shader, contents);
    }
    if (sources.environment) this.#placeLight();
    if (sources.parts) this.#placeObject();
  }

  /** Gives everything the size of a picture. */
  #fit() {
    const { width, height } = this.frame, names = this.#names();
    this.gbuffer.setSize(width, height);
    for (const name of names.length > 1 ? SLOTS : PAIR) this.slots[name].setSize(width, height);
    if (this.truth) this.setTruth(this.truth);
    if (this.screen.photograph) this.setPhotograph(this.screen.photograph.image);
  }

  #placeObject() {
    const { parts, name } = this.sources;
    const standing = parts.filter(({ role }) => stands(role, name));
    if (standing.length === this.#standing.length && standing.every((part, i) => part === this.#standing[i])) return;
    this.#standing = standing;
    const scene = buildScene(standing);
    for (const slot of Object.values(this.slots)) slot.setNames(scene.names);
    this.gbuffer.setScene(scene);
    this.stage.setObject(scene);
    this.#moved();
  }

  #placeLight() {
    this.stage.setLight(this.sources.environment);
    this.#moved();
  }

  /** The slots that are side by side, by their names. */
  #names() {
    const { mode, tiles } = this.settings;
    return mode === 'tiles' ? ['a', ...tiles] : ['a'];
  }

  /** The slots that are drawn: the first, and of those beside it all that have a material. */
  #seen() {
    const { a } = this.slots, { mode } = this.settings;
    const names = mode === 'tiles' || mode === 'single' || this.truth || this.screen.photograph ? this.#names() : PAIR;
    return names.map((name) => this.slots[name]).filter((slot) => slot === a || slot.shader);
  }

  // Over time

  /** Other values: shadows that were learnt from paths may stay. */
  #changed() {
    for (const slot of Object.values(this.slots)) {
      if (isTrusted(slot)) slot.learn(this.gbuffer.normals);
      slot.samples = 0;
    }
    this.#bands.restart();
    this.schedule.change(performance.now());
    this.#wake();
  }

  /** Another view, or other light. */
  #moved() {
    for (const slot of Object.values(this.slots)) slot.forget();
    this.#changed();
  }

  async #run() {
    await this.ready.catch(this.#onError);
    while (!this.#stopped.signal.aborted) {
      try {
        await this.#step();
      } catch (error) {
        this.#onError(error);
        await this.#sleep(RETRY);
      }
    }
  }

  async #step() {
    const { hasObject, hasLight } = this.stage;
    if (!hasObject || !hasLight || this.#seen().some((slot) => !slot.shader)) return this.#sleep(RETRY);
    const { act, milliseconds } = this.schedule.next(performance.now(), this.samples);
    if (this.warming) return this.#sleep(WARMING);
    if (act === 'preview') return this.#drawPreview();
    if (act === 'wait') return this.#sleep(milliseconds);
    return this.#seen().some((slot) => slot.contents.coarse) ? this.#sleep(RETRY) : this.#trace();
  }

  /** Until so much time has gone, or something has changed. */
  #sleep(milliseconds) {
    return new Promise((resolve) => {
      const timer = setTimeout(resolve, milliseconds);
      this.#wake = () => {
        clearTimeout(timer);
        resolve();
      };
    });
  }

  async #drawPreview() {
    if (!this.held) await this.device.shown; // the page would wait for the canvas until all pixels are drawn
    await Promise.all(this.#seen().map((slot) => slot.warm(this.gbuffer, this.uniforms())));
    const uniforms = this.uniforms(), drawing = this.schedule.beginPreview(performance.now());
    this.gbuffer.update(uniforms.camera_projection);
    for (const slot of this.#seen()) slot.drawPreview(this.gbuffer, uniforms, drawing.block);
    const done = await this.device.done();
    this.#show();
    this.schedule.endPreview(drawing, done);
  }

  /** A slice of paths, in all slots that are seen. The device works on it while we wait for the one before. */
  async #trace() {
    await Promise.all(this.#seen().map((slot) => slot.warmPaths(this.pathUniforms())));
    if (!this.#seen().every((slot) => slot.traces)) return; // materials have come meanwhile
    const uniforms = this.pathUniforms(), { height } = this.frame, before = this.#slice;
    let rows = 0;
    for (let band; this.samples < this.budget.samples && (band = this.#bands.next(height, rows)); ) {
      for (const slot of this.#seen()) slot.trace(uniforms, band);
      if (this.#bands.advance(band, height)) this.#add();
      rows += band.end - band.first;
    }
    const slice = (this.#slice = { rows, begun: performance.now(), done: this.device.done() });
    if (before) this.#bands.pace(before.rows, (await before.done) - before.begun, height);
    slice.begun = performance.now(); // when the device is free for it
  }

  /** A sample is traced, in all slots that are seen. */
  #add() {
    for (const slot of this.#seen()) slot.add();
    if (performance.now() - this.#painted > REFRESH) this.#show();
  }

  /** Draws the canvas, once for all that was asked since the last frame of the page. */
  #show() {
    if (this.#asked) return;
    this.#asked = true;
    this.device.shown = new Promise((resolve) => {
      requestAnimationFrame(() => {
        this.#asked = false;
        this.#painted = performance.now();
        this.paint();
        setTimeout(resolve); // after the frame
      });
    });
  }

  paint() {
    if (!this.screen.ready || !this.stage.hasObject) return;
    const { settings, canvas } = this, seen = this.#seen(), names = this.#names();
    if (names.length === 1) return this.screen.paint(seen, settings);
    const all = names.map((name, place) => ({ slot: this.slots[name], corner: tileCorner(place, names.length, canvas) }));
    this.screen.paintTiles(all.filter(({ slot }) => seen.includes(slot)), this.frame, settings);
  }

  // From outside

  #watch() {
    const { canvas } = this, { signal } = this.#stopped;
    const orbit = (...by) => {
      this.setCamera(orbited(this.camera, ...by));
      this.#listeners.forEach((f) => f(this.camera));
    };
    const turn = (azimuth) => this.#turners.forEach((f) => f((180 * azimuth) / Math.PI));
    const tap = (x, y) => this.#tappers.forEach((f) => f({ x, y }));
    listen(canvas, { move: orbit, turn, tap, begin: () => this.moving(true), end: () => this.moving(false) }, signal);

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
      this.stage.lose();
    };
    canvas.addEventListener('webglcontextlost', lost, { signal });
    canvas.addEventListener('webglcontextrestored', () => this.#restore().catch(this.#onError), { signal });
  }
}

/** Only the sky ends at a horizon, and in a furnace the object floats alone. */
function stands(role, environment) {
  if (role === 'ground') return environment === 'sky';
  return role === 'object' || environment !== 'furnace';
}
