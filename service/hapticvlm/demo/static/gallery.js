// The gallery of the materials: touched, heard and felt from a bake, without a service.
//
// Each gesture is a link to itself, such as #glass/strike. A page that is opened by it waits there for Enter or a tap,
// because browsers allow neither sound nor vibration before.
import { Felt, Pulses, openFeel } from "hapticvlm";
import { byId, make } from "./dom.js";
import { materialColour } from "./feel.js";
import { offerSound, sound, startWithTouch } from "./hear.js";
import { BakedWave } from "./scene/webxr/baked.js";

const EVERY_MS = 30; // between two touches of a gesture
const HAND = "right";
const HELD = { speed_mps: 0, force_n: 2 };
const FALLS = 0.8; // share of the level that is left after a picture
// Of each gesture: how long it lasts, s, and its touch at a time, s.
const GESTURES = {
  tap: [0.3, () => ({ phase: "contact", interaction: "tap", speed_mps: 0.25, force_n: 1.5 })],
  strike: [0.4, () => ({ phase: "contact", interaction: "strike", speed_mps: 0.8, force_n: 4 })],
  press: [1, (at) => ({ phase: "contact", interaction: "press", speed_mps: 0.1, force_n: 1 + 11 * at })],
  slide: [1.4, (at) => ({ phase: at ? "slide" : "contact", interaction: "slide", speed_mps: stroke(at, 0.3), force_n: 1.5 })],
  carve: [1.4, (at) => ({ phase: at ? "slide" : "contact", interaction: "carve", speed_mps: stroke(at, 0.2), force_n: 6 })],
  swing: [1, (at) => ({ phase: "approach", interaction: "swing", speed_mps: 5 * Math.sin(Math.PI * Math.min(at, 1)), force_n: 0 })],
};

const tables = openFeel(await (await fetch("scene/webxr/client/feel.json")).json());
export const felt = new Felt(null, tables, { mode: "baked" });
export const pulses = new Pulses();
const wave = new BakedWave(tables, play);
const names = [...tables.materials.keys()];
const lights = new Map(); // material -> its light
let level = 0;
let gesture = null; // {material, kind, from, timer}
let touched = null; // the material whose light shines

pulses.follow(felt);
felt.scene(names.map((material) => ({ object_id: material, material })));
byId("materials").append(...names.map(card));
byId("stop").addEventListener("click", stop);
addEventListener("keydown", (event) => event.key === "Escape" && stop());
addEventListener("hashchange", open);
offerSound();
open();
requestAnimationFrame(draw);

// Shows the moment of the address; its gesture has the focus, so that Enter plays it.
function open() {
  const [material, kind] = decodeURIComponent(location.hash.slice(1)).split("/");
  for (const link of document.querySelectorAll(".opened")) link.classList.remove("opened");
  const link = names.includes(material) && kind in GESTURES ? document.getElementById(`${material}/${kind}`) : null;
  if (link) {
    link.classList.add("opened");
    link.focus();
  }
  if (!gesture) tell(link ? `${material}, ${kind}: press Enter or tap it` : "Press or stroke a surface, or choose a gesture. A gamepad or phone vibrates.");
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
  gestures.append(...Object.keys(GESTURES).map((kind) => gestureLink(material, kind)));
  box.append(make("h2", material), swatch, gestures);
  return box;
}

function gestureLink(material, kind) {
  const link = make("a", kind, { id: `${material}/${kind}`, href: `#${material}/${kind}`, ariaLabel: `${kind} ${material}` });
  link.addEventListener("click", () => {
    startWithTouch();
    begin(material, kind);
  });
  return link;
}

// Plays a gesture; one that is under way ends.
export function begin(material, kind) {
  end();
  const [lasts, touchAt] = GESTURES[kind];
  const from = performance.now();
  const step = () => {
    const at = (performance.now() - from) / 1000;
    if (at > lasts) return end();
    send(material, touchAt(at));
  };
  gesture = { material, timer: setInterval(step, EVERY_MS) };
  send(material, touchAt(0));
  tell(`${material}, ${kind}`);
}

function end() {
  if (!gesture) return;
  clearInterval(gesture.timer);
  send(gesture.material, { phase: "release", speed_mps: 0, force_n: 0 });
  gesture = null;
}

// Speed of a hand that moves to and fro, m/s.
function stroke(at, fastest) {
  return fastest * Math.abs(Math.sin(Math.PI * (at / 0.7)));
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
    send(material, { phase: "contact", interaction: event.shiftKey ? "tap" : "strike", speed_mps: event.shiftKey ? 0.25 : 0.6, force_n: 4 });
    const held = () => send(material, { phase: "contact", ...HELD });
    gesture = { material, timer: setInterval(held, 2 * EVERY_MS) };
    tell(`${material}, your hand`);
  });
  swatch.addEventListener("pointermove", (event) => {
    if (!before || event.timeStamp - before.at < EVERY_MS / 2) return;
    const now = at(event);
    const metres = (Math.hypot(now.x - before.x, now.y - before.y) / 96) * 0.0254; // CSS px
    place(now);
    if (metres) send(material, { phase: "slide", speed_mps: (1000 * metres) / (now.at - before.at), force_n: HELD.force_n });
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
