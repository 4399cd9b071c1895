/** Procedural surfaces of the objects on the table: colour, height and roughness as functions of (u, v). */
import * as THREE from 'three';
import {blend, clamp, fractal, mix, noise, step} from './room/noise.js';

const SIDE = 512; // px

/**
 * Sawn or turned timber with grain along u: winding bands of early and late wood, fibres, pores.
 * `rings` is the number of bands over the width, `planks` the number of boards.
 */
export function timber({light, dark, rings = 12, planks = 1, pores = 0.35, seed = 1}) {
  return sampled((u, v) => {
    const plank = Math.floor(v * planks);
    const across = v * planks - plank;
    const shift = plank * 5.7 + seed;
    const wander = fractal(u * 1.3 + shift, across * 1.4 + shift, 3, seed) * 2.2;
    const ring = (across * rings) / planks + wander + noise(u * 5, across * 24 + shift, seed + 1) * 0.15;
    const late = step(0.45, 0.92, ring - Math.floor(ring)) * step(1, 0.95, ring - Math.floor(ring));
    const fibre = fractal(u * 9 + shift, v * 150, 3, seed + 2);
    const pore = step(0.66, 0.84, noise(u * 26 + shift, v * 230, seed + 3)) * pores;
    const cloud = fractal(u * 2.4 + shift, v * 3 + shift, 3, seed + 4);
    const board = noise(plank * 3.1, seed, 3) - 0.5;
    const seam = planks > 1 ? step(0.014, 0.004, Math.min(across, 1 - across)) : 0;
    const tone = clamp(0.18 + late * 0.42 + (fibre - 0.5) * 0.75 + (cloud - 0.5) * 0.5 + board * 0.35);
    const color = blend(blend(light, dark, tone), dark.map((part) => part * 0.35), clamp(pore * 0.6 + seam));
    const height = 0.6 - pore * 0.5 - seam * 0.6 + (fibre - 0.5) * 0.4 - late * 0.1;
    return {color, height, roughness: mix(0.42, 0.66, fibre) + pore * 0.2};
  });
}

/** A woven check of fuzzy yarn: `threads` over the width, every `check` of them in the second colour. */
export function woven({ground, stripe, threads = 48, check = 8, fuzz = 0.3, seed = 2}) {
  return sampled((u, v) => {
    const x = u * threads + (fractal(u * 11, v * 11, 2, seed) - 0.5) * 0.8;
    const y = v * threads + (fractal(u * 11 + 5, v * 11, 2, seed) - 0.5) * 0.8;
    const [column, row] = [Math.floor(x), Math.floor(y)];
    const over = (column + row) % 2 === 0;
    const along = over ? y - row : x - column;
    const side = over ? x - column : y - row;
    const bulge = Math.sin(Math.PI * side) * (0.5 + 0.5 * Math.sin(Math.PI * along));
    const number = over ? column : row;
    const thread = Math.floor(number / check) % 2 ? stripe : ground;
    const yarn = noise(number * 3.7, (over ? y : x) * 0.5, seed + 3) - 0.5;
    const lint = (fractal(u * 170, v * 170, 2, seed + 6) - 0.5) * fuzz;
    const wear = (fractal(u * 3, v * 3, 3, seed + 7) - 0.5) * 0.25;
    const shade = 0.52 + 0.5 * bulge + yarn * 0.3 + lint + wear;
    return {color: thread.map((part) => clamp(part * shade)), height: bulge + lint, roughness: 1};
  });
}

/** Metal with fine scratches along u; `grain` is their depth, `gloss` the smoothness between them. */
export function ground({color, grain = 0.25, gloss = 0.16, seed = 3}) {
  return sampled((u, v) => {
    const streak = fractal(u * 2.5, v * 190, 3, seed);
    const smudge = fractal(u * 4, v * 4, 3, seed + 5);
    const shade = 1 + (streak - 0.5) * grain - smudge * 0.08;
    return {
      color: color.map((part) => clamp(part * shade)),
      height: streak,
      roughness: gloss + streak * grain * 0.5 + smudge * 0.12,
    };
  });
}

/** Samples `shade(u, v)` into the maps of a standard material: height in red, roughness in green. */
function sampled(shade) {
  const [color, relief] = [new ImageData(SIDE, SIDE), new ImageData(SIDE, SIDE)];
  for (let y = 0; y < SIDE; y++) {
    for (let x = 0; x < SIDE; x++) {
      const point = shade(x / SIDE, 1 - y / SIDE);
      const at = (y * SIDE + x) * 4;
      for (let i = 0; i < 3; i++) color.data[at + i] = point.color[i] * 255;
      relief.data[at] = point.height * 255;
      relief.data[at + 1] = point.roughness * 255;
      color.data[at + 3] = relief.data[at + 3] = 255;
    }
  }
  const reliefMap = texture(relief, THREE.NoColorSpace);
  return {map: texture(color, THREE.SRGBColorSpace), bumpMap: reliefMap, roughnessMap: reliefMap};
}

function texture(image, colorSpace) {
  const canvas = new OffscreenCanvas(SIDE, SIDE);
  canvas.getContext('2d').putImageData(image, 0, 0);
  const map = new THREE.CanvasTexture(canvas);
  map.wrapS = map.wrapT = THREE.RepeatWrapping;
  map.colorSpace = colorSpace;
  return map;
}
