// Shows once how a picture is touched: a drawn hand comes, taps a place, strokes it and goes. A person's own hand ends it.
import { byId } from "./dom.js";
import { hand, lift, place, press } from "./try.hand.js";

const TICK_MS = 30;
const COMES_MS = 900;
const RESTS_MS = 350;
const STROKES_MS = 1500;
const START = { x: 1, y: 1 };
export const SPOT = { x: 0.41, y: 0.38 }; // the kettle on the table
const STROKE = 0.06; // of the picture, to each side

// Touches `spot` ({x, y}, 0..1 of the picture); `onMove` is called on changes. A browser set to less motion shows nothing.
export function touchOnce(spot, { width, height }, onMove) {
  if (matchMedia("(prefers-reduced-motion: reduce)").matches || hand.pointed) return;
  const drawn = byId("shown-hand");
  const began = performance.now();
  Object.assign(hand, { isShown: true, over: true, pointed: true, ...START });
  drawn.toggleAttribute("hidden", false);
  const timer = setInterval(() => {
    const ms = performance.now() - began;
    const isOver = ms > COMES_MS + RESTS_MS + STROKES_MS;
    if (hand.isShown && !isOver) {
      const { x, y } = placeAt(ms, spot);
      place(x, y, height / width);
      Object.assign(drawn.style, { left: `${100 * x}%`, top: `${100 * y}%` });
      if (ms > COMES_MS) press();
    } else {
      clearInterval(timer);
      drawn.toggleAttribute("hidden", true);
      if (hand.isShown) {
        lift();
        Object.assign(hand, { isShown: false, over: false });
      }
    }
    onMove();
  }, TICK_MS);
}

// Returns where the hand is after `ms`: on its way, at rest after the tap, or stroking.
function placeAt(ms, { x, y }) {
  const came = 1 - (1 - Math.min(1, ms / COMES_MS)) ** 3;
  const stroked = Math.max(0, ms - COMES_MS - RESTS_MS) / STROKES_MS;
  return { x: START.x + came * (x - START.x) + STROKE * Math.sin(4 * Math.PI * stroked), y: START.y + came * (y - START.y) };
}
