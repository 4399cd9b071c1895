// Shows the frame of a decision with its object outlined, and thumbnails of objects.
import { byId, setText } from "./dom.js";

const MAX_SIDE = 448;
const THUMB = { width: 168, height: 126 };
const DIM = 0.42; // of the background
const MARGIN = 0.12; // around an object in its thumbnail
const MAX_VIEWS = 40;
const THUMB_MS = 1000; // between updates of one thumbnail
const views = new Map(); // object name -> the newest view, least recently updated first
const listeners = new Set();
let shown = null; // the object whose frame is on the page
let isDrawing = false; // a frame that arrives meanwhile waits
let decoded = { view: null, pictures: null }; // the newest decoded view, shared by its frame and its thumbnail
const thumbs = new WeakMap(); // canvas -> time of its last update

export const keyOf = ({ object_id: id, surface }) => (id ?? "(touched region)") + (surface ? `, surface ${surface}` : "");

// `listener(name)` is called for each new frame.
export function onFrame(listener) {
  listeners.add(listener);
}

export function take(view) {
  const name = keyOf(view);
  views.delete(name);
  views.set(name, view);
  if (views.size > MAX_VIEWS) views.delete(views.keys().next().value);
  for (const listener of listeners) listener(name);
  if (name === shown) paint();
}

export const hasFrame = (name) => views.has(name);

// Shows the frame of this object, titled `title`; without a frame it shows the reason `why`.
export function show(name, title, why) {
  const isOther = name !== shown;
  shown = name;
  byId("frame").hidden = !views.has(name);
  byId("frame-none").hidden = views.has(name);
  setText(byId("frame-why"), why);
  byId("frame").dataset.title = title;
  if (!isOther) return;
  clear(byId("frame")); // never shows the picture of another object, even while its own is being decoded
  paint();
}

async function paint() {
  const view = views.get(shown);
  if (!view || isDrawing) return;
  isDrawing = true;
  try {
    const { image, mask } = await decode(view);
    if (keyOf(view) === shown) {
      draw(byId("frame"), image, mask, view.region);
      describe(view);
    }
  } catch {
    setText(byId("frame-said"), "The last frame could not be shown.");
  } finally {
    isDrawing = false;
  }
  if (views.get(shown) !== view) paint();
}

function clear(canvas) {
  canvas.getContext("2d", { willReadFrequently: true }).clearRect(0, 0, canvas.width, canvas.height);
  setText(byId("frame-said"), "");
}

// Draws a thumbnail of the object into this canvas; returns false without a frame.
export async function thumbnail(name, canvas) {
  const view = views.get(name);
  if (!view) return false;
  if (performance.now() < thumbs.get(canvas) + THUMB_MS) return true;
  thumbs.set(canvas, performance.now());
  try {
    const { image, mask } = await decode(view);
    const whole = new OffscreenCanvas(1, 1);
    draw(whole, image, mask, view.region, { outlined: false });
    crop(whole, canvas, mask ? boxOf(mask) : view.region);
  } catch {
    thumbs.delete(canvas);
    return false;
  }
  return true;
}

function decode(view) {
  if (decoded.view !== view) decoded = { view, pictures: read(view) };
  return decoded.pictures;
}

async function read({ image, mask, format, origin }) {
  const upright = { imageOrientation: origin === "bottom" ? "flipY" : "from-image" };
  const [picture, outline] = await Promise.all([
    createImageBitmap(blob(image, format), upright),
    mask ? createImageBitmap(blob(mask, "png"), upright) : null,
  ]);
  return { image: picture, mask: outline };
}

function blob(text, format) {
  const bytes = Uint8Array.fromBase64?.(text) ?? Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  return new Blob([bytes], { type: `image/${format}` });
}

function draw(canvas, image, mask, region, { outlined = true } = {}) {
  const scale = Math.min(1, MAX_SIDE / Math.max(image.width, image.height));
  const [width, height] = [Math.round(image.width * scale), Math.round(image.height * scale)];
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0, width, height);
  if (mask) stress(context, mask, width, height, outlined);
  else if (region && outlined) box(context, region, width, height);
}

