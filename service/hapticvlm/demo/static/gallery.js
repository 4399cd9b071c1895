// A photograph whose things we labelled, and the gallery of the materials: touched, heard and felt from a bake, without a service.
//
// Each gesture is a link to itself, such as #glass/strike (moments.js). A page that is opened by it waits there for Enter or
// a tap.
import { Felt, Pulses, openFeel } from "hapticvlm";
import { byId, copyAddress, make } from "./dom.js";
import { materialColour } from "./feel.js";
import { offerSound, sound, startWithTouch } from "./hear.js";
import { BakedWave } from "./scene/webxr/baked.js";
import { thingAt, thingsOf } from "./try.things.js";
import { KINDS, playMoment, readMoment, usualMoment, writeMoment } from "./scene/webxr/moments.js";

const EVERY_MS = 30; // between two touches of a hand
const HAND = "right";
const STRIKE = { kind: "strike", speed: 0.6, force: 4 };
const TAP = { kind: "tap", speed: 0.25, force: 1.5 };
const HELD = { speed_mps: 0, force_n: 2 };
const FASTEST = 20; // m/s, of the protocol
const FALLS = 0.8; // share of the level that is left after a picture

const tables = openFeel(await (await fetch("scene/webxr/client/feel.true.json")).json());
export const felt = new Felt(null, tables, { mode: "baked" });
export const pulses = new Pulses();
const wave = new BakedWave(tables, play);
const names = [...tables.materials.keys()];
let level = 0;
let gesture = null; // ends what is under way
let opened = null; // the moment of the address
let asked = null; // the moment that waits for the sound
let newest = null; // the moment of the newest touch
let light = null; // of the surface that is touched

pulses.follow(felt);
felt.scene(names.map((material) => ({ object_id: material, material })));
offerPhoto(byId("photo"));
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
  let words = "Press or stroke the picture or a surface, or choose a gesture.";
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
  Object.assign(byId("link"), { textContent: "Copy link", disabled: false });
}

function card(material) {
  const box = make("article", "", { id: material });
  const swatch = make("div", "", { className: "swatch" });
  swatch.append(make("i"));
  swatch.style.setProperty("--colour", materialColour(material));
  offerHand(swatch, () => material);
  const gestures = make("div", "", { className: "gestures" });
  gestures.append(...KINDS.map((kind) => gestureLink(material, kind)));
  box.append(make("h2", material), swatch, gestures);
  return box;
}

// Makes each thing on the photograph a surface of its material; the thing under the hand lights up.
function offerPhoto(photo) {
  const things = thingsOf("table");
  let thing = things[0];
  const find = ({ offsetX: x, offsetY: y }) => (thing = thingAt(things, { x: x / photo.clientWidth, y: y / photo.clientHeight }) ?? thing);
  photo.addEventListener("pointermove", (event) => byId("lit").setAttribute("points", find(event).points.join(" ")));
  offerHand(photo, (event) => find(event).material);
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
  shine(byId(moment.target));
  gesture = playMoment(moment, (fields) => send(moment.target, fields), () => (gesture = null));
  remember(moment);
  tell(titled(moment));
}

// Lets the light of a surface follow the vibration.
function shine(surface) {
  light?.style.setProperty("--level", 0);
  light = surface.querySelector("i");
}

function end() {
  asked = null;
  gesture?.();
}

function titled({ target, kind }) {
  return `${target}, ${kind}`;
}

// Makes a swatch a surface: a press strikes it, a drag strokes it at its speed on the screen. `materialAt` returns the
// material at a pointer's event.
function offerHand(swatch, materialAt) {
  let before = null; // {x, y, at}
  let material = null;
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
    material = materialAt(event);
    shine(swatch);
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
    material = materialAt(event);
    tell(`${material}, your hand`);
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
  light?.style.setProperty("--level", Math.min(1, 3 * level).toFixed(2));
  requestAnimationFrame(draw);
}

function tell(text) {
  byId("told").textContent = text;
}
