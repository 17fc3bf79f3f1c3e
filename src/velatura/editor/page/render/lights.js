// Lights of one's own: round ones, far away, added to the picture of the light from all around.

const FINEST = 512; // texels of the width that a picture has at least, so that a light is round

/**
 * A picture {width, height, data: linear RGB from the top} with `lights`: {azimuth, elevation, size: their diameter, all in
 * degrees, strength: their radiance, colour}. The azimuth is that of the camera's side at 0, and to its right at 90.
 */
export function withLights(picture, lights) {
  if (!lights.length) return picture;
  const { width, height, data } = picture.width < FINEST ? resampled(picture, FINEST, FINEST / 2) : { ...picture, data: picture.data.slice() };
  const soft = Math.PI / (height - 1); // the edge, a texel wide
  for (const { azimuth, elevation, size, strength, colour } of lights) {
    const towards = direction(radians(azimuth), radians(elevation)), radius = radians(size) / 2;
    for (let y = 0; y < height; y++) {
      const theta = (Math.PI * y) / (height - 1);
      if (Math.abs(Math.PI / 2 - theta - radians(elevation)) > radius + soft) continue;
      for (let x = 0; x < width; x++) {
        const phi = (2 * Math.PI * (x + 0.5)) / width;
        const texel = direction(Math.PI - phi, Math.PI / 2 - theta);
        const cosine = texel[0] * towards[0] + texel[1] * towards[1] + texel[2] * towards[2];
        const covered = Math.min(Math.max((radius - Math.acos(Math.min(cosine, 1))) / soft + 0.5, 0), 1);
        for (let c = 0; c < 3; c++) data[3 * (y * width + x) + c] += covered * strength * colour[c];
      }
    }
  }
  return { width, height, data };
}

/**
 * Where a light is that is mirrored to the eye: its azimuth and elevation, where the light all around is turned by `rotation`
 * degrees; `ray` goes from the eye to a surface of a `normal`.
 */
export function mirrored({ normal, ray }, rotation) {
  const along = 2 * ray.reduce((sum, x, k) => sum + x * normal[k], 0), length = Math.hypot(...normal) ** 2;
  const [x, y, z] = ray.map((own, k) => own - (along / length) * normal[k]), turn = radians(rotation);
  const [across, ahead] = [Math.cos(turn) * x - Math.sin(turn) * z, Math.sin(turn) * x + Math.cos(turn) * z];
  const degrees = (angle) => Math.round((1800 * angle) / Math.PI) / 10;
  return { azimuth: degrees(Math.atan2(across, ahead)), elevation: degrees(Math.asin(Math.min(Math.max(y, -1), 1))) };
}

const radians = (degrees) => (degrees * Math.PI) / 180;

const direction = (azimuth, elevation) => [
  Math.cos(elevation) * Math.sin(azimuth),
  Math.sin(elevation),
  Math.cos(elevation) * Math.cos(azimuth),
];

/** A picture with more texels, between those that it has; columns lie between edges, rows from pole to pole. */
function resampled({ width, height, data }, columns, rows) {
  const found = new Float32Array(3 * columns * rows);
  for (let y = 0; y < rows; y++) {
    const along = (y * (height - 1)) / (rows - 1), above = Math.min(Math.floor(along), height - 2);
    for (let x = 0; x < columns; x++) {
      const across = ((x + 0.5) * width) / columns - 0.5 + width, left = Math.floor(across);
      for (let c = 0; c < 3; c++) {
        const at = (row, column) => data[3 * (row * width + (column % width)) + c];
        const between = (row) => at(row, left) + (across - left) * (at(row, left + 1) - at(row, left));
        found[3 * (y * columns + x) + c] = between(above) + (along - above) * (between(above + 1) - between(above));
      }
    }
  }
  return { width: columns, height: rows, data: found };
}