// Dims the background and outlines the object.
function stress(context, mask, width, height, outlined) {
  const inside = insideOf(mask, width, height);
  const picture = context.getImageData(0, 0, width, height);
  const { data } = picture;
  for (let at = 0; at < inside.length; at++) {
    const ring = outlined ? edge(inside, at, width, height) : 0;
    if (ring) data.fill(ring === 1 ? 255 : 0, 4 * at, 4 * at + 3);
    else if (!inside[at]) for (let part = 0; part < 3; part++) data[4 * at + part] *= 1 - DIM;
  }
  context.putImageData(picture, 0, 0);
}

function insideOf(mask, width, height) {
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(mask, 0, 0, width, height);
  const { data } = context.getImageData(0, 0, width, height);
  return Uint8Array.from({ length: width * height }, (_, at) => (data[4 * at] > 0 ? 1 : 0));
}

// Returns 1 on the white line around the object, 2 on the dark line around that, 0 elsewhere.
function edge(inside, at, width, height) {
  if (inside[at]) return 0;
  const [x, y] = [at % width, Math.floor(at / width)];
  for (const reach of [2, 3]) {
    for (const [dx, dy] of [[reach, 0], [-reach, 0], [0, reach], [0, -reach], [reach - 1, reach - 1], [1 - reach, reach - 1], [reach - 1, 1 - reach], [1 - reach, 1 - reach]]) {
      const [px, py] = [x + dx, y + dy];
      if (px >= 0 && px < width && py >= 0 && py < height && inside[py * width + px]) return reach - 1;
    }
  }
  return 0;
}

// Draws a dark line under a bright one, so that it is visible on any picture.
function box(context, { x, y, w, h }, width, height) {
  for (const [colour, line] of [["#000", 5], ["#fff", 2]]) {
    context.strokeStyle = colour;
    context.lineWidth = line;
    context.strokeRect(x * width, y * height, w * width, h * height);
  }
}

function boxOf(mask) {
  const [width, height] = [64, Math.max(1, Math.round((64 * mask.height) / mask.width))];
  const inside = insideOf(mask, width, height);
  let [left, top, right, bottom] = [width, height, 0, 0];
  inside.forEach((is, at) => {
    if (!is) return;
    const [x, y] = [at % width, Math.floor(at / width)];
    [left, right] = [Math.min(left, x), Math.max(right, x + 1)];
    [top, bottom] = [Math.min(top, y), Math.max(bottom, y + 1)];
  });
  if (right <= left) return null;
  return { x: left / width, y: top / height, w: (right - left) / width, h: (bottom - top) / height };
}

// Crops the box from the whole picture, with a margin and the aspect ratio of a thumbnail.
function crop(whole, canvas, region) {
  const { x, y, w, h } = region ?? { x: 0, y: 0, w: 1, h: 1 };
  const shape = THUMB.width / THUMB.height;
  const height = Math.max(h * whole.height, (w * whole.width) / shape) * (1 + 2 * MARGIN);
  const fit = Math.min(1, whole.height / height, whole.width / (height * shape));
  const [wide, high] = [height * shape * fit, height * fit];
  const left = clamp((x + w / 2) * whole.width - wide / 2, whole.width - wide);
  const top = clamp((y + h / 2) * whole.height - high / 2, whole.height - high);
  Object.assign(canvas, THUMB);
  canvas.getContext("2d").drawImage(whole, left, top, wide, high, 0, 0, THUMB.width, THUMB.height);
}

const clamp = (value, limit) => Math.max(0, Math.min(limit, value));

function describe({ region, mask }) {
  const { title } = byId("frame").dataset;
  const where = mask ? "outlined by its mask" : region ? "the box is the region" : "the whole frame";
  setText(byId("frame-said"), `The frame of ${title}; ${where}.`);
  byId("frame").ariaLabel = `The frame of ${title}; ${where}`;
}
