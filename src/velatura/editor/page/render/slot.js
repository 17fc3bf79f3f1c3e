// A material on the stage: its programs, its parameters, its lobes, and the light that was added up.

import { Bake } from './bake.js';
import { preview } from './glsl/preview.glsl.js';
import { tracer } from './glsl/tracer.glsl.js';
import { sobol } from './sobol.js';

const SHOWN = 8; // lobes that may be shown alone

export class Slot {
  /**
   * `load` gives what a shader names: tables(key) -> texture, table(name) -> {array, shape},
   * image(name, encoding) -> texture.
   */
  constructor(device, load) {
    Object.assign(this, { device, load, shader: null, lobe: null, samples: 0 });
  }

  /** Takes a material; compiles where its code is new. The one before stays until all is ready. */
  async setMaterial(shader, values) {
    const { device } = this;
    if (this.shader?.key !== shader.key) {
      const asked = (this.asked = shader);
      const [traced, previewed, tables, looked, ...maps] = await Promise.all([
        device.program(tracer(shader)),
        device.program(preview(shader)),
        shader.tables && this.load.tables(shader.tables),
        Promise.all((shader.baked?.tables ?? []).map((name) => this.load.table(name))),
        ...(shader.maps ?? []).map(({ texture, encoding }) => this.load.image(texture, encoding)),
      ]);
      if (this.asked !== asked) return;
      device.free(this.textures?.vt_baked);
      Object.assign(this, { shader, traced, previewed, textures: { vt_tables: tables } });
      shader.maps?.forEach(({ sampler }, i) => (this.textures[sampler] = maps[i]));
      this.setBaked(Object.fromEntries((shader.baked?.tables ?? []).map((name, k) => [name, looked[k]])));
    }
    this.setValues(values);
  }

  setBaked(tables) {
    const { device, shader } = this;
    this.bake = shader.baked && new Bake(shader.baked, tables);
    if (this.bake) this.textures.vt_baked = device.texture('RGBA32F', this.bake.width, this.bake.height);
  }

  setValues(values) {
    this.values = values;
    this.placed = {};
    for (const [name, place] of Object.entries(this.shader.uniforms)) {
      if (name in values) this.placed[place] = values[name];
    }
    this.outdated = true;
  }

  setLobe(lobe) {
    this.lobe = lobe;
  }

  /** All that the code of the material reads; lobes are worked out anew where values have changed, maybe `quick`. */
  uniforms(quick = false) {
    if (this.bake && (this.outdated || (this.rough && !quick))) {
      this.device.fill(this.textures.vt_baked, this.bake.draw(this.placed, quick));
      this.rough = quick;
    }
    this.outdated = false;
    const shown = Array.from({ length: SHOWN }, (_, k) => (this.lobe === null || this.lobe === k ? 1 : 0));
    const parameters = Object.entries(this.placed).map(([place, value]) => [`vt_parameters.${place}`, value]);
    return { ...Object.fromEntries(parameters), ...this.textures, vt_shown: shown };
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
    if (this.outdated) view.warm(this.previewed, { ...this.textures, ...uniforms, shade });
    view.drawObject(this.previewed, { ...this.uniforms(quick), ...uniforms, shade }, this.preview, quick);
  }

  forget() {
    this.samples = 0;
    this.surrounded = false;
    this.device.clear(this.shades[0], 1);
  }

  /** Adds the pass that was drawn to the light before. */
  add(adding) {
    const [before, sum] = this.sums;
    const uniforms = {
      before: before.textures[0],
      added: this.pass.textures[0],
      within: sobol(this.samples).within,
    };
    if (this.samples === 0) this.device.clear(before, 0);
    this.device.draw(adding, uniforms, sum);
    this.sums.reverse();
    this.samples++;
  }

  /** Light added up, and its weight in A. */
  get sum() {
    return this.sums[0];
  }
}
