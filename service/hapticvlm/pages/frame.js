// The frame that a decision was made from, with its object outlined; and thumbnails of it.
import { byId, setText } from "./dom.js";

const MOST_SIDE = 448;
const THUMB = { width: 168, height: 126 };
const DIM = 0.42; // of what is not the object
const ROOM = 0.12; // round an object in its thumbnail
const MOST_KEPT = 40;
const THUMB_MS = 1000; // between pictures of one thumbnail
const views = new Map(); // object name -> the newest view, least lately shown first
const listeners = new Set();
let shown = null; // the object whose frame is on the page
let isDrawing = false; // a frame that comes meanwhile waits: the next is never far
let decoded = { view: null, pictures: null }; // the newest asked for: its frame and its thumbnail are drawn from one
const thumbs = new WeakMap(); // canvas -> when it was drawn

export const keyOf = ({ object_id: id }) => id ?? "(touched region)";

// `listener(name)` hears of each new frame.
export function onFrame(listener) {
  listeners.add(listener);
}

export function take(view) {
  const name = keyOf(view);
  views.delete(name);
  views.set(name, view);
  if (views.size > MOST_KEPT) views.delete(views.keys().next().value);
  for (const listener of listeners) listener(name);
  if (name === shown) paint();
}

export const hasFrame = (name) => views.has(name);

// Shows the frame of this object, called `title`; `why` is shown where there is none.
export function show(name, title, why) {
  const isOther = name !== shown;
  shown = name;
  byId("frame").hidden = !views.has(name);
  byId("frame-none").hidden = views.has(name);
  setText(byId("frame-why"), why);
  byId("frame").dataset.title = title;
  if (!isOther) return;
  clear(byId("frame")); // never another's picture, not even until its own is decoded
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

// A small picture of the object alone, in this canvas; false when there is none.
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
  const scale = Math.min(1, MOST_SIDE / Math.max(image.width, image.height));
  const [width, height] = [Math.round(image.width * scale), Math.round(image.height * scale)];
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0, width, height);
  if (mask) stress(context, mask, width, height, outlined);
  else if (region && outlined) box(context, region, width, height);
}

// Dims what is not the object and draws a line round what is.
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

// 1 on the white line round the object, 2 on the dark one round that, 0 elsewhere.
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

// Dark under bright, so that it is seen on any picture.
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

// Cuts the box, with some room and in the thumbnail's own shape, out of the whole picture.
function crop(whole, canvas, found) {
  const { x, y, w, h } = found ?? { x: 0, y: 0, w: 1, h: 1 };
  const shape = THUMB.width / THUMB.height;
  const height = Math.max(h * whole.height, (w * whole.width) / shape) * (1 + 2 * ROOM);
  const fit = Math.min(1, whole.height / height, whole.width / (height * shape));
  const [wide, high] = [height * shape * fit, height * fit];
  const left = clamp((x + w / 2) * whole.width - wide / 2, whole.width - wide);
  const top = clamp((y + h / 2) * whole.height - high / 2, whole.height - high);
  Object.assign(canvas, THUMB);
  canvas.getContext("2d").drawImage(whole, left, top, wide, high, 0, 0, THUMB.width, THUMB.height);
}

const clamp = (value, most) => Math.max(0, Math.min(most, value));

function describe({ region, mask }) {
  const { title } = byId("frame").dataset;
  const where = mask ? "outlined by its mask" : region ? "the box is the region" : "the whole frame";
  setText(byId("frame-said"), `The frame of ${title}; ${where}.`);
  byId("frame").ariaLabel = `The frame of ${title}; ${where}`;
}
