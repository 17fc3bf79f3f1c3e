// Data of the server and the folder for pictures: objects, environments, tables, textures.

import { decode } from '../arrays.js';
import { Recent } from '../recent.js';
import { readPicture } from './environment.js';

const MOST = 64; // tables and textures that are kept; those in use stay whether they are or not

export class Loader {
  #device;
  #call;
  #fetch;
  #files;
  #kept = new Recent(MOST);

  /** `files` is the address that textures lie under. */
  constructor(device, { call, fetch, files }) {
    this.#device = device;
    this.#call = call;
    this.#fetch = fetch;
    this.#files = files;
  }

  /** {parts, view} by a name that call("object") knows. */
  async object(name) {
    return objectOf(await this.#call('object', { name }));
  }

  /** A picture {width, height, data} by a name that call("environment") knows, or the address of an .exr or .hdr file. */
  async environment(name) {
    if (/\.(exr|hdr)$/i.test(name)) {
      const answer = await this.#fetch(name);
      if (!answer.ok) throw new Error(`${name}: not found`);
      return readPicture(name, await answer.arrayBuffer());
    }
    const { array, shape } = decode((await this.#call('environment', { name })).picture);
    return { width: shape[1], height: shape[0], data: array };
  }

  /** The texture of all tables that a shader reads, by its key. */
  tables(key) {
    return this.#kept.once(key, async () => {
      const { array, shape } = decode((await this.#call('tables', { key })).texture);
      return this.#device.texture('RGBA32F', shape[1], shape[0], array);
    });
  }

  /** One table {array, shape}. */
  table(name) {
    return this.#kept.once(`table ${name}`, async () => decode((await this.#call('table', { name })).table));
  }

  /** A texture of the folder. */
  image(name, encoding, curve) {
    return this.#kept.once(`${encoding} ${curve ?? ''} ${name}`, async () => {
      const answer = await this.#fetch(this.#files + encodeURIComponent(name));
      if (!answer.ok) throw new Error(`${name}: no such texture`);
      const bitmap = await createImageBitmap(await answer.blob(), {
        colorSpaceConversion: 'none',
        premultiplyAlpha: 'none',
      });
      return this.#device.image(bitmap, encoding, curve);
    });
  }
}

/** {parts, view} of an answer of call("object"). */
export function objectOf({ parts, view }) {
  const decoded = parts.map(({ role, ...arrays }) => ({
    role,
    ...Object.fromEntries(Object.entries(arrays).map(([key, value]) => [key, decode(value).array])),
  }));
  return { parts: decoded, view };
}
