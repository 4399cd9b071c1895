// The card beside the finger: the material, its warmth, and the vibration of the last second. The page has the same text.
//
// The page needs #card (canvas) at the top left of the stage. Live vibration is given to `vibrate`, a recording's to `recall`.
import { byId } from "./dom.js";
import { materialColour, warmthColour } from "./feel.js";
import { feels } from "./felt.js";

const SIZE = { width: 236, height: 128 }; // CSS px
const SCALE = 2;
const AWAY = { x: 54, y: 96 }; // px from the finger to the card's nearer edge and to its middle
const EDGE = 8;
export const HISTORY = 84; // slices
const SLICE_S = 0.012; // of the vibration's history
const STAYS_MS = 4000; // after the touch
const REPAINT_MS = 45;

const history = new Float32Array(HISTORY);
let shown = null;
let at = { x: 0, y: 0 };
let room = { width: 0, height: 0 };
let stays = STAYS_MS;
let until = 0;
let painted = 0;
let isDue = false;
let hiding = null;

// The card is beside points of this stage, for `staysMs` after each `show`.
export function begin(stage = byId("stage"), staysMs = STAYS_MS) {
  stays = staysMs;
  Object.assign(byId("card"), { width: SIZE.width * SCALE, height: SIZE.height * SCALE });
  Object.assign(byId("card").style, { width: `${SIZE.width}px`, height: `${SIZE.height}px` });
  new ResizeObserver(([{ contentRect }]) => {
    room = contentRect;
    move();
  }).observe(stage);
}

// Shows words ({word, source, decision, motion}) beside a point of the stage, px; null hides the card.
export function show(words, point) {
  shown = words;
  until = words === null ? 0 : performance.now() + stays;
  if (point) at = point;
  move();
  paintSoon();
}

// Takes samples of the vibration (-1..1) at `rate` Hz. Returns the strongest.
export function vibrate(samples, rate) {
  const slice = Math.max(1, Math.round(SLICE_S * rate));
  let strongest = 0;
  for (let from = 0; from < samples.length; from += slice) {
    let peak = 0;
    for (let index = from; index < Math.min(from + slice, samples.length); index++) peak = Math.max(peak, Math.abs(samples[index]));
    history.copyWithin(0, 1);
    history[HISTORY - 1] = peak;
    strongest = Math.max(strongest, peak);
  }
  if (shown) paintSoon();
  return strongest;
}

// Replaces the history by these peaks (0..1), the newest last.
export function recall(peaks) {
  history.fill(0);
  history.set(peaks, HISTORY - peaks.length);
  if (shown) paintSoon();
}

function move() {
  const isShown = shown !== null && performance.now() < until;
  byId("card").hidden = !isShown;
  if (!isShown) return;
  const isRight = at.x + AWAY.x + SIZE.width + EDGE <= room.width;
  const isLeft = at.x - AWAY.x - SIZE.width >= EDGE;
  // Where neither side has room, as on a phone, it is at the end of the stage that is farther from the finger.
  const left = isRight ? at.x + AWAY.x : isLeft ? at.x - AWAY.x - SIZE.width : (room.width - SIZE.width) / 2;
  const top = isRight || isLeft ? at.y - AWAY.y - SIZE.height / 2 : at.y > room.height / 2 ? 0 : room.height;
  const x = clamp(left, EDGE, room.width - SIZE.width - EDGE);
  const words = document.getElementById("how")?.getBoundingClientRect().bottom ?? 0; // which lie over the stage
  const y = clamp(top, Math.max(EDGE, words - byId("card").parentElement.getBoundingClientRect().top), room.height - SIZE.height - EDGE);
  byId("card").style.transform = `translate(${Math.round(x)}px, ${Math.round(y)}px)`;
}

function paintSoon() {
  if (isDue) return;
  isDue = true;
  setTimeout(() => requestAnimationFrame(paint), Math.max(0, painted + REPAINT_MS - performance.now()));
}

function paint() {
  isDue = false;
  painted = performance.now();
  move();
  if (byId("card").hidden) return;
  const pen = byId("card").getContext("2d");
  pen.setTransform(SCALE, 0, 0, SCALE, 0, 0);
  pen.clearRect(0, 0, SIZE.width, SIZE.height);
  pen.fillStyle = "rgb(14 20 25 / 0.88)";
  pen.beginPath();
  pen.roundRect(0, 0, SIZE.width, SIZE.height, 14);
  pen.fill();
  const { word, source, decision, motion } = shown;
  text(pen, source, 14, 19, "500 12px", "#b9c6cf");
  dot(pen, 20, 37, materialColour(decision?.felt ?? decision?.material));
  fitted(pen, word, 32, 45, 24);
  const warmth = decision?.thermal_cue ? warmthColour(decision.setpoint_c) : "#55636d";
  const lines = [[decision ? feels(decision) : "", warmth], [motion, "#45d3bf"]].filter(([words]) => words);
  for (const [at, [words, colour]] of lines.entries()) {
    dot(pen, 20, 63 + 19 * at, colour);
    text(pen, words, 32, 67 + 19 * at, "500 12.5px", "#e9eff3");
  }
  ribbon(pen);
  clearTimeout(hiding);
  if (Number.isFinite(until)) hiding = setTimeout(paintSoon, until - performance.now());
}

// Draws the mirrored envelope of the vibration, the newest on the right.
function ribbon(pen) {
  const [left, width, middle] = [14, SIZE.width - 28, 107];
  pen.fillStyle = "rgb(255 255 255 / 0.16)";
  pen.fillRect(left, middle, width, 1);
  pen.fillStyle = "#45d3bf";
  const step = width / HISTORY;
  history.forEach((level, index) => {
    const half = 15 * Math.min(1, Math.sqrt(4 * level));
    if (half > 0.5) pen.fillRect(left + index * step, middle - half, Math.max(1, step - 0.6), 2 * half);
  });
}

function dot(pen, x, y, colour) {
  pen.fillStyle = colour;
  pen.beginPath();
  pen.arc(x, y, 5, 0, 7);
  pen.fill();
}

// Writes a word as large as its line allows, at most `size` px.
function fitted(pen, word, x, y, size) {
  pen.font = `700 ${size}px system-ui, sans-serif`;
  const fits = Math.min(size, (size * (SIZE.width - x - 12)) / pen.measureText(word).width);
  text(pen, word, x, y, `700 ${fits}px`, "#fff");
}

function text(pen, words, x, y, font, colour) {
  pen.font = `${font} system-ui, sans-serif`;
  pen.fillStyle = colour;
  pen.fillText(words, x, y);
}

const clamp = (value, least, most) => Math.max(least, Math.min(most, value));
