/** Procedural surfaces: colour, height and roughness of each material as a function of (u, v). */
import * as THREE from 'three';
import {blend, cells, clamp, fractal, mix, noise, step} from './noise.js';

/** Oak or another timber in planks, grain along u. */
export function timber({light, dark, planks = 4, rings = 14, seed = 1}) {
  return surface(768, (u, v) => {
    const plank = Math.floor(v * planks);
    const across = v * planks - plank;
    const shift = plank * 7.3 + seed;
    const warp = fractal(u * 1.1 + shift, v * planks * 0.6 + shift, 2, seed);
    const ring = ((across * rings) / planks + warp * 5) % 1;
    const fibre = fractal(u * 7 + shift, v * 190, 2, seed + 5);
    const pore = step(0.72, 0.9, noise(u * 44 + shift, v * 380, seed + 9));
    const late = step(0.35, 0.95, ring) * (1 - step(0.95, 1, ring));
    const seam = planks > 1 ? step(0.018, 0.004, Math.min(across, 1 - across)) : 0;
    const tone = clamp(0.08 + late * 0.5 + (fibre - 0.5) * 0.5 + (noise(plank * 3.1, seed, 3) - 0.5) * 0.5);
    const color = blend(blend(light, dark, tone), [0.1, 0.05, 0.02], clamp(pore * 0.13 + seam * 0.8));
    const height = 0.6 - pore * 0.3 - seam * 0.6 + (fibre - 0.5) * 0.25;
    return {color, height, roughness: mix(0.5, 0.75, fibre) + seam * 0.2};
  });
}

/** Sheet metal brushed along u. */
export function brushed({color, seed = 3}) {
  return surface(512, (u, v) => {
    const streak = fractal(u * 3, v * 220, 3, seed);
    const scratch = step(0.86, 0.95, noise(u * 5, v * 300, seed + 4));
    const shade = 0.86 + (streak - 0.5) * 0.34;
    return {
      color: color.map((c) => clamp(c * shade)),
      height: streak + scratch * 0.3,
      roughness: 0.2 + streak * 0.26,
    };
  });
}

/** Beaten metal: shallow round dents. */
export function hammered({color, seed = 4}) {
  return surface(512, (u, v) => {
    const dent = cells(u * 30, v * 9, seed);
    const tarnish = fractal(u * 5, v * 5, 4, seed + 3);
    const shade = 1.05 - tarnish * 0.35;
    return {color: color.map((c) => clamp(c * shade)), height: dent.first, roughness: 0.14 + tarnish * 0.3};
  });
}

/** A leaf: midrib, side veins, darker margins. */
export function leaf({seed = 9} = {}) {
  return surface(256, (u, v) => {
    const off = Math.abs(u - 0.5);
    const vein = Math.abs(((v * 9 - off * 7) % 1 + 1) % 1 - 0.5);
    const rib = step(0.03, 0.012, off);
    const side = step(0.09, 0.02, vein) * 0.5;
    const base = blend([0.1, 0.3, 0.08], [0.28, 0.5, 0.14], fractal(u * 6, v * 6, 4, seed));
    const color = blend(base, [0.62, 0.76, 0.36], clamp(rib * 0.8 + side * 0.6));
    return {color, height: 1 - rib, roughness: 0.42};
  });
}

/**
 * Samples `shade(u, v)` into the three maps a standard material takes.
 *
 * Anisotropic filtering stays off: at 3 samples llvmpipe (Mesa 22.3) never returned from a draw.
 */
function surface(size, shade) {
  const color = new ImageData(size, size);
  const sum = {color: [0, 0, 0], roughness: 0};
  const relief = new ImageData(size, size);
  for (let y = 0; y < size; y++) {
    for (let x = 0; x < size; x++) {
      const point = shade(x / size, 1 - y / size);
      const at = (y * size + x) * 4;
      for (let i = 0; i < 3; i++) color.data[at + i] = point.color[i] * 255;
      point.color.forEach((part, i) => (sum.color[i] += part / size ** 2));
      sum.roughness += point.roughness / size ** 2;
      relief.data[at] = point.height * 255;
      relief.data[at + 1] = point.roughness * 255;
      color.data[at + 3] = relief.data[at + 3] = 255;
    }
  }
  const reliefMap = texture(relief, THREE.NoColorSpace);
  const map = texture(color, THREE.SRGBColorSpace);
  map.userData.mean = new THREE.Color().setRGB(...sum.color, THREE.SRGBColorSpace).toArray();
  reliefMap.userData.mean = sum.roughness;
  return {
    map,
    bumpMap: reliefMap,
    roughnessMap: reliefMap,
  };
}

function texture(image, colorSpace) {
  const canvas = new OffscreenCanvas(image.width, image.height);
  canvas.getContext('2d').putImageData(image, 0, 0);
  const map = new THREE.CanvasTexture(canvas);
  map.wrapS = map.wrapT = THREE.RepeatWrapping;
  map.colorSpace = colorSpace;
  return map;
}
