// Shows a touch on the picture itself, as the WebXR example does on its objects: a glow at the finger as strong as the
// vibration, the warmth around it, a ripple at each contact, and the region that is felt.
import { byId, make } from "./dom.js";
import { warmthColour } from "./feel.js";

// Reach (times the finger's width) and duration (s) of a ripple: stiff materials ring, soft ones thud.
const WAVES = {
  glass: [17, 1], metal: [19, 1.1], ceramic: [15, 0.9], wood: [11, 0.7], stone: [11, 0.65], plastic: [10, 0.6],
  fabric: [5, 0.5], rubber: [5, 0.45], leather: [6, 0.5], paper: [7, 0.5], foliage: [6, 0.5],
};
const USUAL = [9, 0.6];
const NEAR = 0.3; // glow of a hand that does not touch
const calm = matchMedia("(prefers-reduced-motion: reduce)");
let isHeld = false;

// Shows the hand at {x, y} (0..1 of the picture) over its region; `size` is that of the picture on the page, px.
// `decision` may be null.
export function follow({ x, y, over, pressed }, region, decision, size) {
  const place = { x: x * size.width, y: y * size.height };
  for (const light of [byId("tint"), byId("glow")]) {
    light.style.setProperty("--x", `${place.x}px`);
    light.style.setProperty("--y", `${place.y}px`);
  }
  box(byId("region"), region);
  byId("region").dataset.hand = pressed ? "held" : over ? "near" : "away";
  const isWarm = pressed && Boolean(decision?.thermal_cue);
  if (isWarm) byId("tint").style.setProperty("--warmth", warmthColour(decision.setpoint_c));
  byId("tint").classList.toggle("warm", isWarm);
  if (pressed && !isHeld) ripple(place, decision?.felt ?? decision?.material);
  isHeld = pressed;
  if (!pressed) strength(over ? NEAR : 0);
}

// Sets the glow to a level of the vibration, 0..1.
export function vibrate(level) {
  if (isHeld) strength(0.35 + 0.65 * Math.sqrt(level));
}

// Puts an element over a region of the picture.
export function box(element, { x, y, w, h }) {
  Object.assign(element.style, { left: `${100 * x}%`, top: `${100 * y}%`, width: `${100 * w}%`, height: `${100 * h}%` });
}

const strength = (value) => byId("glow").style.setProperty("--strength", value.toFixed(2));

function ripple({ x, y }, material) {
  if (calm.matches) return;
  const ring = make("i", "", { className: "ripple" });
  const [reach, lasts] = WAVES[material] ?? USUAL;
  ring.style.setProperty("--reach", reach);
  ring.style.setProperty("--lasts", `${lasts}s`);
  Object.assign(ring.style, { left: `${x}px`, top: `${y}px` });
  ring.addEventListener("animationend", () => ring.remove());
  byId("glow").append(ring);
}
