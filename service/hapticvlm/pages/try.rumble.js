// The vibration on what a visitor holds: a gamepad, or a phone. Each plays the strongest of a plan.
//
// A phone can only be on or off: it buzzes for as long as the plan is above PHONE_LEAST.
const PHONE_LEAST = 0.2;
let played = "nothing here vibrates; press a button of a gamepad to wake it";

export const plays = () => played;

export function take({ period_ms: period = 0, amplitude = [] }) {
  const lasts = Math.round(period * amplitude.length);
  const strongest = Math.max(0, ...amplitude);
  for (const pad of (navigator.getGamepads?.() ?? []).filter(Boolean)) rumble(pad, strongest, lasts);
  if (navigator.userActivation?.hasBeenActive && matchMedia("(pointer: coarse)").matches) buzz(amplitude, period);
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
  played = "plays on this phone, where it vibrates";
  const on = amplitude.filter((value) => value >= PHONE_LEAST).length * period;
  navigator.vibrate(on ? Math.round(on) : 0);
}
