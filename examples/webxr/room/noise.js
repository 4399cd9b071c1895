/** Deterministic noise, so that every run on every machine draws the same picture. */

/** Hash of a lattice point, 0..1. */
function lattice(x, y, seed) {
  let h = Math.imul(x, 374761393) ^ Math.imul(y, 668265263) ^ Math.imul(seed, 2246822519);
  h = Math.imul(h ^ (h >>> 13), 1274126177);
  return ((h ^ (h >>> 16)) >>> 0) / 4294967296;
}

/** Smooth value noise at (x, y), 0..1. */
export function noise(x, y, seed = 0) {
  const column = Math.floor(x);
  const row = Math.floor(y);
  const u = smooth(x - column);
  const v = smooth(y - row);
  const top = mix(lattice(column, row, seed), lattice(column + 1, row, seed), u);
  const bottom = mix(lattice(column, row + 1, seed), lattice(column + 1, row + 1, seed), u);
  return mix(top, bottom, v);
}

/** Sum of octaves of noise, each half as strong and twice as fine; 0..1. */
export function fractal(x, y, octaves, seed = 0) {
  let sum = 0;
  let weight = 0;
  for (let octave = 0; octave < octaves; octave++) {
    const scale = 2 ** octave;
    sum += noise(x * scale, y * scale, seed + octave) / scale;
    weight += 1 / scale;
  }
  return sum / weight;
}

/** Distances to the nearest and second nearest scattered point, and the nearest one's hash. */
export function cells(x, y, seed = 0) {
  let first = 9;
  let second = 9;
  let id = 0;
  for (let j = -1; j <= 1; j++) {
    for (let i = -1; i <= 1; i++) {
      const column = Math.floor(x) + i;
      const row = Math.floor(y) + j;
      const dx = column + lattice(column, row, seed) - x;
      const dy = row + lattice(column, row, seed + 1) - y;
      const distance = Math.hypot(dx, dy);
      if (distance < first) {
        second = first;
        first = distance;
        id = lattice(column, row, seed + 2);
      } else if (distance < second) {
        second = distance;
      }
    }
  }
  return {first, second, id};
}

export const mix = (a, b, t) => a + (b - a) * t;
export const clamp = (x, low = 0, high = 1) => Math.min(high, Math.max(low, x));
export const smooth = (t) => t * t * (3 - 2 * t);
export const step = (low, high, x) => smooth(clamp((x - low) / (high - low)));
export const blend = (a, b, t) => a.map((value, i) => mix(value, b[i], t));
