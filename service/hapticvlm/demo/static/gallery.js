// The gallery of the materials: touched, heard and felt from a bake, without a service.
//
// Each gesture is a link to itself, such as #glass/strike (moments.js). A page that is opened by it waits there for Enter or
// a tap.
import { Felt, Pulses, openFeel } from "hapticvlm";
import { byId, copyAddress, make } from "./dom.js";
import { materialColour } from "./feel.js";
import { offerSound, sound, startWithTouch } from "./hear.js";
import { BakedWave } from "./scene/webxr/baked.js";
import { KINDS, playMoment, readMoment, usualMoment, writeMoment } from "./scene/webxr/moments.js";

const EVERY_MS = 30; // between two touches of a hand
const HAND = "right";
const STRIKE = { kind: "strike", speed: 0.6, force: 4 };
const TAP = { kind: "tap", speed: 0.25, force: 1.5 };
const HELD = { speed_mps: 0, force_n: 2 };
const FASTEST = 20; // m/s, of the protocol
const FALLS = 0.8; // share of the level that is left after a picture

const tables = openFeel(await (await fetch("scene/webxr/client/feel.json")).json());
export const felt = new Felt(null, tables, { mode: "baked" });
export const pulses = new Pulses();
const wave = new BakedWave(tables, play);
const names = [...tables.materials.keys()];
const lights = new Map(); // material -> its light
let level = 0;
let gesture = null; // ends what is under way
let opened = null; // the moment of the address
let asked = null; // the moment that waits for the sound
let newest = null; // the moment of the newest touch
let touched = null; // the material whose light shines

pulses.follow(felt);
felt.scene(names.map((material) => ({ object_id: material, material })));
byId("materials").append(...names.map(card));
byId("link").addEventListener("click", async () => (byId("link").textContent = await copyAddress(writeMoment(newest))));
byId("stop").addEventListener("click", stop);
addEventListener("keydown", (event) => event.key === "Escape" && stop());
addEventListener("hashchange", open);
offerSound();
open();
requestAnimationFrame(draw);

// Shows the moment of the address; its gesture has the focus, so that Enter plays it.
function open() {
  for (const link of document.querySelectorAll(".opened")) link.classList.remove("opened");
  opened = null;
  let words = "Press or stroke a surface, or choose a gesture. A gamepad or phone vibrates.";
  try {
    opened = readMoment(location.hash, names);
  } catch (error) {
    return tell(error.message);
  }
  if (opened) {
    const link = document.getElementById(`${opened.target}/${opened.kind}`);
    link.classList.add("opened");
    link.focus();
    words = `${titled(opened)}: tap it, or press Enter`;
    remember(opened);
  }
  if (!gesture) tell(words);
}

// Keeps a moment for the link that is copied.
function remember(moment) {
  newest = moment;
  Object.assign(byId("link"), { textContent: "Copy link to this moment", disabled: false });
}

function card(material) {
  const box = make("article", "", { id: material });
  const swatch = make("div", "", { className: "swatch" });
  const light = make("i");
  swatch.append(light);
  swatch.style.setProperty("--colour", materialColour(material));
  lights.set(material, light);
  offerHand(swatch, material);
  const gestures = make("div", "", { className: "gestures" });
  gestures.append(...KINDS.map((kind) => gestureLink(material, kind)));
  box.append(make("h2", material), swatch, gestures);
  return box;
}

function gestureLink(material, kind) {
  const link = make("a", kind, { id: `${material}/${kind}`, href: `#${material}/${kind}`, ariaLabel: `${kind} ${material}` });
  link.addEventListener("click", async (event) => {
    const isOpened = opened?.target === material && opened.kind === kind;
    if (isOpened) event.preventDefault(); // keeps its speed and force in the address
    const moment = isOpened ? opened : usualMoment(material, kind);
    asked = moment;
    await startWithTouch();
    if (asked === moment) begin(moment);
  });
  return link;
}

// Plays a moment; one that is under way ends.
export function begin(moment) {
  end();
  gesture = playMoment(moment, (fields) => send(moment.target, fields), () => (gesture = null));
  remember(moment);
  tell(titled(moment));
}

function end() {
  asked = null;
  gesture?.();
}

function titled({ target, kind }) {
  return `${target}, ${kind}`;
}

// Makes a swatch a surface: a press strikes it, a drag strokes it at its speed on the screen.
function offerHand(swatch, material) {
  let before = null; // {x, y, at}
  const at = ({ offsetX: x, offsetY: y, timeStamp }) => ({ x, y, at: timeStamp });
  const place = ({ x, y }) => {
    swatch.style.setProperty("--x", `${x}px`);
    swatch.style.setProperty("--y", `${y}px`);
  };
  swatch.addEventListener("pointerdown", (event) => {
    startWithTouch();
    end();
    swatch.setPointerCapture?.(event.pointerId);
    place((before = at(event)));
    const { kind, speed, force } = event.shiftKey ? TAP : STRIKE;
    send(material, { phase: "contact", interaction: kind, speed_mps: speed, force_n: force });
    remember({ target: material, kind, speed, force });
    const timer = setInterval(() => send(material, { phase: "contact", ...HELD }), 2 * EVERY_MS);
    gesture = () => {
      clearInterval(timer);
      gesture = null;
      send(material, { phase: "release", speed_mps: 0, force_n: 0 });
    };
    tell(`${material}, your hand`);
  });
  swatch.addEventListener("pointermove", (event) => {
    if (!before || event.timeStamp - before.at < EVERY_MS / 2) return;
    const now = at(event);
    const metres = (Math.hypot(now.x - before.x, now.y - before.y) / 96) * 0.0254; // CSS px
    place(now);
    const speed = Math.min((1000 * metres) / (now.at - before.at), FASTEST);
    if (speed) {
      send(material, { phase: "slide", speed_mps: speed, force_n: HELD.force_n });
      remember({ target: material, kind: "slide", speed, force: HELD.force_n });
    }
    before = now;
  });
  for (const type of ["pointerup", "pointercancel"]) {
    swatch.addEventListener(type, () => {
      before = null;
      end();
    });
  }
}

function send(material, fields) {
  const touch = { hand: HAND, object_id: material, ...fields };
  touched = material;
  felt.touch(touch);
  wave.touch(touch, felt.surfaceOf(touch));
}

function stop() {
  end();
  felt.stop();
  wave.stop();
  sound.silence();
  send(names[0], { phase: "release", speed_mps: 0, force_n: 0 }); // the next touch is felt again
  tell("stopped");
}

function play(piece) {
  sound.take(piece);
  for (const sample of piece.samples) level = Math.max(level, Math.abs(sample));
}

function draw() {
  for (const gamepad of (navigator.getGamepads?.() ?? []).filter(Boolean)) pulses.play({ handedness: "none", gamepad });
  pulses.playOnPhone(HAND);
  level *= FALLS;
  for (const [material, light] of lights) light.style.setProperty("--level", material === touched ? Math.min(1, 3 * level).toFixed(2) : 0);
  requestAnimationFrame(draw);
}

function tell(text) {
  byId("told").textContent = text;
}
