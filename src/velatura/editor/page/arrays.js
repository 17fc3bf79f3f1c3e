// Arrays of numbers as the server sends them.

const TYPES = {
  float32: Float32Array,
  float64: Float64Array,
  uint32: Uint32Array,
  int32: Int32Array,
  uint8: Uint8Array,
};

/**
 * An array from {dtype, shape, data in base64}, flat; its shape beside it.
 * @returns {{array: ArrayBufferView, shape: number[]}}
 */
export function decode({ dtype, shape, data }) {
  const type = TYPES[dtype];
  if (!type) throw new Error(`an array of ${dtype}, which is none of ${Object.keys(TYPES).join(', ')}`);
  const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
  return { array: new type(bytes.buffer), shape };
}
