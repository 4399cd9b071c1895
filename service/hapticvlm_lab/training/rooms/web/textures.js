/** Maps: photographed tiles of the data folder, and patterns painted from a seed. */
import * as THREE from 'three';

const SIDE = 192; // px of a painted map

/** A brush on a canvas of side 1, with random places. */
class Brush {
  canvas = Object.assign(document.createElement('canvas'), {width: SIDE, height: SIDE});
  #context = this.canvas.getContext('2d', {willReadFrequently: true});

  constructor(dice) {
    this.dice = dice;
    this.#context.scale(SIDE, SIDE);
  }

  colour([h, s, l], alpha = 1) {
    const style = `hsl(${360 * h} ${100 * s}% ${100 * l}% / ${alpha})`;
    Object.assign(this.#context, {fillStyle: style, strokeStyle: style});
    return this;
  }

  box(x, y, w, h) {
    this.#context.fillRect(x, y, w, h);
    return this;
  }

  /** Dots of a colour at random, `size` at most; over the edge they go on at the other side. */
  dots(count, size, colour, alpha) {
    for (let i = 0; i < count; i++) {
      const [x, y, r] = [this.dice.next(), this.dice.next(), size * this.dice.uniform(0.3, 1)];
      this.colour(colour, alpha);
      for (const [dx, dy] of [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) {
        this.#context.beginPath();
        this.#context.ellipse(x + dx, y + dy, r, r * 0.7, 6.28 * x, 0, 6.3);
        this.#context.fill();
      }
    }
    return this;
  }

  /** A colour changed at random in lightness, to break it up. */
  mottled([h, s, l], count = 120, size = 0.08, by = 0.15) {
    this.colour([h, s, l]).box(0, 0, 1, 1);
    for (const change of [-by, by]) this.dots(count, size, [h, s, l + change], 0.12);
    return this;
  }
}

const from = (d, h, s, l) => [d.uniform(...h), d.uniform(...s), d.uniform(...l)];
const any = (d) => from(d, [0, 1], [0.05, 0.9], [0.12, 0.85]);
const pale = (d) => from(d, [0.1, 0.14], [0, 0.25], [0.8, 0.97]);
const every = (count, paint) => Array.from({length: count}, (_, i) => paint(i / count, i));
const dark = [0, 0, 0], white = [0, 0, 1];

const PATTERNS = {
  weave(d, brush) {
    const n = 4 * d.integer(4, 16), twill = d.pick([1, 3]), colours = [any(d), any(d)], edge = 0.25 / n;
    every(n * n, (_, i) => {
      const x = (i % n) / n, y = Math.floor(i / n) / n, isOver = ((i + Math.floor(i / n)) & twill) <= twill >> 1;
      brush.colour(colours[Number(isOver)]).box(x, y, 1 / n, 1 / n);
      brush.colour(dark, 0.3).box(x, y, isOver ? 1 / n : edge, isOver ? edge : 1 / n);
    });
  },
  print(d, brush) {
    const n = d.integer(2, 9), share = d.uniform(0.2, 0.6) / n, kind = d.integer(0, 3);
    brush.mottled(any(d)).colour(any(d), d.uniform(0.6, 1));
    if (kind < 2) every(n, (x) => brush.box(x, 0, share, 1));
    if (kind === 1) every(n, (y) => brush.box(0, y, 1, share));
    if (kind === 2) brush.dots(n * n, 0.4 / n, any(d), 1).dots(n * n, 0.1, any(d), 0.9);
    brush.colour(dark, 0.12);
    every(60, (x) => brush.box(x, 0, 0.008, 1).box(0, x, 1, 0.008));
  },
  brushed(d, brush) {
    const tone = from(d, [0.05, 0.15], [0, d.pick([0, 0.5])], [0.5, 0.9]);
    brush.colour(tone).box(0, 0, 1, 1);
    every(400, () => brush.colour(d.pick([dark, white]), 0.12).box(d.uniform(-0.3, 1), d.next(), d.next(), 0.006));
  },
  hide(d, brush) {
    const brown = from(d, [0.02, 0.09], [0.3, 0.8], [0.1, 0.5]), dull = from(d, [0, 1], [0, 0.4], [0.04, 0.4]);
    const tone = d.pick([brown, brown, dull]);
    brush.mottled(tone).dots(700, 0.035, dark, 0.25).dots(1200, 0.025, tone, 0.6);
  },
  page(d, brush) {
    const rows = d.integer(10, 28);
    brush.mottled(d.pick([pale(d), from(d, [0, 1], [0.1, 0.5], [0.6, 0.9])]), 100, 0.05, 0.04);
    if (d.chance(0.5)) brush.colour(any(d), 0.7).box(d.uniform(0, 0.6), d.uniform(0, 0.6), 0.35, 0.3);
    brush.colour(from(d, [0, 1], [0, 0.2], [0.05, 0.3]), 0.8);
    every(rows * 20, (y, i) => d.chance(0.75)
      && brush.box(0.05 + 0.045 * (i % 20), Math.floor(y * rows) / rows, 0.04, 0.4 / rows));
  },
  glaze(d, brush) {
    brush.mottled(d.pick([pale, any])(d), 60, 0.2, 0.05).colour(any(d));
    d.pick([() => every(d.integer(2, 7), (y) => brush.box(0, y, 1, 0.05)), () => brush.dots(400, 0.01, any(d), 0.8),
      () => brush.box(0, 0, 1, d.uniform(0.2, 0.7)), () => brush.dots(30, 0.08, any(d), 1), () => null])();
  },
  leaf(d, brush) {
    brush.mottled(from(d, [0.2, 0.38], [0.25, 0.75], [0.16, 0.45]));
    brush.colour(from(d, [0.15, 0.25], [0.2, 0.5], [0.4, 0.7]), 0.5).box(0.48, 0, 0.04, 1); // the rib
  },
  tread(d, brush) {
    const n = d.integer(4, 12);
    brush.mottled([0, 0, d.uniform(0.05, 0.24)], 200, 0.04, 0.05).colour(dark, 0.9);
    every(n, (x) => brush.box(x, 0, d.uniform(0.1, 0.3) / n, 1).box(0, x, 1, 0.15 / n));
  },
  plaster: (d, brush) => brush.mottled(pale(d), 300, 0.06, 0.2),
  odd: (d, brush) => every(d.integer(3, 30), (share) => brush.dots(6, 0.3 * (1 - share), any(d), 1)),
};

function ready(texture) {
  return Object.assign(texture, {colorSpace: THREE.SRGBColorSpace, wrapS: THREE.RepeatWrapping,
    wrapT: THREE.RepeatWrapping, needsUpdate: true});
}

function painted(dice, paint) {
  const brush = new Brush(dice);
  paint(dice, brush);
  return {name: '', map: ready(new THREE.CanvasTexture(brush.canvas))};
}

/** Maps to dress things with, {name of the file, map}: tiles by folder, and patterns. */
export class Maps {
  #tiles;
  #painted = {};

  constructor(tiles, dice, each = 3) {
    this.#tiles = tiles;
    for (const [name, paint] of Object.entries(PATTERNS)) {
      this.#painted[name] = Array.from({length: each}, () => painted(dice.fork(), paint));
    }
  }

  tile = (dice, ...folders) => dice.pick(this.#tiles[dice.pick(folders)]);
  pattern = (dice, ...names) => dice.pick(this.#painted[dice.pick(names)]);
  dispose = () => Object.values(this.#painted).flat().forEach(({map}) => map.dispose());
}

/** Load the tiles of {folder: [file of the data folder]}. */
export async function loadTiles(folders) {
  const loader = new THREE.TextureLoader(), tiles = {};
  const load = async (file) => (
    {name: file.split('/').at(-1), map: ready(await loader.loadAsync(`/data/${file}`))});
  for (const [folder, files] of Object.entries(folders)) tiles[folder] = await Promise.all(files.map(load));
  return tiles;
}
