// Plays the vibration on the user's gamepad or phone. A gamepad plays the strongest amplitude of a plan.
//
// A phone vibrates or not: it vibrates for as long as the plan is above PHONE_THRESHOLD.
const PHONE_THRESHOLD = 0.2;
const PIECE_MS = 100; // of a plan that is known as a whole
let played = "no vibrating device; press a button of a gamepad to activate it";
let accompanied = null; // the newest call of `accompany`

export const plays = () => played;

export function take({ period_ms: period = 0, amplitude = [] }) {
  const lasts = Math.round(period * amplitude.length);
  const strongest = Math.max(0, ...amplitude);
  for (const pad of (navigator.getGamepads?.() ?? []).filter(Boolean)) rumble(pad, strongest, lasts);
  if (navigator.userActivation?.hasBeenActive && matchMedia("(pointer: coarse)").matches) buzz(amplitude, period);
}

// Plays the plan of a whole sound (an audio element) with it, until it pauses or ends.
export function accompany(sound, { period_ms: period, amplitude }) {
  const call = (accompanied = {});
  const length = PIECE_MS / period;
  let next = 0;
  const step = () => {
    if (accompanied !== call) return; // another sound plays
    if (sound.paused) return take({});
    const at = Math.floor((1000 * sound.currentTime) / period);
    if (at >= next || at < next - length) {
      next = at + length;
      take({ period_ms: period, amplitude: amplitude.slice(at, next) });
    }
    requestAnimationFrame(step);
  };
  step();
}

function rumble(pad, strength, duration) {
  const motor = pad.vibrationActuator;
  if (!motor) return;
  played = `plays on ${pad.id.replace(/\(.*/, "").trim()}`;
  if (!strength) motor.reset();
  else motor.playEffect("dual-rumble", { duration, strongMagnitude: strength, weakMagnitude: strength });
}

function buzz(amplitude, period) {
  if (!navigator.vibrate) return;
  played = "plays on this phone, if it can vibrate";
  const on = amplitude.filter((value) => value >= PHONE_THRESHOLD).length * period;
  navigator.vibrate(on ? Math.round(on) : 0);
}
