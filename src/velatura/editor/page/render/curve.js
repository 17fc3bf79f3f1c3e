// Curves of textures: values at equal steps of a texel from 0 to 1, joined by straight lines.

/** Texels of four bytes as values of a curve: colours decoded where they are stored as sRGB, opacity never. */
export function throughCurve(bytes, curve, encoding) {
  const plain = table(curve, (texel) => texel);
  const colour = encoding === 'srgb' ? table(curve, decoded) : plain;
  return Float32Array.from(bytes, (byte, k) => (k % 4 < 3 ? colour : plain)[byte]);
}

function table(curve, decode) {
  return Float32Array.from({ length: 256 }, (_, byte) => {
    const at = decode(byte / 255) * (curve.length - 1);
    const k = Math.min(Math.floor(at), curve.length - 2);
    return curve[k] + (at - k) * (curve[k + 1] - curve[k]);
  });
}

function decoded(texel) {
  return texel <= 0.04045 ? texel / 12.92 : ((texel + 0.055) / 1.055) ** 2.4;
}
