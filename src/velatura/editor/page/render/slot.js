// A material on the stage: its programs, its parameters, its lobes, and the light that was added up.

import { bake, probe } from './glsl/bake.glsl.js';
import { preview } from './glsl/preview.glsl.js';
import { tracer } from './glsl/tracer.glsl.js';
import { sobol } from './sobol.js';

const SHOWN = 8; // lobes that may be shown alone

export class Slot {
  /** `load` gives what a shader names: tables(key) -> texture, image(name, encoding) -> texture. */
  constructor(device, load) {
    Object.assign(this, { device, load, shader: null, lobe: null, samples: 0 });
  }

  /** Takes a material; compiles where its code is new. The one before stays until all is ready. */
  async setMaterial(shader, values) {
    const { device } = this;
    if (this.shader?.key !== shader.key) {
      const asked = (this.asked = shader);
      const [traced, previewed, baking, tables, ...maps] = await Promise.all([
        device.program(tracer(shader)),
        device.program(preview(shader)),
        shader.baking && device.program(bake(shader.baking, this.texelsAtOnce(shader))),
        shader.tables && this.load.tables(shader.tables),
        ...(shader.maps ?? []).map(({ texture, encoding }) => this.load.image(texture, encoding)),
      ]);
      if (this.asked !== asked) return;
      Object.assign(this, { shader, traced, previewed, baking, textures: { vt_tables: tables } });
      shader.maps?.forEach(({ sampler }, i) => (this.textures[sampler] = maps[i]));
      this.setBaked();
    }
    this.setValues(values);
  }

  /**
   * How many texels of a node are drawn at once: what the device can, or fewer, so that all draws are alike.
   */
  texelsAtOnce({ baking }) {
    const { gl } = this.device;
    const { texels } = sizeOf(baking);
    return Math.ceil(texels / Math.ceil(texels / gl.getParameter(gl.MAX_DRAW_BUFFERS)));
  }

  setBaked() {
    const { device, shader } = this;
    device.free(this.nodes, this.baked);
    this.nodes = this.baked = null;
    if (!shader.baking) return;
    const { width, height, texels } = sizeOf(shader.baking);
    this.baked = device.texture('RGBA32F', width, height);
    this.nodes = device.target(width, height / texels, Array(this.texelsAtOnce(shader)).fill('RGBA32F'));
    this.textures.vt_baked = this.baked;
  }

  /** Draws the lobes of all nodes, and puts them into the texture: block above block. */
  bake() {
    const { device, nodes, baked } = this;
    for (let first = 0; first * nodes.height < baked.height; first += nodes.textures.length) {
      device.draw(this.baking, { ...this.parameters, vt_tables: this.textures.vt_tables, first }, nodes);
      nodes.textures.forEach((_, k) => device.copy(nodes, k, baked, (first + k) * nodes.height));
    }
  }

  setValues(values) {
    this.values = values;
    this.parameters = {};
    for (const [name, place] of Object.entries(this.shader.uniforms)) {
      if (name in values) this.parameters[`vt_parameters.${place}`] = values[name];
    }
    this.outdated = true;
  }

  setLobe(lobe) {
    this.lobe = lobe;
  }

  /** All that the code of the material reads; lobes are drawn anew where values have changed. */
  uniforms() {
    if (this.outdated && this.baked) this.bake();
    this.outdated = false;
    const shown = Array.from({ length: SHOWN }, (_, k) => (this.lobe === null || this.lobe === k ? 1 : 0));
    return { ...this.parameters, ...this.textures, vt_shown: shown };
  }

  /** The lobes at cosines and azimuths, up to 64 each, seen from above: read back from the device. */
  async lobes(cosines, azimuths) {
    const { device, shader } = this;
    const places = shader.shown;
    const program = await device.program(probe(shader, places));
    const target = device.target(cosines.length, 2 * places.length * azimuths.length, ['RGBA32F']);
    device.draw(program, { ...this.uniforms(), cosines, azimuths }, target);
    const pixels = device.read(target);
    device.free(target);
    return places.map((place, k) =>
      gathered(place, pixels, k, places.length, cosines.length, azimuths.length),
    );
  }

  // The picture

  setSize(width, height) {
    const { device } = this;
    device.free(this.pass, this.preview, ...(this.sums ?? []), ...(this.shades ?? []));
    this.pass = device.target(width, height, ['RGBA32F']);
    this.sums = [0, 1].map(() => device.target(width, height, ['RGBA32F']));
    this.preview = device.target(width, height, ['RGBA16F']);
    this.shades = [0, 1].map(() => device.target(width, height, ['RGBA16F']));
    this.forget();
  }

  /** Keeps by how much paths make the preview darker, for the previews to come of the same view. */
  learn(learning, seen) {
    const [before, shade] = this.shades;
    const uniforms = {
      sum: this.sum.textures[0],
      picture: this.preview.textures[0],
      shade: before.textures[0],
    };
    this.device.draw(learning, { ...uniforms, seen_normal: seen }, shade);
    this.shades.reverse();
    this.surrounded = false;
  }

  /** Draws the preview of a `view`; all around the object stays as it is until the view changes. */
  drawPreview(view, uniforms, quick) {
    const shade = this.shades[0].textures[0];
    if (!this.surrounded) view.drawSurroundings({ ...uniforms, shade }, this.preview);
    this.surrounded = true;
    view.drawObject(this.previewed, { ...this.uniforms(), ...uniforms, shade }, this.preview, quick);
  }

  forget() {
    this.samples = 0;
    this.surrounded = false;
    this.clear(this.shades[0], 1);
  }

  /** Adds the pass that was drawn to the light before. */
  add(adding) {
    const [before, sum] = this.sums;
    const uniforms = {
      before: before.textures[0],
      added: this.pass.textures[0],
      within: sobol(this.samples).within,
    };
    if (this.samples === 0) this.clear(before, 0);
    this.device.draw(adding, uniforms, sum);
    this.sums.reverse();
    this.samples++;
  }

  clear(target, value) {
    const { gl } = this.device;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.handle);
    gl.clearBufferfv(gl.COLOR, 0, Array(4).fill(value));
  }

  /** Light added up, and its weight in A. */
  get sum() {
    return this.sums[0];
  }
}

/** Of the texture of a baking, and how many texels a node has. */
function sizeOf(baking) {
  const [width, height, texels] = baking
    .match(/VT_BAKED = ivec2\((\d+), (\d+)\);\nconst int VT_TEXELS = (\d+)/)
    .slice(1)
    .map(Number);
  return { width, height, texels };
}

function gathered(place, pixels, k, lobes, cosines, azimuths) {
  const count = cosines * azimuths;
  const lobe = {
    place,
    energy: new Float32Array(3 * count),
    alpha_u: new Float32Array(count),
    alpha_v: new Float32Array(count),
    rotation: new Float32Array(count),
  };
  for (let i = 0; i < count; i++) {
    const row = 2 * (Math.floor(i / cosines) * lobes + k);
    const at = 4 * (row * cosines + (i % cosines));
    const next = at + 4 * cosines;
    lobe.energy.set(pixels.subarray(at, at + 3), 3 * i);
    lobe.alpha_u[i] = pixels[at + 3];
    lobe.alpha_v[i] = pixels[next];
    lobe.rotation[i] = pixels[next + 1];
  }
  return lobe;
}
