// Slices through the material of a slot: its lobes over the angle of incidence, and f cos over directions,
// read back.

const DEGREES = 90; // angles of incidence 0, 1, ... of the curves; one more column is for the one chosen
const STEP = 0.5; // degrees between directions of a polar slice, but for those close to a lobe's axis
const NEAR = [0, ...Array.from({ length: 48 }, (_, i) => 0.02 * 1.16 ** i)]; // degrees from an axis

export const radians = (angle) => (angle * Math.PI) / 180;
export const degrees = (angle) => (angle * 180) / Math.PI;

/**
 * Parts of the light of a stack, as `parts` of call("shader") have it, in the order of all answers: reflected lobes seen from above, then the remainder of a solved
 * material, what is transmitted, or the diffuse base; each `{kind, place, layers}`, and in the code its `energy`, and
 * the `lobe` that has its roughness, if any.
 */
export function partsOf({ shown, lobes, solved }) {
  return shown.map((place, k) => {
    const kind = place.startsWith('reflected') ? 'reflected' : place;
    const isLobe = kind === 'reflected' || (kind === 'transmitted' && !solved);
    const energy = solved ? `energies[${k}]` : `l.${kind === 'base' ? 'base_energy' : `${place}.energy`}`;
    return { kind, place, layers: lobes[k]?.layers ?? [], energy, lobe: isLobe ? `l.${place}` : null };
  });
}

/**
 * All slices for light from one direction: `angle` degrees from the normal, at an `azimuth` in degrees, from
 * above or `below`. They are drawn by the code that the picture is drawn with; `state` is that of the page whose
 * values are drawn. Of a mixture they are those of the stack that has a `number` among its stacks.
 */
export class Slices {
  slot;
  state;
  shader;
  angle;
  azimuth;
  below;
  parts;
  polar = null; // f cos in the plane of incidence, as drawnPolar has it
  #device;
  #values; // of the material
  #uniforms;
  #lobesProgram = null;
  #valuesProgram = null;
  #table = null; // lobes over the angle of incidence, as drawnTable has them
  #kept = new Map();

  constructor(slot, { angle, azimuth, below }, state, number) {
    this.slot = slot;
    this.state = state;
    this.shader = slot.shader;
    this.stack = slot.shader.parts[number];
    this.angle = angle;
    this.azimuth = azimuth;
    this.below = below && this.stack.transmitted;
    this.parts = partsOf(this.stack);
    this.#device = slot.device;
    this.#values = slot.contents.values;
    const incidence = { vt_angle: angle, vt_azimuth: radians(azimuth), vt_side: this.below ? -1 : 1 };
    this.#uniforms = { ...slot.uniforms(), ...incidence, ...this.only(null) };
  }

