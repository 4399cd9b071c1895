// Test touches: the dashboard acts as a scene of one object, which owns the outputs only while it is used.
import { byId, make, setText } from "./dom.js";
import { materialColour, warmthColour } from "./feel.js";
import { startWithTouch } from "./hear.js";
import { Link } from "./link.js";
import { glyph } from "./glyphs.js";
import * as rumble from "./try.rumble.js";

export const OBJECT = "test touch";
const RENEW_MS = 50; // a lease lasts 250 ms
const TAP_MS = 900; // duration of a click without a press, as by a screen reader
const GIVE_BACK_MS = 4000; // after the last touch
const STROKE_S = 0.9; // to and fro
const OWNS = "This page owns the outputs. Keep a button pressed to keep touching.";
const INTERACTIONS = {
  strike: { speed: 0.6, force: 4 },
  tap: { speed: 0.25, force: 1.5 },
  press: { speed: 0.05, force: 8 },
  slide: { speed: 0.25, force: 1.5, moves: true },
  carve: { speed: 0.2, force: 5, moves: true },
  swing: { speed: 1.5, force: 0, moves: true },
};
const held = { interaction: null, began: 0, timer: null, button: null };
let url = "";
let options = {};
let link = null;
let giving = null;
let stated = "";

export function offerTouches(address, given) {
  url = address;
  options = given;
  byId("trial-interactions").append(...Object.keys(INTERACTIONS).map(button));
  for (const id of ["trial-heat", "trial-level"]) byId(id).addEventListener("input", showSliders);
  byId("trial-material").addEventListener("change", () => { paintGlyphs(); state(); });
  byId("trial-level").addEventListener("change", setLevel);
  byId("trial-heat").addEventListener("change", state);
  addEventListener("blur", release);
  showSliders();
}

export function welcome({ materials }) {
  const select = byId("trial-material");
  if (select.options.length) return;
  select.append(...materials.map((name) => make("option", name, { value: name })));
  paintGlyphs();
}

function button(interaction) {
  const element = make("button", "", { type: "button", className: "interaction" });
  element.dataset.interaction = interaction;
  element.append(make("span", "", { className: "glyph" }), make("span", interaction));
  element.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    element.setPointerCapture(event.pointerId);
    press(interaction, element);
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture", "keyup"]) element.addEventListener(end, release);
  element.addEventListener("keydown", (event) => {
    if (event.repeat || ![" ", "Enter"].includes(event.key)) return;
    event.preventDefault();
    press(interaction, element);
  });
  element.addEventListener("click", (event) => {
    if (event.detail > 0 || held.interaction) return; // the press was already a touch
    press(interaction, element);
    setTimeout(release, TAP_MS);
  });
  return element;
}

async function press(interaction, element) {
  release();
  startWithTouch();
  clearTimeout(giving);
  Object.assign(held, { interaction, began: performance.now(), button: element });
  element.ariaPressed = "true";
  if (!(await own())) return;
  const { speed, force } = INTERACTIONS[interaction];
  releaseAfterStop();
  if (interaction === "swing") touch("approach", speed, force, interaction);
  else touch("contact", speed, force, interaction);
  if (held.interaction === interaction) held.timer ??= setInterval(renew, RENEW_MS);
  else setTimeout(sendRelease, RENEW_MS); // the click ended before the outputs were available
}

// Returns whether a test touch swings the hand through the air now.
export const isSwinging = () => held.interaction === "swing";

function renew() {
  const { interaction } = held;
  const { speed, force, moves } = INTERACTIONS[interaction];
  const swing = Math.abs(Math.sin((Math.PI * (performance.now() - held.began)) / 1000 / STROKE_S));
  if (interaction === "swing") touch("approach", speed * swing, force);
  else if (moves) touch("slide", speed * swing, force);
  else touch("contact", 0, Math.min(force, 3));
}

function release() {
  if (!held.interaction) return;
  clearInterval(held.timer);
  held.button.ariaPressed = "false";
  Object.assign(held, { interaction: null, timer: null, button: null });
  sendRelease();
  giving = setTimeout(giveBack, GIVE_BACK_MS);
}

// After a stop a hand must release before it can touch again, and each press is a new touch.
function releaseAfterStop() {
  setText(byId("trial-told"), OWNS);
  touch("release", 0, 0, null);
}

function sendRelease() {
  if (link?.state === "open" && !held.interaction) touch("release", 0, 0, null);
}

function touch(phase, speed_mps, force_n, interaction = held.interaction) {
  const fields = { phase, hand: "right", speed_mps, force_n, captured_at: performance.now() / 1000 };
  link.ask({ type: "touch", object_id: OBJECT, ...fields, ...(interaction && { interaction }) }).then(showError);
}

// Resolves to whether this page owns the outputs.
function own() {
  if (link?.state === "open") return Promise.resolve(true);
  setText(byId("trial-told"), "Requesting the outputs.");
  return new Promise((resolve) => {
    const onMessage = async (message) => {
      if (message.type === "vibration") rumble.take(message);
      if (message.type !== "welcome") return;
      if (!message.owner) {
        refused();
        return resolve(false);
      }
      stated = "";
      await state();
      await setLevel();
      link.ask({ type: "set", feel: { right: "amplitude" } });
      setText(byId("trial-told"), OWNS);
      resolve(true);
    };
    const onState = (now) => {
      if (now !== "gone") return;
      link = null;
      resolve(false);
    };
    link = new Link(url, { ...options(), onMessage, onState, role: "scene", name: "dashboard test touch", keeps: false });
    link.connect();
  });
}

function refused() {
  setText(byId("trial-told"), "Another scene owns the outputs: test touches work after it disconnects.");
  link.close();
  link = null;
}

function giveBack() {
  link?.close();
  link = null;
  setText(byId("trial-told"), "The outputs are free again.");
}

function showError(answer) {
  if (answer.type === "error") setText(byId("trial-told"), answer.text);
}

// Sends material and temperature of the test object; resolves when the service has them.
async function state() {
  const temperature_c = Number(byId("trial-heat").value);
  const object = { object_id: OBJECT, material: byId("trial-material").value, temperature_c };
  const key = JSON.stringify(object);
  if (link?.state !== "open" || key === stated) return;
  stated = key;
  showError(await link.ask({ type: "scene", objects: [object], replace: true }));
}

async function setLevel() {
  if (link?.state === "open") showError(await link.ask({ type: "set", vibration_gain: Number(byId("trial-level").value) }));
}

function showSliders() {
  const heat = Number(byId("trial-heat").value);
  setText(byId("trial-heat-said"), `${heat} °C`);
  byId("trial-heat").style.accentColor = warmthColour(heat);
  setText(byId("trial-level-said"), `${Math.round(100 * byId("trial-level").value)} %`);
}

function paintGlyphs() {
  const material = byId("trial-material").value;
  for (const element of byId("trial-interactions").children) {
    element.style.setProperty("--body", materialColour(material));
    element.firstElementChild.replaceChildren(glyph({ material, interaction: element.dataset.interaction }));
  }
}
