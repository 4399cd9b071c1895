/**
 * The service's `vibration` events, played on what people own: a controller's motor, a gamepad's or a phone's.
 *
 * Each plan covers at most 100 ms and replaces the one before; after it there is silence, so a lost link ends by
 * itself. A plan has a value each 12.5 ms or less and a page is drawn every 11 to 17 ms: each picture plays the
 * strongest value since the picture before it, else a strike would now and then fall between two of them.
 */
const PULSE_MS = 22; // a frame and a half at 72 Hz: the next call takes over before it ends
const LONGEST_MS = 150; // what a picture that comes later makes up for
const WEAKEST = 0.02;
const PHONE_WEAKEST = 0.1; // a phone's motor is on or off
const MOST_GAIN = 4;

export class Pulses {
  #haptics = null;
  #plans = {left: null, right: null};
  #gain = 1;

  /** Plays the vibration of this connection, and asks for it for both hands. */
  follow(haptics) {
    this.#haptics = haptics;
    haptics.addEventListener('vibration', ({detail}) => this.receive(detail));
    haptics.addEventListener('state', ({detail}) => detail === 'disconnected' && this.rest());
    haptics.addEventListener('ownership', ({detail}) => detail.owner || this.rest());
    haptics.feel({left: 'amplitude', right: 'amplitude'});
  }

  /** Times what the service sends, 0 to 4: more makes weak motors felt. */
  get gain() {
    return this.#gain;
  }

  set gain(value) {
    this.#gain = Math.min(MOST_GAIN, Math.max(0, value));
  }

  /** Receives one `vibration` event. */
  receive({hand, period_ms: period, amplitude = []}) {
    const now = performance.now();
    this.#plans[hand] = amplitude.length ? {from: now, played: now, period, amplitude} : null;
  }

  /** Forgets what was planned. */
  rest() {
    this.#plans = {left: null, right: null};
  }

  /** The strongest that this hand felt since the last call, 0..1. */
  amplitude(hand) {
    const plan = this.#plans[hand];
    if (!plan) return 0;
    const now = performance.now();
    const since = Math.max(plan.played, now - LONGEST_MS);
    plan.played = now;
    const [first, last] = [since, now].map((at) => Math.floor((at - plan.from) / plan.period));
    return Math.min(1, this.#gain * Math.max(0, ...plan.amplitude.slice(first, last + 1)));
  }

  /** Moves the motor of a controller ({handedness, gamepad}, as WebXR has it); call it for every picture. */
  play({handedness, gamepad}) {
    const amplitude = this.amplitude(handedness);
    if (amplitude > WEAKEST) motorOf(gamepad)?.(amplitude);
    return amplitude;
  }

  /** The same on a phone held in the hand that touches its screen. */
  playOnPhone(hand = 'right') {
    const amplitude = this.amplitude(hand);
    if (amplitude > PHONE_WEAKEST) globalThis.navigator?.vibrate?.(PULSE_MS);
    return amplitude;
  }

  /** Why this controller is silent, in one sentence; empty when nothing stands in the way. */
  silence(source) {
    if (this.#gain === 0) return 'the gain of the controllers is 0';
    if (this.#haptics?.silence) return this.#haptics.silence;
    if (!source) return 'no controller is connected';
    if (source.hand) return 'a tracked hand holds no controller';
    return motorOf(source.gamepad) ? '' : 'the browser gives this controller no motor';
  }
}

/** What makes this gamepad vibrate, in the words of WebXR or of the Gamepad API; null: nothing. */
function motorOf(gamepad) {
  const [pulsed] = gamepad?.hapticActuators ?? [];
  if (pulsed?.pulse) return (amplitude) => pulsed.pulse(amplitude, PULSE_MS);
  const rumble = gamepad?.vibrationActuator;
  if (!rumble?.playEffect) return null;
  return (amplitude) => rumble.playEffect('dual-rumble', {duration: PULSE_MS, strongMagnitude: amplitude, weakMagnitude: amplitude});
}
