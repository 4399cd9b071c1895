/** Procedural surfaces: colour, height and roughness of each material as a function of (u, v). */
import * as THREE from 'three';
import {blend, cells, clamp, fractal, mix, noise, sequence, step} from './noise.js';

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

/** Plain weave of two thread colours, `threads` over the texture's width. */
export function weave({warp, weft, threads = 72, seed = 2, stripe = null}) {
  return surface(768, (u, v) => {
    const x = u * threads + (fractal(u * 9, v * 9, 2, seed) - 0.5) * 0.9;
    const y = v * threads + (fractal(u * 9 + 5, v * 9, 2, seed) - 0.5) * 0.9;
    const column = Math.floor(x);
    const row = Math.floor(y);
    const over = (column + row) % 2 === 0;
    const along = over ? y - row : x - column;
    const side = over ? x - column : y - row;
    const bulge = Math.sin(Math.PI * side) * (0.55 + 0.45 * Math.sin(Math.PI * along));
    const slub = noise(over ? column : row, (over ? y : x) * 0.07, seed + (over ? 3 : 4));
    const twist = Math.sin((along * 2 + side) * 9) * 0.05;
    let thread = over ? warp : weft;
    if (stripe && Math.abs(((v * 3) % 1) - 0.5) < 0.09) thread = stripe;
    const shade = 0.5 + 0.5 * bulge + (slub - 0.5) * 0.28 + twist;
    return {color: thread.map((c) => clamp(c * shade)), height: bulge, roughness: 0.95};
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

/** Granite: grains of quartz, feldspar and mica. */
export function granite({seed = 5} = {}) {
  const grains = [[0.86, 0.85, 0.82], [0.62, 0.61, 0.6], [0.74, 0.69, 0.64], [0.2, 0.2, 0.21]];
  return surface(768, (u, v) => {
    const wobble = fractal(u * 40, v * 40, 2, seed) * 0.9;
    const coarse = cells(u * 44 + wobble, v * 44 + wobble, seed);
    const fine = cells(u * 120, v * 120, seed + 5);
    let color = grains[Math.min(3, Math.floor(coarse.id * 4.3))];
    if (fine.id > 0.86) color = [0.1, 0.1, 0.11];
    if (fine.id < 0.1) color = [0.95, 0.94, 0.92];
    const shade = 0.85 + fractal(u * 90, v * 90, 2, seed + 8) * 0.3;
    const height = fine.first * 0.6 + coarse.first * 0.3;
    return {color: color.map((c) => clamp(c * shade)), height, roughness: 0.7};
  });
}

/** White glaze with brushed cobalt bands and a few iron specks. */
export function glaze({seed = 6} = {}) {
  return surface(512, (u, v) => {
    const edge = (noise(u * 30, 1, seed) - 0.5) * 0.02;
    const wave = 0.5 + 0.09 * Math.sin(u * Math.PI * 16);
    const band = Math.max(
      step(0.022, 0.012, Math.abs(v + edge - 0.78)),
      step(0.022, 0.012, Math.abs(v + edge - 0.2)),
      step(0.035, 0.02, Math.abs(v + edge - wave)),
    );
    const ink = band * (0.7 + 0.3 * noise(u * 60, v * 60, seed + 2));
    const speck = step(0.05, 0.03, cells(u * 26, v * 13, seed).first) * 0.7;
    const base = blend([0.93, 0.91, 0.86], [0.85, 0.83, 0.78], fractal(u * 4, v * 4, 3, seed + 4));
    const color = blend(blend(base, [0.09, 0.17, 0.45], ink), [0.35, 0.24, 0.15], speck);
    return {color, height: fractal(u * 6, v * 6, 2, seed), roughness: 0.12};
  });
}

/** Grained hide with wear and creases. */
export function hide({color, seed = 7}) {
  return surface(768, (u, v) => {
    const x = u * 62 + fractal(u * 8, v * 8, 2, seed) * 3;
    const y = v * 62 + fractal(u * 8 + 9, v * 8, 2, seed) * 3;
    const grain = cells(x, y, seed);
    const pebble = clamp((grain.second - grain.first) * 1.9);
    const wear = fractal(u * 3.5, v * 3.5, 4, seed + 5);
    const shade = 0.62 + pebble * 0.32 + (wear - 0.5) * 0.7;
    return {color: color.map((c) => clamp(c * shade)), height: pebble, roughness: 0.66 - pebble * 0.2};
  });
}

/** One colour with a fine moulded grain. */
export function moulded({color, grain = 0.1, roughness = 0.4, seed = 8}) {
  return surface(256, (u, v) => {
    const speckle = fractal(u * 60, v * 60, 2, seed);
    const shade = 1 + (speckle - 0.5) * grain;
    return {color: color.map((c) => clamp(c * shade)), height: speckle, roughness};
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

/** Bright filaments that belong to no material. */
export function filaments({seed = 10} = {}) {
  return surface(512, (u, v) => {
    const x = Math.cos(u * 2 * Math.PI) * 2.2 + 5;
    const y = Math.sin(u * 2 * Math.PI) * 2.2 + v * 7;
    const ridge = 1 - Math.abs(fractal(x, y, 4, seed) - 0.5) * 6;
    const glow = clamp(ridge) ** 1.5;
    const hue = fractal(x * 0.7 + 9, y * 0.7, 3, seed + 5);
    const base = blend([0.4, 0.0, 0.5], [0.0, 0.35, 0.42], step(0.35, 0.65, hue));
    return {color: blend(base, [1, 0.86, 1], glow), height: glow, roughness: 0.3};
  });
}

/** The front page of a newspaper. */
export function newsprint({seed = 11} = {}) {
  const random = sequence(seed);
  const canvas = new OffscreenCanvas(768, 960);
  const pen = canvas.getContext('2d');
  pen.fillStyle = '#e6e1d3';
  pen.fillRect(0, 0, 768, 960);
  pen.fillStyle = '#1b1a18';
  pen.textAlign = 'center';
  pen.font = 'bold 92px serif';
  pen.fillText('THE DAILY TOUCH', 384, 104, 700);
  pen.fillRect(34, 130, 700, 5);
  pen.font = 'bold 54px serif';
  pen.fillText('Glass found to feel like glass', 384, 202, 690);
  halftone(pen, random, {x: 270, y: 236, width: 464, height: 300});
  for (let column = 0; column < 3; column++) {
    for (let y = column ? 560 : 240; y < 930; y += 13) {
      let x = 34 + column * 238;
      const end = x + (y % 91 < 13 ? 120 : 222);
      while (x < end) {
        const word = Math.min(8 + random() * 34, end - x);
        pen.globalAlpha = 0.72 + random() * 0.2;
        pen.fillRect(x, y + random(), word, 5.4);
        x += word + 5;
      }
    }
  }
  pen.globalAlpha = 1;
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  return map;
}

/** A photograph printed in dots: hills under a bright sky. */
function halftone(pen, random, {x, y, width, height}) {
  for (let j = 0; j < height; j += 5) {
    for (let i = 0; i < width; i += 5) {
      const ridge = 0.45 + 0.25 * fractal(i / 90, 3, 3, 4);
      const down = j / height;
      const ink = down > ridge ? 0.45 + 0.5 * fractal(i / 30, j / 30, 3, 8) : 0.1 + 0.25 * down;
      const radius = Math.sqrt(ink) * 3 + random() * 0.2;
      pen.beginPath();
      pen.arc(x + i, y + j, radius, 0, 7);
      pen.fill();
    }
  }
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
