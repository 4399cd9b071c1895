// Shows recent decisions, one tile per object; the newest or a chosen one is explained in full beside its frame.
//
// Tiles keep their place and the keyboard focus when they change; a new object comes first.
import { byId, eachFrame, make, percent, setText } from "./dom.js";
import { materialColour } from "./feel.js";
import * as frame from "./frame.js";
import { glyph } from "./glyphs.js";
import * as teach from "./teach.js";
import { OBJECT } from "./trial.js";
import { explain } from "./why.js";

const MAX_OBJECTS = 24;
const RESTS_MS = 30_000; // with nobody who owns the outputs
const NEWS_MS = 2000; // between announcements to a screen reader

const objects = new Map(); // key -> {decision, tile}, least recently decided first
let chosen = null; // null = the newest
let newest = null; // key of the last decision about an object; a decision about a whole view does not replace it
let announced = "";
let announcedAt = -Infinity;
let ownedAt = performance.now();
let timer = null;
const paintSoon = eachFrame(paint);
frame.onFrame((key) => objects.has(key) && picture(key));

export const titleOf = ({ name, object_id: id }) => name || id || "touched region";

export function take(decision) {
  const key = frame.keyOf(decision);
  const isNew = !objects.has(key);
  const tile = objects.get(key)?.tile ?? addTile(key);
  objects.delete(key);
  objects.set(key, { decision, tile });
  if (decision.object_id || decision.pattern || !objects.has(newest)) newest = key;
  if (objects.size > MAX_OBJECTS) forget(objects.keys().next().value);
  if (isNew) picture(key);
  announce();
  paintSoon();
}

// Brings the page to rest a while after the last owner has left; objects stay for the next one.
export function rest({ owner }) {
  if (owner || document.body.dataset.mode === "idle") ownedAt = performance.now();
  else if (performance.now() - ownedAt > RESTS_MS) mode("idle");
}

// "idle": nothing is felt; "trial": a test touch of this page is; "live": a scene is.
function mode(name) {
  if (document.body.dataset.mode !== name) document.body.dataset.mode = name;
}

export function offerChoice() {
  byId("newest").addEventListener("click", () => choose(null));
}

function addTile(key) {
  if (!objects.size) byId("objects").replaceChildren();
  const item = make("li");
  const button = make("button", "", { type: "button", className: "tile" });
  const words = make("span", "", { className: "words" });
  words.append(make("b"), make("span", "", { className: "what" }), make("span", "", { className: "sure" }));
  button.append(make("canvas", "", { width: 168, height: 126, ariaHidden: "true" }), make("span", "", { className: "glyph" }), words);
  button.addEventListener("click", () => choose(key));
  item.append(button);
  byId("objects").prepend(item);
  return item;
}

async function picture(key) {
  const { tile } = objects.get(key);
  const canvas = tile.querySelector("canvas");
  tile.classList.toggle("pictured", await frame.thumbnail(key, canvas));
}

function forget(key) {
  objects.get(key).tile.remove();
  objects.delete(key);
  if (chosen === key) chosen = null;
  if (newest === key) newest = [...objects.keys()].at(-1) ?? null;
}

function choose(key) {
  chosen = key;
  ownedAt = performance.now();
  paint();
}

function paint() {
  const shown = objects.has(chosen) ? chosen : newest;
  for (const [key, { decision, tile }] of objects) fill(tile, decision, key === chosen, key === shown);
  byId("newest").ariaPressed = String(chosen === null);
  if (!objects.has(shown)) return;
  const { decision } = objects.get(shown);
  mode(shown === OBJECT ? "trial" : "live");
  explain(decision, titleOf(decision));
  byId("frame-glyph").replaceChildren(glyph(decision));
  frame.show(shown, titleOf(decision), frame.hasFrame(shown) ? "" : reasonWithoutFrame(decision));
  teach.offer(decision, titleOf(decision));
}

function fill(tile, decision, isChosen, isShown) {
  const button = tile.firstElementChild;
  button.ariaPressed = String(isChosen);
  tile.classList.toggle("shown", isShown);
  tile.classList.toggle("unknown", decision.material === "unknown");
  if (tile.dataset.material !== decision.material) drawBody(tile, decision.material);
  const [name, material, confidence] = button.lastElementChild.children;
  setText(name, titleOf(decision));
  setText(material, decision.material);
  setText(confidence, percent(decision.confidence));
}

function drawBody(tile, material) {
  tile.dataset.material = material;
  tile.style.setProperty("--body", materialColour(material));
  tile.querySelector(".glyph").replaceChildren(glyph({ material }));
}

function reasonWithoutFrame({ source }) {
  return source === "encoder" || source === "unknown" ? "No frame of it has arrived yet." : `No frame was needed: the ${source} was enough.`;
}

// Announces a changed decision to screen readers, not faster than it can be read out.
function announce() {
  const waitMs = announcedAt + NEWS_MS - performance.now();
  if (waitMs > 0) {
    timer ??= setTimeout(announce, waitMs);
    return;
  }
  clearTimeout(timer);
  timer = null;
  const { decision } = objects.get(newest);
  const text = `${titleOf(decision)} is ${decision.material}, by ${decision.source}`;
  if (text === announced) return;
  announced = text;
  announcedAt = performance.now();
  setText(byId("news"), `${text}, ${percent(decision.confidence)} sure.`);
}
