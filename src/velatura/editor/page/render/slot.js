// A material on the stage: its programs, its parameters, its lobes, and the light that was added up.

import { decode } from '../arrays.js';
import { Bake } from './bake.js';
import { MOST_PARTS } from './glsl/covering.glsl.js';
import { adding, learning } from './glsl/display.glsl.js';
import { lighting } from './glsl/preview.glsl.js';
import { tracer } from './glsl/tracer.glsl.js';
import { sobol } from './sobol.js';

const FILM_WIDTH = 257; // texels of a line of films, as in Python; each table begins a line

const linesOf = (shape) => Math.ceil(shape.slice(0, -1).reduce((a, b) => a * b) / FILM_WIDTH);

/** Tables of films, three colours at each node, as the texels of their texture. */
function texelsOf(films) {
  const tables = Object.values(films);
  const texels = new Float32Array(4 * FILM_WIDTH * tables.reduce((sum, { shape }) => sum + linesOf(shape), 0));
  let begin = 0;
  for (const { array, shape } of tables) {
    for (let k = 0; k < array.length; k += 3) texels.set(array.subarray(k, k + 3), begin + (4 * k) / 3);
    begin += 4 * FILM_WIDTH * linesOf(shape);
  }
  return texels;
}

/** The weights of all lobes, 0 or 1: of those whose number among all is shown. */
export function weightsOf({ parts }, isShown) {
  let number = 0;
  const weights = (part) => [`vt_${part.prefix}shown`, part.shown.map(() => (isShown(number++) ? 1 : 0))];
  return Object.fromEntries(parts.map(weights));
}

/** For each part of an object the number, from 1 on, of the part of a mixture that covers it; zeros where shares hold. */
export function coveringOf(names, covers) {
  const found = new Int32Array(MOST_PARTS);
  if (covers) names.forEach((name, k) => (found[k] = name && (covers.indexOf(name) + 1 || covers.length)));
  return found;
}

/** The entries whose names begin so, without that. */
function within(named, begin) {
  const own = Object.entries(named).filter(([name]) => name.startsWith(begin));
  return Object.fromEntries(own.map(([name, value]) => [name.slice(begin.length), value]));
}

export class Slot {
  device;
  shader = null; // the answer of call("shader")
  contents = null; // {values by flat name, films, solution}, as call("values") has them; maybe `coarse`, for previews alone; what its parts `covers`
  lobe = null; // the one that is shown alone, by its number
  samples = 0;
  preview = null; // the target that it is drawn to
  pass = null; // the target of the sample that is traced
  shades = null; // two targets: by how much paths make the preview darker, and a spare one
  #loader;
  #asked = null; // the shader that was set last, which may be compiling
  #tracing = null; // compiled once paths are wanted
  #lighting = null;
  #adding = null;
  #learning = null;
  #textures = {}; // by the names of their samplers
  #bakes = []; // what works out the lobes of each part, or null
  #films = null; // tables of thin films by name: {array, shape}
  #solved = null; // what Python has worked out of each part: texels, colours of the remainder, numbers of the layout
  #placed = {}; // values by their places in the shader's struct
  #names = ['']; // of the parts of the object
  #outdated = true; // whether the bake is of other values
  #coarse = false; // whether it is a coarse one
  #surrounded = false; // whether the preview has what is around the object
  #drawn = null; // whether the preview of the present contents is `coarse` or `fine`; null where it is of others
  #sums = null; // two targets: light added up, and a spare one

  /** `loader` provides the data that a shader names, like that of loader.js. */
  constructor(device, loader) {
    this.device = device;
    this.#loader = loader;
  }

