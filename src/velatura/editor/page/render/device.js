// WebGL 2 in few words: textures, targets, programs that compile beside the page's work, and waiting.

import { Recent } from '../recent.js';
import { throughCurve } from './curve.js';

const MOST = 64; // programs that are kept; those in use stay whether they are or not

const VERTEX = `#version 300 es
void main() {
  gl_Position = vec4(4.0 * vec2(gl_VertexID & 1, gl_VertexID >> 1) - 1.0, 0.0, 1.0);
}`;

export class Device {
  gl;
  soft; // the format of pictures between whose texels the device interpolates: the quickest that it can
  parallel; // the extension by which programs compile beside other work, if any
  empty; // array of vertices
  programs; // promises of them, by their text
  warming = 0; // how many draw for the first time, or are about to
  shown = Promise.resolve(); // when the canvas is on the page as it was drawn last

  /** Throws Error if the browser lacks a required feature. */
  constructor(canvas) {
    const options = { antialias: false, alpha: false, powerPreference: 'high-performance' };
    const gl = canvas.getContext('webgl2', options);
    if (!gl) throw new Error('this browser shows no WebGL 2, in which the pictures are made');
    if (!gl.getExtension('EXT_color_buffer_float')) {
      throw new Error('the graphics device cannot draw to pictures of floats, in which light is added up');
    }
    this.gl = gl;
    this.restore();
  }

  /** Everything anew in a context that was lost. */
  restore() {
    const { gl } = this;
    gl.getExtension('EXT_color_buffer_float');
    this.soft = gl.getExtension('OES_texture_float_linear') ? 'RGBA32F' : 'RGBA16F';
    this.parallel = gl.getExtension('KHR_parallel_shader_compile');
    this.empty = gl.createVertexArray();
    this.programs = new Recent(MOST);
  }

  // Pictures

