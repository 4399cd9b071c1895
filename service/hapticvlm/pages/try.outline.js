// Outlines the one thing that lies on a plain ground, as catalogue photographs show it: the same method, with the same
// constants, as vision/plain_ground.py, which explains it. Pure, except for `outlined`, which reads a canvas.
import { make } from "./dom.js";

const SIDE = 192; // longest side at which the ground is searched, px
const SMALLEST = 16;
const BORDER = 0.03; // width of the border over the shorter side
const SAME = 24; // grey levels of one channel, up to which a pixel has the ground's colour
const AGREEING = 0.9; // least share of the border that has the ground's colour
const GAP = 3; // px; contours with gaps up to twice as wide are closed
const SHARE = { least: 0.04, most: 0.75 }; // of the picture that the thing covers
const IN_ONE = 0.8; // least share of all that is not ground that the largest piece has

// Returns a PNG mask of the thing of a canvas, as large as the canvas and white on black; null if there is none.
export async function outlined(source) {
  const scale = Math.min(1, SIDE / Math.max(source.width, source.height));
  const width = Math.max(1, Math.round(source.width * scale));
  const height = Math.max(1, Math.round(source.height * scale));
  const canvas = make("canvas", "", { width, height });
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.imageSmoothingQuality = "high";
  context.drawImage(source, 0, 0, width, height);
  const picture = context.getImageData(0, 0, width, height);
  const thing = outline(picture.data, width, height);
  if (!thing) return null;
  thing.forEach((inside, at) => picture.data.fill(255 * inside, 4 * at, 4 * at + 3));
  context.putImageData(picture, 0, 0);
  const mask = make("canvas", "", { width: source.width, height: source.height });
  const large = mask.getContext("2d");
  large.imageSmoothingEnabled = false;
  large.drawImage(canvas, 0, 0, mask.width, mask.height);
  const blob = await new Promise((resolve) => mask.toBlob(resolve, "image/png"));
  return new Uint8Array(await blob.arrayBuffer());
}

// Outlines the thing in RGBA pixels: 1 where it is, row by row; null if there is none.
export function outline(pixels, width, height) {
  if (Math.min(width, height) < SMALLEST) return null;
  const rim = Math.max(2, Math.round(BORDER * Math.min(width, height)));
  const isBorder = (at) => {
    const x = at % width;
    const y = Math.floor(at / width);
    return x < rim || x >= width - rim || y < rim || y >= height - rim;
  };
  const far = unlikeGround(pixels, width, height, rim);
  if (share(far.filter((_, at) => isBorder(at))) > 1 - AGREEING) return null;
  const thing = largest(withoutGround(far, width, height), width, height);
  return thing && share(thing) >= SHARE.least && share(thing) <= SHARE.most ? thing : null;
}

const share = (grid) => grid.reduce((sum, inside) => sum + inside, 0) / grid.length;

// Marks the pixels that differ from the plane of colours through the medians of the four sides.
function unlikeGround(pixels, width, height, rim) {
  const far = new Uint8Array(width * height);
  for (let channel = 0; channel < 3; channel++) {
    const side = (left, top, right, bottom) => {
      const values = [];
      for (let y = top; y < bottom; y++) for (let x = left; x < right; x++) values.push(pixels[4 * (y * width + x) + channel]);
      values.sort((one, other) => one - other);
      return (values[(values.length - 1) >> 1] + values[values.length >> 1]) / 2;
    };
    const top = side(0, 0, width, rim);
    const bottom = side(0, height - rim, width, height);
    const left = side(0, 0, rim, height);
    const right = side(width - rim, 0, width, height);
    for (let at = 0; at < far.length; at++) {
      const u = ((at % width) + 0.5) / width - 0.5;
      const v = (Math.floor(at / width) + 0.5) / height - 0.5;
      const ground = (top + bottom + left + right) / 4 + u * (right - left) + v * (bottom - top);
      if (Math.abs(pixels[4 * at + channel] - ground) > SAME) far[at] = 1;
    }
  }
  return far;
}

// Removes what is connected with the edge, through more than narrow gaps in `far`.
function withoutGround(far, width, height) {
  const open = widened(far, width, height).map((inside) => 1 - inside);
  const { labels } = pieces(open, width, height);
  const outer = new Set();
  labels.forEach((label, at) => {
    const x = at % width;
    if (label && (x === 0 || x === width - 1 || at < width || at >= width * (height - 1))) outer.add(label);
  });
  const ground = far.map((_, at) => (outer.has(labels[at]) ? 1 : 0));
  return widened(ground, width, height).map((inside) => 1 - inside);
}

// Widens what is marked by GAP px in every direction.
function widened(grid, width, height) {
  const along = (values, step, length) => values.map((_, at) => {
    const place = Math.floor(at / step) % length;
    for (let by = -Math.min(GAP, place); by <= Math.min(GAP, length - 1 - place); by++) if (values[at + by * step]) return 1;
    return 0;
  });
  return along(along(grid, 1, width), width, height);
}

function largest(grid, width, height) {
  const { labels, sizes } = pieces(grid, width, height);
  const most = Math.max(0, ...sizes);
  if (!most || most < IN_ONE * sizes.reduce((sum, size) => sum + size, 0)) return null;
  return labels.map((label) => (label && sizes[label] === most ? 1 : 0));
}

// Numbers the connected pieces from 1, 0 is unmarked: {labels, sizes}.
function pieces(grid, width, height) {
  const labels = new Uint16Array(grid.length);
  const sizes = [0];
  for (let start = 0; start < grid.length; start++) {
    if (!grid[start] || labels[start]) continue;
    const label = sizes.push(0) - 1;
    const open = [start];
    labels[start] = label;
    while (open.length) {
      const at = open.pop();
      const x = at % width;
      sizes[label]++;
      for (const next of [x > 0 ? at - 1 : -1, x < width - 1 ? at + 1 : -1, at - width, at + width]) {
        if (next < 0 || next >= grid.length || !grid[next] || labels[next]) continue;
        labels[next] = label;
        open.push(next);
      }
    }
  }
  return { labels, sizes };
}