  /** Compiles the programs that all materials share. */
  async compile() {
    const texts = [adding, learning];
    [this.#adding, this.#learning] = await Promise.all(texts.map((text) => this.device.program(text)));
  }

  /** Takes a material; compiles where its code is new. The one before stays until all is ready. */
  async setMaterial(shader, contents) {
    const { device } = this;
    if (this.shader?.key !== shader.key) {
      this.#asked = shader;
      const baked = [...new Set(shader.parts.flatMap((part) => part.baked?.tables ?? []))];
      const [lit, tables, looked, maps] = await Promise.all([
        device.program(lighting(shader)),
        shader.tables && this.#loader.tables(shader.tables),
        Promise.all(baked.map((name) => this.#loader.table(name))),
        Promise.all((shader.maps ?? []).map(({ texture, encoding, curve }) => this.#loader.image(texture, encoding, curve))),
        this.compile(),
      ]);
      if (this.#asked !== shader) return;
      device.free(this.#textures.vt_baked, this.#textures.vt_films);
      this.shader = shader;
      this.#tracing = null;
      this.#lighting = lit;
      this.#textures = { vt_tables: tables };
      shader.maps?.forEach(({ sampler }, i) => (this.#textures[sampler] = maps[i]));
      this.#setBake(Object.fromEntries(baked.map((name, k) => [name, looked[k]])));
    }
    this.setContents(contents);
  }

  #setBake(tables) {
    const { device, shader } = this, [height, width] = shader.texels;
    this.#bakes = shader.parts.map(({ baked }) => baked && new Bake(baked, tables));
    if (height) this.#textures.vt_baked = device.texture('RGBA32F', width, height);
    if (shader.films) {
      const lines = Object.values(shader.films).reduce((sum, { shape }) => sum + linesOf(shape), 0);
      this.#textures.vt_films = device.texture('RGBA32F', FILM_WIDTH, lines);
    }
  }

  setContents(contents) {
    const { values, films = null, solution } = (this.contents = contents);
    this.#films = films && Object.fromEntries(Object.entries(films).map(([name, table]) => [name, decode(table)]));
    this.#placed = {};
    for (const [name, place] of Object.entries(this.shader.uniforms)) {
      if (name in values) this.#placed[place] = values[name];
    }
    const decoded = ([name, x]) => [name, decode(x).array];
    this.#solved = solution && Object.fromEntries(Object.entries(solution).map(decoded));
    this.#outdated = true;
    this.#drawn = null;
  }

  /** Takes the names of the parts of the object. */
  setNames(names) {
    this.#names = names;
    this.#drawn = null;
  }

  setLobe(lobe) {
    this.lobe = lobe;
    this.#drawn = null;
  }

  /** All that the code of the material reads; lobes are worked out anew where values have changed, maybe `coarse`. */
  uniforms(coarse = false) {
    const isWorkedOut = this.#bakes.some(Boolean);
    if (this.#outdated ? isWorkedOut || this.#solved : isWorkedOut && this.#coarse && !coarse) {
      this.device.fill(this.#textures.vt_baked, this.#texels(coarse));
      this.#coarse = coarse;
    }
    if (this.#films && this.#outdated) this.device.fill(this.#textures.vt_films, texelsOf(this.#films));
    this.#outdated = false;
    const parameters = Object.entries(this.#placed).map(([place, value]) => [`vt_parameters.${place}`, value]);
    const solved = Object.entries(this.#solved ?? {}).map(([name, value]) => [`vt_${name}`, value]);
    const values = Object.fromEntries([...parameters, ...solved]);
    return { ...values, ...this.#covering(), ...this.#textures, ...weightsOf(this.shader, (k) => this.lobe === null || this.lobe === k) };
  }

  /** What covers the parts of the object; all parts of the mixture have equal shares then, so that none has nothing. */
  #covering() {
    const { covers } = this.contents, found = coveringOf(this.#names, covers);
    if (!found.some(Boolean)) return { covers: found };
    const places = covers.map((_, k) => this.shader.uniforms[`part${k}_weight`]).filter(Boolean);
    return { covers: found, ...Object.fromEntries(places.map((place) => [`vt_parameters.${place}`, 1 / covers.length])) };
  }

  /** The lobes over direction of all parts, one below another. */
  #texels(coarse) {
    const { parts, texels: [height, width] } = this.shader;
    const each = parts.map((part, k) => {
      const bake = this.#bakes[k];
      if (!bake) return this.#solved?.[`${part.prefix}texels`] ?? [];
      const placed = within(this.#placed, part.place), films = this.#films && within(this.#films, part.prefix);
      return bake.draw(placed, coarse, films);
    });
    if (each.length === 1) return each[0];
    const all = new Float32Array(4 * height * width);
    each.forEach((texels, k) => {
      const { line, columns } = parts[k];
      for (let row = 0; 4 * row * columns < texels.length; row++)
        all.set(texels.subarray(4 * row * columns, 4 * (row + 1) * columns), 4 * (line + row) * width);
    });
    return all;
  }

  // The picture

  setSize(width, height) {
    const { device } = this;
    device.free(this.pass, this.preview, ...(this.#sums ?? []), ...(this.shades ?? []));
    this.pass = device.target(width, height, ['RGBA32F']);
    this.#sums = [0, 1].map(() => device.target(width, height, ['RGBA32F']));
    this.preview = device.target(width, height, ['RGBA16F']);
    this.shades = [0, 1].map(() => device.target(width, height, ['RGBA16F']));
    this.forget();
  }

  /** Keeps by how much paths make the preview darker, for the previews to come of the same view. */
  learn(normals) {
    const [before, shade] = this.shades;
    const uniforms = {
      sum: this.sum.textures[0],
      picture: this.preview.textures[0],
      shade: before.textures[0],
    };
    this.device.draw(this.#learning, { ...uniforms, seen_normal: normals }, shade);
    this.shades.reverse();
    this.#surrounded = false;
    this.#drawn = null;
  }

  /**
   * Draws the preview of the contents of a G-buffer; all around the object stays as it is until the view changes, and the
   * object while nothing of it does. A `block` of pixels, along both axes, is one.
   */
  drawPreview(gbuffer, uniforms, block) {
    const coarse = block > 1;
    if (this.#drawn === 'fine' || (this.#drawn && coarse)) return;
    this.#drawn = coarse ? 'coarse' : 'fine';
    const shade = this.shades[0].textures[0];
    if (!this.#surrounded) gbuffer.drawSurroundings({ ...uniforms, shade }, this.preview);
    this.#surrounded = true;
    gbuffer.drawObject(this.#lighting, { ...this.uniforms(coarse), ...uniforms, shade }, this.preview, block);
  }

  /** Waits for the first pixel of the object, where none was drawn by the same program. */
  warm(gbuffer, uniforms) {
    return gbuffer.warm(this.#lighting, { ...this.#textures, ...uniforms });
  }

  /** Compiles what traces paths of the material, where nothing has done so, and waits for their first pixel. */
  async warmPaths(uniforms) {
    const { device, shader } = this;
    const tracing = await device.program(tracer(shader));
    if (this.shader !== shader) return;
    this.#tracing = tracing;
    await device.warm(tracing, { ...this.#textures, ...uniforms }, 'RGBA32F');
  }

  /** Whether paths of the material can be traced; until `warmPaths` they cannot. */
  get traces() {
    return this.#tracing !== null;
  }

  forget() {
    this.samples = 0;
    this.#surrounded = false;
    this.#drawn = null;
    if (this.shades) this.device.clear(this.shades[0], 1);
  }

  /** Traces the next sample, or a `band` of its rows. */
  trace(uniforms, band) {
    const sample = { ...this.uniforms(), ...uniforms, ...sobol(this.samples), sample_number: this.samples };
    this.device.draw(this.#tracing, sample, this.pass, band && { rows: [band.first, band.end] });
  }

  /** Adds the sample that was traced to the light before. */
  add() {
    const [before, sum] = this.#sums;
    const uniforms = {
      before: before.textures[0],
      added: this.pass.textures[0],
      within: sobol(this.samples).within,
    };
    if (this.samples === 0) this.device.clear(before, 0);
    this.device.draw(this.#adding, uniforms, sum);
    this.#sums.reverse();
    this.samples++;
  }

  /** Light added up, and its weight in A. */
  get sum() {
    return this.#sums[0];
  }

  /** A target that is free until the next sample is added. */
  get spare() {
    return this.#sums[1];
  }
}
