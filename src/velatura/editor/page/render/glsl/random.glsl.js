// Numbers between 0 and 1: Sobol points, scrambled for every pixel and dimension (Owen 1995, by a hash:
// Burley 2020).

import { DIMENSIONS } from '../sobol.js';

export const random = /* glsl */ `
uniform uint sobol[${DIMENSIONS}]; // coordinates, the last of their bits first
uniform uint sample_number;
uint pixel_seed;

uint random_hash(uint x) {
  x = (x ^ (x >> 16)) * 0x21f0aaadu;
  x = (x ^ (x >> 15)) * 0xd35a2d97u;
  return x ^ (x >> 15);
}

uint reversed(uint x) {
  x = ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x00ff00ffu) << 8) | ((x >> 8) & 0x00ff00ffu);
  return (x << 16) | (x >> 16);
}

uint scrambled(uint x, uint seed) {
  x += seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  return x ^ (x * 0x8d22f6e6u);
}

void random_start(ivec2 pixel) {
  pixel_seed = random_hash(uint(pixel.x) + random_hash(uint(pixel.y) + 1u));
}

float random_number(int dimension) {
  uint seed = random_hash(pixel_seed + uint(dimension) * 0x9e3779b9u), bits;
  if (dimension < ${DIMENSIONS}) bits = reversed(scrambled(sobol[dimension], seed));
  else bits = random_hash(seed ^ random_hash(sample_number));
  return (float(bits >> 9) + 0.5) / 8388608.0;
}

vec2 random_pair(int dimension) {
  return vec2(random_number(dimension), random_number(dimension + 1));
}
`;
