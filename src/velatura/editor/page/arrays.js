// Arrays of numbers as the server sends and takes them.

const TYPES = {
  float32: Float32Array,
  float64: Float64Array,
  uint32: Uint32Array,
  int32: Int32Array,
  uint8: Uint8Array,
};

/**
 * An array from {dtype, shape, data in base64}, flat, or as it is from {array, shape}; its shape beside it.
 * @returns {{array: ArrayBufferView, shape: number[]}}
 */
export function decode({ dtype, shape, data, array = null }) {
  if (array) return { array, shape };
  const type = TYPES[dtype];
  if (!type) throw new Error(`an array of ${dtype}, which is none of ${Object.keys(TYPES).join(', ')}`);
  return { array: new type(bytesOf(data).buffer), shape };
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
