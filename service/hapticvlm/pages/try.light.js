// Shows a touch on the picture itself, as the WebXR example does on its objects: a glow at the finger as strong as the
// vibration, the warmth around it, a ripple at each contact, and the region that is felt.
import { byId, make } from "./dom.js";
import { warmthColour } from "./feel.js";

// Reach (times the finger's width) and duration (s) of a ripple, by how the body feels.
const WAVES = { rings: [17, 1], knocks: [11, 0.7], soft: [5, 0.5] };
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
  const { x: left, y: top, w: width, h: height } = region;
  for (const [side, share] of Object.entries({ left, top, width, height })) byId("region").style[side] = `${100 * share}%`;
  byId("region").dataset.hand = pressed ? "held" : over ? "near" : "away";
  const isWarm = pressed && Boolean(decision?.thermal_cue);
  if (isWarm) byId("tint").style.setProperty("--warmth", warmthColour(decision.setpoint_c));
  byId("tint").classList.toggle("warm", isWarm);
  if (pressed && !isHeld) ripple(place, decision?.feels?.at(-1));
  isHeld = pressed;
  if (!pressed) strength(over ? NEAR : 0);
}

// Sets the glow to a level of the vibration, 0..1.
export function vibrate(level) {
  if (isHeld) strength(0.35 + 0.65 * Math.sqrt(level));
}

const strength = (value) => byId("glow").style.setProperty("--strength", value.toFixed(2));

function ripple({ x, y }, body) {
  if (calm.matches) return;
  const ring = make("i", "", { className: "ripple" });
  const [reach, lasts] = WAVES[body] ?? WAVES.knocks;
  ring.style.setProperty("--reach", reach);
  ring.style.setProperty("--lasts", `${lasts}s`);
  Object.assign(ring.style, { left: `${x}px`, top: `${y}px` });
  ring.addEventListener("animationend", () => ring.remove());
  byId("glow").append(ring);
}