  /** Waits for the programs, and for the data of most plots; a disc is drawn on demand. */
  async ready() {
    const texts = [lobesProgram(this.shader, this.stack, this.parts), valuesProgram(this.shader, this.stack)];
    const programs = await Promise.all(texts.map((text) => this.#device.program(text)));
    for (const program of programs) await this.#device.warm(program, this.#known, 'RGBA32F');
    [this.#lobesProgram, this.#valuesProgram] = programs;
    [this.#table, this.polar] = await Promise.all([this.drawnTable(), this.drawnPolar()]);
    return this;
  }

  /** Weights that leave one part alone, or all for null. */
  only(part) {
    return { [`vt_${this.stack.prefix}shown`]: this.parts.map((_, k) => (part === null || part === k ? 1 : 0)) };
  }

  /**
   * Over `angles` of incidence, for each part the `energy`, colours, and where it has any, `alpha`, u and v.
   */
  curves() {
    return {
      angles: Array.from({ length: DEGREES }, (_, i) => i),
      parts: this.#table.map((part) => sliced(part, 0, -1)),
    };
  }

  /** For the angle that is chosen, of each part the same and its `rotation` in radians. */
  chosen() {
    return this.#table.map((part) => {
      const { energy, alpha, rotation } = sliced(part, -1);
      return { energy: energy[0], alpha: alpha?.map(([value]) => value), rotation: rotation?.[0] };
    });
  }

  /** The value made earlier under this key, or made now. */
  once(key, make) {
    if (!this.#kept.has(key)) this.#kept.set(key, make());
    return this.#kept.get(key);
  }

  async drawnTable() {
    const width = DEGREES + 1;
    const pixels = await this.drawn(this.#lobesProgram, width, 2 * this.parts.length, [{}]);
    const at = (x, y, channel) => pixels[4 * (y * width + x) + channel];
    const row = (value) => Array.from({ length: width }, (_, x) => value(x));
    return this.parts.map(({ lobe }, k) => ({
      energy: row((x) => [0, 1, 2].map((channel) => at(x, 2 * k, channel))),
      ...(lobe && {
        alpha: [0, 1].map((axis) => row((x) => at(x, 2 * k + 1, axis))),
        rotation: row((x) => at(x, 2 * k + 1, 2)),
      }),
    }));
  }

  /**
   * f cos in the plane of incidence: over `angles` in degrees from the normal on the side of the light,
   * positive towards the mirror direction and up to 180 all around, for `all` parts together and for each of
   * `parts`, colours.
   */
  async drawnPolar() {
    const { angles } = this.directions();
    const rows = [null, ...this.parts.keys()].map((part) => ({ vt_disc: 0, ...this.only(part) }));
    const pixels = await this.drawn(this.#valuesProgram, angles.length, rows.length, rows);
    const length = 4 * angles.length;
    const [all, ...parts] = rows.map((_, k) => colours(pixels.subarray(k * length, (k + 1) * length)));
    return { angles, all, parts };
  }

  /** The angles of a polar slice, and the texture that the device reads them from. */
  directions() {
    return this.once('directions', () => {
      const angles = this.spread();
      return {
        angles,
        texture: this.#device.texture('R32F', angles.length, 1, Float32Array.from(angles, radians)),
      };
    });
  }

  spread() {
    const whole = this.stack.transmitted ? 180 : 90;
    const even = Array.from({ length: (2 * whole) / STEP + 1 }, (_, i) => i * STEP - whole);
    const { angle } = this;
    const axes = this.refracted === null ? [angle] : [angle, 180 - this.refracted];
    const close = axes.flatMap((axis) => NEAR.flatMap((offset) => [axis - offset, axis + offset]));
    return [...even, ...close.filter((direction) => Math.abs(direction) <= whole)].sort((a, b) => a - b);
  }

  /** Degrees between the normal and refracted light beyond the stack; null where there is none. */
  get refracted() {
    if (!this.stack.transmitted) return null;
    const ratio = this.relativeIndex();
    const sine = Math.sin(radians(this.angle)) / (this.below ? 1 / ratio : ratio);
    return sine < 1 ? degrees(Math.asin(sine)) : null;
  }

  /** Of the medium below over that above, one for all colours. */
  relativeIndex() {
    const { thin, lobes, prefix } = this.stack;
    if (thin) return 1;
    const last = lobes.flatMap(({ layers }) => layers).reduce((a, b) => Math.max(a, b), 0);
    const index = [this.#values[`${prefix}layer${last}_eta`]].flat();
    return index.reduce((sum, value) => sum + value, 0) / index.length / this.#values[`${prefix}exterior`];
  }

  /**
   * f cos over a projected disc of `size` pixels, RGBA from the lower row on: reflected or not, of one part
   * or all.
   */
  disc(size, reflected, part = null) {
    const uniforms = { vt_disc: reflected ? 1 : -1, vt_size: size, ...this.only(part) };
    return this.once(`disc ${size} ${reflected} ${part}`, () => {
      const target = this.target(this.#valuesProgram, size, size, [uniforms]);
      const pixels = this.#device.read(target);
      this.#device.free(target);
      return pixels;
    });
  }

  get #known() {
    return { ...this.#uniforms, vt_directions: this.directions().texture };
  }

  /** As many bands of rows as there are uniforms. */
  async drawn(program, width, height, bands) {
    const target = this.target(program, width, height, bands);
    const pixels = await this.#device.readLater(target);
    this.#device.free(target);
    return pixels;
  }

  target(program, width, height, bands) {
    const target = this.#device.target(width, height, ['RGBA32F']), rows = height / bands.length;
    bands.forEach((uniforms, k) =>
      this.#device.draw(program, { ...this.#known, ...uniforms }, target, { rows: [k * rows, (k + 1) * rows] }),
    );
    return target;
  }

  dispose() {
    this.#device.free(this.#kept.get('directions')?.texture);
  }
}

const sliced = ({ energy, alpha, rotation }, ...range) => ({
  energy: energy.slice(...range),
  alpha: alpha?.map((axis) => axis.slice(...range)),
  rotation: rotation?.slice(...range),
});

const colours = (pixels) =>
  Array.from({ length: pixels.length / 4 }, (_, i) => [pixels[4 * i], pixels[4 * i + 1], pixels[4 * i + 2]]);

// Code ------------------------------------------------------------------------------------------------

/** The name of a struct of a stack: in a mixture it has that of the part. */
const struct = (name, prefix) =>
  `Vt${prefix.split('_').map((word) => word.charAt(0).toUpperCase() + word.slice(1)).join('')}${name.slice(2)}`;

/** The values of a stack, `m`. */
const material = (prefix, place) => `${struct('VtMaterial', prefix)} m = vt_material(vec2(0.5))${`.${place}`.slice(0, -1)};`;

/** Two rows for each part, energies and roughnesses; a column for each angle of incidence. */
const lobesProgram = ({ text }, { prefix, place, solved, shown }, parts) => `#version 300 es
${text}
uniform float vt_angle, vt_azimuth, vt_side;
out vec4 vt_result;

void main() {
    int column = int(gl_FragCoord.x);
    float angle = radians(column < ${DEGREES} ? float(column) : vt_angle);
    vec3 wi = vec3(sin(angle) * vec2(cos(vt_azimuth), sin(vt_azimuth)), vt_side * cos(angle));
    ${material(prefix, place)}
    ${struct('VtLobes', prefix)} l = vt_${prefix}lobes(m, wi);
    ${solved ? `vec3 energies[${shown.length}] = vt_${prefix}energies(m, wi).parts;` : ''}
    switch (int(gl_FragCoord.y)) {
${parts.map(cases).join('\n')}
    }
}
`;

function cases({ energy, lobe }, k) {
  const rest = lobe ? `${lobe}.alpha_u, ${lobe}.alpha_v, ${lobe}.rotation, 0.0` : '0.0';
  return `\
        case ${2 * k}: vt_result = vec4(${energy}, 0.0); break;
        case ${2 * k + 1}: vt_result = vec4(${rest}); break;`;
}

/** f cos in the plane of incidence, or over one of the discs. */
const valuesProgram = ({ text }, { prefix, place }) => `#version 300 es
${text}
uniform highp sampler2D vt_directions;
uniform float vt_angle, vt_azimuth, vt_side, vt_size;
uniform int vt_disc; // 0: the plane of incidence; 1: what is reflected, -1: what is transmitted
out vec4 vt_result;

void main() {
    vec2 along = vec2(cos(vt_azimuth), sin(vt_azimuth));
    vec3 wi = vec3(sin(radians(vt_angle)) * along, vt_side * cos(radians(vt_angle))), wo;
    if (vt_disc == 0) {
        float turn = texelFetch(vt_directions, ivec2(gl_FragCoord.x, 0), 0).r;
        wo = vec3(-sin(turn) * along, vt_side * cos(turn));
    } else {
        vec2 place = 2.0 * gl_FragCoord.xy / vt_size - 1.0;
        float height = 1.0 - dot(place, place);
        if (height <= 0.0) { vt_result = vec4(0.0); return; }
        wo = vec3(place, vt_side * float(vt_disc) * sqrt(height));
    }
    ${material(prefix, place)}
    vt_result = vec4(vt_${prefix}eval(m, vt_${prefix}lobes(m, wi), wi, wo), 1.0);
}
`;
