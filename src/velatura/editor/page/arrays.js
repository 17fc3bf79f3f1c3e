// Arrays of numbers as the server sends and takes them.

const TYPES = {
  float32: Float32Array,
  float64: Float64Array,
  uint32: Uint32Array,
  int32: Int32Array,
  int16: Int16Array,
  uint8: Uint8Array,
};

const UNSIGNED = { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array }; // by the bytes of a number

/**
 * An array from {dtype, shape, data in base64}, flat, or as it is from {array, shape}; its shape beside it. `planes` in the place of
 * the data have the bytes of the same place of all numbers one after another, from the last place; the lowest that are left out are
 * 0. Each number is the difference from the one a `step` before, unless this is 0.
 * @returns {{array: ArrayBufferView, shape: number[]}}
 */
export function decode({ dtype, shape, data, planes, step = 0, array = null }) {
  if (array) return { array, shape };
  const type = TYPES[dtype];
  if (!type) throw new Error(`an array of ${dtype}, which is none of ${Object.keys(TYPES).join(', ')}`);
  if (planes === undefined) return { array: new type(bytesOf(data).buffer), shape };
  return { array: interleaved(planes, step, new type(shape.reduce((all, length) => all * length, 1))), shape };
}

/** Fills an array of numbers from the planes of their bytes, and adds up differences. */
function interleaved(planes, step, array) {
  const { length, BYTES_PER_ELEMENT: size } = array, bytes = new Uint8Array(array.buffer);
  const first = size - planes.length / Math.max(length, 1);
  for (let place = first; place < size; place++)
    for (let k = 0, from = (place - first) * length; k < length; k++) bytes[size * k + place] = planes[from + k];
  if (!step) return array;
  const numbers = new UNSIGNED[size](array.buffer);
  for (let k = step; k < length; k++) numbers[k] += numbers[k - step];
  return array;
}

/** Of base64; older browsers have no function for it. */
function bytesOf(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

/** The bytes of a file, or of arrays in a Blob, in base64. */
export async function base64(blob) {
  const bytes = new Uint8Array(await blob.arrayBuffer());
  if (bytes.toBase64) return bytes.toBase64();
  let text = '';
  for (let at = 0; at < bytes.length; at += 4096)
    text += String.fromCharCode(...bytes.subarray(at, at + 4096));
  return btoa(text);
}

/** A picture {width, height, data} as Python takes it. */
export const sent = async ({ width, height, data }) => ({ width, height, data: await base64(new Blob([data])) });
