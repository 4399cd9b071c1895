// Turns pointer, finger or keyboard into a hand over the picture: its position, speed and pressure.
//
// `hand` holds the state: x, y (0..1 of the picture), size (share of its shorter side), over, pressed and
// `presses` (their number), pointed (the user has pointed at this picture); `isShown` while the page moves it itself; `speed` returns m/s. `onMove` is called on changes. The
// picture is assumed to be WIDE_M wide: our choice.
const WIDE_M = 0.3;
const SIZES = { least: 0.08, first: 0.5, most: 0.9 };
const STEP = 0.04; // share of the picture per arrow key
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const FORGOTTEN_MS = 120; // a resting pointer sends no events, so its speed ends after this time

export const hand = { x: 0.5, y: 0.5, size: SIZES.first, over: false, pressed: false, presses: 0, pointed: false, pressure: 0, isShown: false, pressedAt: 0 };
let moved = { at: 0, mps: 0 };
let pinned = { x: 0.5, y: 0.5 }; // the last pressed position, which a button outside the picture refers to

export function offerHand(canvas, onMove, onSound) {
  const follow = (event) => {
    const box = canvas.getBoundingClientRect();
    place((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height, box.height / box.width);
    hand.isShown = false;
    hand.over = hand.pointed = true;
    hand.pressure = event.pressure;
    onMove();
  };
  canvas.addEventListener("pointermove", follow);
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    onSound();
    follow(event);
    press();
    onMove();
  });
  const release = () => {
    if (hand.isShown) return;
    lift();
    onMove();
  };
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(end, release);
  canvas.addEventListener("pointerleave", () => {
    if (hand.isShown) return;
    hand.over = hand.pressed;
    if (!hand.over) Object.assign(hand, pinned);
    onMove();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    resize(event.deltaY < 0 ? 1.15 : 1 / 1.15, onMove);
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => onKey(event, canvas, onMove, onSound));
  canvas.addEventListener("keyup", (event) => event.key === " " && release());
  canvas.addEventListener("blur", () => {
    if (!hand.isShown) hand.over = false;
    release();
  });
  addEventListener("blur", release);
}

// Metres a second now: a pointer that has not moved for a while rests.
export const speed = () => (performance.now() - moved.at > FORGOTTEN_MS ? 0 : moved.mps);

// Returns the region round a place (the hand's by default) in fractions of a picture of this size; it is square in pixels.
export function region({ width, height }, { x, y, size } = hand) {
  const side = size * Math.min(width, height);
  const w = side / width;
  const h = side / height;
  return { x: clamp(x - w / 2, 0, 1 - w), y: clamp(y - h / 2, 0, 1 - h), w, h };
}

export function press() {
  if (!hand.pressed) {
    hand.pressedAt = performance.now();
    hand.presses++;
  }
  hand.pressed = true;
}

export function lift() {
  if (hand.pressed) pinned = { x: hand.x, y: hand.y };
  hand.pressed = false;
}

export function place(x, y, ratio = 1) {
  const now = performance.now();
  const distance = Math.hypot(x - hand.x, (y - hand.y) * ratio) * WIDE_M;
  const seconds = Math.max(0.008, (now - moved.at) / 1000);
  const mps = seconds > FORGOTTEN_MS / 1000 ? 0.1 : distance / seconds;
  if (distance > 0) moved = { at: now, mps: 0.5 * moved.mps + 0.5 * mps };
  hand.x = clamp(x, 0, 1);
  hand.y = clamp(y, 0, 1);
}

function onKey(event, canvas, onMove, onSound) {
  const step = KEYS[event.key];
  if (step) place(hand.x + STEP * step[0], hand.y + STEP * step[1], canvas.height / canvas.width);
  else if (event.key === "+" || event.key === "-") return resize(event.key === "+" ? 1.15 : 1 / 1.15, onMove);
  else if (event.key === " ") {
    if (!event.repeat) onSound();
    press();
  } else return;
  event.preventDefault();
  hand.isShown = false;
  hand.over = hand.pointed = true;
  onMove();
}

function resize(factor, onMove) {
  hand.size = clamp(hand.size * factor, SIZES.least, SIZES.most);
  onMove();
}

const clamp = (value, least, most) => Math.min(most, Math.max(least, value));
