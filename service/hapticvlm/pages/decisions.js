// What was decided lately, an object a row; the newest or a chosen one is explained in full.
//
// Rows stay in place and keep the keyboard's focus when they change; a new object comes first.
import { byId, clock, eachFrame, make, percent, say } from "./dom.js";
import { explain } from "./why.js";

const MOST_OBJECTS = 20;
const NEWS_MS = 2000; // between announcements to a screen reader

const objects = new Map(); // name -> {decision, at, row}, least lately decided first
let chosen = null; // null = the newest
let told = "";
let toldAt = -Infinity;
let timer = null;
const paintSoon = eachFrame(paint);

export function take(decision) {
  const name = decision.object_id ?? "(touched region)";
  const row = objects.get(name)?.row ?? addRow(name);
  objects.delete(name);
  objects.set(name, { decision, at: clock(), row });
  if (objects.size > MOST_OBJECTS) forget(objects.keys().next().value);
  announce();
  paintSoon();
}

export function offerChoice() {
  byId("newest").addEventListener("click", () => choose(null));
}

function addRow(name) {
  if (!objects.size) byId("objects").replaceChildren();
  const row = byId("objects").insertRow(0);
  const button = make("button", name, { type: "button" });
  button.addEventListener("click", () => choose(name));
  const head = make("th", "", { scope: "row" });
  head.append(button);
  row.append(head);
  for (let column = 0; column < 4; column++) row.insertCell();
  return row;
}

function forget(name) {
  objects.get(name).row.remove();
  objects.delete(name);
  if (chosen === name) chosen = null;
}

function choose(name) {
  chosen = name;
  paint();
}

function paint() {
  for (const [name, { decision, at, row }] of objects) {
    row.querySelector("button").ariaPressed = String(name === chosen);
    const texts = [decision.material, percent(decision.confidence), decision.source, at];
    texts.forEach((text, index) => say(row.cells[index + 1], text));
  }
  byId("newest").ariaPressed = String(chosen === null);
  const shown = objects.get(chosen) ?? newest();
  if (shown) explain(shown.decision);
}

function newest() {
  return [...objects.values()].at(-1);
}

// The newest decision for a screen reader, when it differs; never faster than it can be heard.
function announce() {
  const waitMs = toldAt + NEWS_MS - performance.now();
  if (waitMs > 0) {
    timer ??= setTimeout(announce, waitMs);
    return;
  }
  clearTimeout(timer);
  timer = null;
  const { object_id, material, confidence, source } = newest().decision;
  const news = `${object_id ?? "The touched region"} is ${material}, by ${source}`;
  if (news === told) return;
  told = news;
  toldAt = performance.now();
  say(byId("news"), `${news}, ${percent(confidence)} sure.`);
}