  /** A texture; `format` is the name of an internal one, `options` may set filter, wrap, and mipmaps. */
  texture(format, width, height, data = null, options = {}) {
    const { gl } = this;
    const { filter = 'NEAREST', wrap = 'CLAMP_TO_EDGE', mipmaps = false } = options;
    const [layout, type] = FORMATS[format];
    const handle = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, handle);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl[format], width, height, 0, gl[layout], gl[type], data);
    this.filtered(filter, wrap, mipmaps);
    return { handle, width, height };
  }

  /** Other texels for a texture of four floats each. */
  fill({ handle, width, height }, data) {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, handle);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGBA, gl.FLOAT, data);
  }

  /** A texture of a decoded image, from its upper row on; its texels taken through a curve, if there is one. */
  image(bitmap, encoding, curve) {
    const { gl } = this;
    const { width, height } = bitmap;
    const handle = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, handle);
    const format = encoding === 'srgb' && !curve ? gl.SRGB8_ALPHA8 : gl.RGBA8;
    gl.texImage2D(gl.TEXTURE_2D, 0, format, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
    if (curve) {
      const values = throughCurve(this.#bytes(handle, width, height), curve, encoding);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, width, height, 0, gl.RGBA, gl.FLOAT, values);
    }
    this.filtered('LINEAR', 'REPEAT', false);
    return { handle, width, height };
  }

  /** The bytes of a texture that holds them, which a canvas would multiply by opacity. */
  #bytes(handle, width, height) {
    const { gl } = this;
    const buffer = gl.createFramebuffer();
    const found = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, handle, 0);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, found);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(buffer);
    return found;
  }

  filtered(filter, wrap, mipmaps) {
    const { gl } = this;
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl[filter]);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, mipmaps ? gl.LINEAR_MIPMAP_LINEAR : gl[filter]);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl[wrap]);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, mipmaps ? gl.CLAMP_TO_EDGE : gl[wrap]);
    if (mipmaps) gl.generateMipmap(gl.TEXTURE_2D);
  }

  /** A render target: one or more textures, with `options` as for these, and a depth buffer if `depth`. */
  target(width, height, formats, { depth = false, ...options } = {}) {
    const { gl } = this;
    const textures = formats.map((format) => this.texture(format, width, height, null, options));
    const handle = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, handle);
    textures.forEach((texture, i) => {
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, texture.handle, 0);
    });
    gl.drawBuffers(textures.map((_, i) => gl.COLOR_ATTACHMENT0 + i));
    const buffer = depth ? gl.createRenderbuffer() : null;
    if (depth) {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, buffer);
    }
    return { handle, textures, width, height, buffer };
  }

  free(...things) {
    const { gl } = this;
    for (const { handle, textures, buffer } of things.filter(Boolean)) {
      if (!textures) {
        gl.deleteTexture(handle);
        continue;
      }
      this.free(...textures);
      gl.deleteFramebuffer(handle);
      gl.deleteRenderbuffer(buffer);
    }
  }

  /** Makes all numbers of a target's first texture the same. */
  clear({ handle }, value) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, handle);
    gl.clearBufferfv(gl.COLOR, 0, Array(4).fill(value));
  }

  /** The pixels of a target, or of a `part` {x, y, width, height} of it, from its lower row on. */
  read({ handle, width: columns, height: rows }, { x, y, width, height } = { x: 0, y: 0, width: columns, height: rows }) {
    const { gl } = this;
    const pixels = new Float32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, handle);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(x, y, width, height, gl.RGBA, gl.FLOAT, pixels);
    return pixels;
  }

  /** A pixel of each texture of a target. */
  pixel({ handle, textures }, x, y) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, handle);
    return textures.map((_, i) => {
      const found = new Float32Array(4);
      gl.readBuffer(gl.COLOR_ATTACHMENT0 + i);
      gl.readPixels(x, y, 1, 1, gl.RGBA, gl.FLOAT, found);
      return [...found];
    });
  }

  /** The same, once the device has come to it; the page's work goes on meanwhile. */
  async readLater({ handle, width, height }) {
    const { gl } = this;
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, buffer);
    gl.bufferData(gl.PIXEL_PACK_BUFFER, 16 * width * height, gl.STREAM_READ);
    gl.bindFramebuffer(gl.FRAMEBUFFER, handle);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, 0);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    await this.done();
    const pixels = new Float32Array(4 * width * height);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, buffer);
    gl.getBufferSubData(gl.PIXEL_PACK_BUFFER, 0, pixels);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    gl.deleteBuffer(buffer);
    return pixels;
  }

  // Programs

  /** A program, compiled once; the page's work goes on meanwhile. Raises Error with the compiler's words. */
  program(fragment, vertex = VERTEX) {
    return this.programs.once(vertex + fragment, () => this.compile(fragment, vertex));
  }

  async compile(fragment, vertex) {
    const { gl, parallel } = this;
    const handle = gl.createProgram();
    const shaders = [
      [gl.VERTEX_SHADER, vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ].map(([kind, text]) => {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(handle, shader);
      return shader;
    });
    gl.linkProgram(handle);
    const compiled = () => !parallel || gl.getProgramParameter(handle, parallel.COMPLETION_STATUS_KHR);
    while (!gl.isContextLost() && !compiled()) {
      await new Promise((resolve) => setTimeout(resolve, 5));
    }
    if (!gl.getProgramParameter(handle, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = shaders.map((shader) => gl.getShaderInfoLog(shader)).join('');
      const words = logs || gl.getProgramInfoLog(handle);
      throw new Error(`the shader does not compile: ${words.trim().split('\n')[0]}`);
    }
    shaders.forEach((shader) => gl.deleteShader(shader));
    return { handle, places: new Map() };
  }

  /**
   * Draws a pixel of a format by a program, once, and waits until it is drawn: some devices compile only then, and the
   * page would stop for as long wherever it shows the canvas or asks the device for anything.
   */
  warm(program, uniforms, format) {
    return (program.warm ??= this.#drawFirst(program, uniforms, format));
  }

  async #drawFirst(program, uniforms, format) {
    this.warming++;
    await this.shown;
    const pixel = this.target(1, 1, [format]);
    this.draw(program, uniforms, pixel);
    this.free(pixel);
    await this.done();
    this.warming--;
  }

  /** Takes a program and its uniforms: numbers, arrays, textures; names that it does not have are ignored. */
  use(program, uniforms) {
    const { gl } = this;
    gl.useProgram(program.handle);
    let unit = 0;
    for (const [name, value] of Object.entries(uniforms)) {
      const place = this.place(program, name);
      if (!place) continue;
      if (value.handle) {
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, value.handle);
        gl.uniform1i(place.location, unit++);
      } else {
        SETTERS[place.type](gl, place.location, value);
      }
    }
  }

  place(program, name) {
    const { gl } = this;
    if (program.places.size === 0) {
      const count = gl.getProgramParameter(program.handle, gl.ACTIVE_UNIFORMS);
      for (let i = 0; i < count; i++) {
        const { name: full, type } = gl.getActiveUniform(program.handle, i);
        const location = gl.getUniformLocation(program.handle, full);
        program.places.set(full.replace(/\[0\]$/, ''), { location, type });
      }
    }
    return program.places.get(name);
  }

  /** Draws all pixels of a target (null: the canvas), or `rows` and `columns` from the first to below the second. */
  draw(program, uniforms, target, { rows, columns } = {}) {
    const { gl } = this;
    const width = target?.width ?? gl.drawingBufferWidth;
    const height = target?.height ?? gl.drawingBufferHeight;
    const [low, high] = rows ?? [0, height];
    const [left, right] = columns ?? [0, width];
    this.use(program, uniforms);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target?.handle ?? null);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(left, low, right - left, high - low);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
  }

  // Time

  /** Settles when the device has done all work it was given, and returns the time. */
  async done() {
    const { gl } = this;
    const sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    while (!gl.isContextLost() && gl.getSyncParameter(sync, gl.SYNC_STATUS) !== gl.SIGNALED) {
      await new Promise((resolve) => setTimeout(resolve, 1));
    }
    gl.deleteSync(sync);
    return performance.now();
  }
}

const FORMATS = {
  RGBA32F: ['RGBA', 'FLOAT'],
  RGBA16F: ['RGBA', 'FLOAT'],
  RG32F: ['RG', 'FLOAT'],
  RGBA32UI: ['RGBA_INTEGER', 'UNSIGNED_INT'],
  R32F: ['RED', 'FLOAT'],
};

const SETTERS = {
  0x1406: (gl, at, x) => (x.length ? gl.uniform1fv(at, x) : gl.uniform1f(at, x)),
  0x8b50: (gl, at, x) => gl.uniform2fv(at, x),
  0x8b51: (gl, at, x) => gl.uniform3fv(at, x.length ? x : [x, x, x]),
  0x8b5b: (gl, at, x) => gl.uniformMatrix3fv(at, false, x),
  0x8b5c: (gl, at, x) => gl.uniformMatrix4fv(at, false, x),
  0x1404: (gl, at, x) => gl.uniform1i(at, x),
  0x8b55: (gl, at, x) => gl.uniform4iv(at, x),
  0x1405: (gl, at, x) => (x.length ? gl.uniform1uiv(at, x) : gl.uniform1ui(at, x)),
  0x8b56: (gl, at, x) => gl.uniform1i(at, x),
};
