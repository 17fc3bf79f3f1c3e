// Pictures of light from all around: read, made ready to be sampled, and blurred for the preview.

import { FloatType } from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';
import { HDRLoader } from 'three/addons/loaders/HDRLoader.js';

const WIDEST = 2048; // texels; wider pictures are made smaller
const BRIGHTEST = 6e4; // what a half float holds

/** A picture {width, height, data: linear RGB from the top} from the bytes of an .exr or .hdr file. */
export function readPicture(name, bytes) {
  const loader = /\.exr$/i.test(name) ? new EXRLoader() : /\.hdr$/i.test(name) ? new HDRLoader() : null;
  if (!loader) throw new Error(`${name}: an environment is a file .exr or .hdr`);
  let read;
  try {
    read = loader.setDataType(FloatType).parse(bytes);
  } catch (error) {
    throw new Error(`${name}: not a readable picture (${error.message ?? error})`, { cause: error });
  }
  const { width, height, data } = read;
  const channels = data.length / (width * height);
  const upwards = loader instanceof EXRLoader;
  const picture = new Float32Array(3 * width * height);
  for (let y = 0; y < height; y++) {
    const row = upwards ? height - 1 - y : y;
    for (let x = 0; x < width; x++) {
      for (let c = 0; c < 3; c++) {
        const value = data[channels * (row * width + x) + Math.min(c, channels - 1)];
        picture[3 * (y * width + x) + c] = Number.isFinite(value) ? Math.max(value, 0) : 0;
      }
    }
  }
  return { width, height, data: picture };
}

/**
 * What the shaders read of a picture: `light` (RGBA, width x height) with the density of cells in A; `steps`
 * (width + 1 x height - 1), the sums of densities along rows and, in the last column, over rows; `blurred`
 * (RGBA); and `irradiance`.
 */
export function prepare(picture) {
  const { width, height, data } = smaller(picture);
  const brightness = Float64Array.from({ length: width * height }, (_, i) => data[3 * i] + data[3 * i + 1] + data[3 * i + 2]);

  // Weigh the cells between four texels
  const rows = height - 1;
  const steps = new Float32Array((width + 1) * rows);
  const weights = new Float64Array(width * rows);
  const sums = new Float64Array(rows);
  let total = 0;
  for (let y = 0; y < rows; y++) {
    const sine = Math.sin((Math.PI * (y + 0.5)) / rows);
    for (let x = 0; x < width; x++) {
      const a = y * width + x, b = y * width + ((x + 1) % width);
      const corners = brightness[a] + brightness[b] + brightness[a + width] + brightness[b + width];
      sums[y] += weights[y * width + x] = (corners + 1e-6) * sine;
    }
    total += sums[y];
  }

  // Sum them up
  let rowsBefore = 0;
  for (let y = 0; y < rows; y++) {
    let before = 0;
    for (let x = 0; x < width; x++) steps[y * (width + 1) + x] = (before += weights[y * width + x]) / sums[y];
    steps[y * (width + 1) + width] = (rowsBefore += sums[y]) / total;
  }

  // Put the density beside the radiance
  const light = new Float32Array(4 * width * height);
  const blurred = new Float32Array(4 * width * height);
  for (let i = 0; i < width * height; i++) {
    for (let c = 0; c < 3; c++) {
      light[4 * i + c] = data[3 * i + c];
      blurred[4 * i + c] = Math.min(data[3 * i + c], BRIGHTEST);
    }
    light[4 * i + 3] = i < weights.length ? (weights[i] / total) * weights.length : 0;
  }
  return { width, height, light, steps, blurred, irradiance: irradiance(data, width, height) };
}

function smaller(picture) {
  const { width, height, data } = picture;
  if (width < 2 || height < 2) throw new Error(`the environment has ${width} x ${height} pixels: too few`);
  if (width <= WIDEST) return picture;
  const half = {
    width: width >> 1,
    height: height >> 1,
    data: new Float32Array(3 * (width >> 1) * (height >> 1)),
  };
  for (let y = 0; y < half.height; y++) {
    for (let x = 0; x < half.width; x++) {
      for (let c = 0; c < 3; c++) {
        const at = 3 * (2 * y * width + 2 * x) + c;
        const sum = data[at] + data[at + 3] + data[at + 3 * width] + data[at + 3 * width + 3];
        half.data[3 * (y * half.width + x) + c] = sum / 4;
      }
    }
  }
  return smaller(half);
}

/**
 * Irradiance over pi by direction, as nine colours: of 1, y, z, x, xy, yz, 3zz - 1, xz and xx - yy
 * (Ramamoorthi and Hanrahan 2001).
 */
function irradiance(data, width, height) {
  const sums = new Float64Array(27);
  const basis = new Float64Array(9);
  const azimuths = Array.from({ length: width }, (_, x) => (2 * Math.PI * (x + 1)) / width);
  const [sines, cosines] = [Math.sin, Math.cos].map((f) => Float64Array.from(azimuths, f));
  for (let y = 0; y < height - 1; y++) {
    // Between four texels lies a cell of a band around the axis
    const [above, below] = [y, y + 1].map((row) => (Math.PI * row) / (height - 1));
    const area = (2 * Math.PI * (Math.cos(above) - Math.cos(below))) / width, theta = (above + below) / 2;
    const sine = Math.sin(theta), cosine = Math.cos(theta);
    for (let x = 0; x < width; x++) {
      const a = 3 * (y * width + x), b = 3 * (y * width + ((x + 1) % width)), row = 3 * width;
      harmonics(sines[x] * sine, cosine, -cosines[x] * sine, basis);
      for (let c = 0; c < 3; c++) {
        const light = (area * (data[a + c] + data[b + c] + data[a + row + c] + data[b + row + c])) / 4;
        for (let k = 0; k < 9; k++) sums[3 * k + c] += light * basis[k];
      }
    }
  }
  // Convolve with the cosine, and scale each function as it is in the basis
  const squared = [0.282095, 0.488603, 0.488603, 0.488603, 1.092548, 1.092548, 0.315392, 1.092548, 0.546274];
  const cosine = [1, 2 / 3, 2 / 3, 2 / 3, 0.25, 0.25, 0.25, 0.25, 0.25];
  return Float32Array.from(
    sums,
    (sum, k) => sum * squared[Math.floor(k / 3)] ** 2 * cosine[Math.floor(k / 3)],
  );
}

function harmonics(x, y, z, out) {
  out[0] = 1;
  out[1] = y;
  out[2] = z;
  out[3] = x;
  out[4] = x * y;
  out[5] = y * z;
  out[6] = 3 * z * z - 1;
  out[7] = x * z;
  out[8] = x * x - y * y;
}
