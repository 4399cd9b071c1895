/**
 * Plays the service's `vibration` events on the motor of a controller, a gamepad or a phone.
 *
 * Each plan covers at most 100 ms and replaces the one before. Silence follows its end, so the motor stops when the
 * link is lost. A plan has a value every 12.5 ms or less and a page is drawn every 11 to 17 ms. Each picture plays the
 * strongest value since the last picture; otherwise a strike could fall between two of them.
 */
const PULSE_MS = 22; // 1.5 frames at 72 Hz, so that the next call replaces it before it ends
const LONGEST_MS = 150; // longest interval that a late picture covers
const WEAKEST = 0.02;
const PHONE_WEAKEST = 0.1; // a phone's motor is on or off
const MOST_GAIN = 4;

export class Pulses {
  #haptics = null;
  #plans = {left: null, right: null};
  #gain = 1;
  #latest = 'right'; // the hand that vibrated last
  #problem = ''; // why a motor refused its last pulse

  /** Plays the vibration of this connection, and requests it for both hands. */
  follow(haptics) {
    this.#haptics = haptics;
    haptics.addEventListener('vibration', ({detail}) => this.receive(detail));
    haptics.addEventListener('state', ({detail}) => detail === 'disconnected' && this.rest());
    haptics.addEventListener('ownership', ({detail}) => detail.owner || this.rest());
    haptics.feel({left: 'amplitude', right: 'amplitude'});
  }

  /** Factor applied to the vibration, 0 to 4; values above 1 help weak motors. */
  get gain() {
    return this.#gain;
  }

  set gain(value) {
    this.#gain = Math.min(MOST_GAIN, Math.max(0, value));
  }

  /** Receives one `vibration` event. */
  receive({hand, period_ms: period, amplitude = []}) {
    const now = performance.now();
    if (amplitude.length) this.#latest = hand;
    this.#plans[hand] = amplitude.length ? {from: now, played: now, period, amplitude} : null;
  }

  /** Drops the current plan. */
  rest() {
    this.#plans = {left: null, right: null};
  }

  /** Returns the strongest value of this hand since the last call, 0..1. */
  amplitude(hand) {
    const plan = this.#plans[hand];
    if (!plan) return 0;
    const now = performance.now();
    const since = Math.max(plan.played, now - LONGEST_MS);
    plan.played = now;
    const [first, last] = [since, now].map((at) => Math.floor((at - plan.from) / plan.period));
    return Math.min(1, this.#gain * Math.max(0, ...plan.amplitude.slice(first, last + 1)));
  }

  /**
   * Drives the motor of a controller ({handedness, gamepad}, as in WebXR); call it for every picture. One that belongs to
   * neither hand vibrates for the hand that vibrated last.
   */
  play({handedness, gamepad}) {
    const amplitude = this.amplitude(handedness in this.#plans ? handedness : this.#latest);
    if (amplitude > WEAKEST) this.#pulse(motorOf(gamepad), amplitude);
    return amplitude;
  }

  /** Plays a pulse; a motor that refuses it does so in every picture, and is told of by `silence`. */
  #pulse(motor, amplitude) {
    const refused = ({message = 'no reason given'} = {}) => (this.#problem = `the motor refuses to vibrate: ${message}`);
    try {
      motor?.(amplitude)?.then?.(() => (this.#problem = ''), refused);
    } catch (error) {
      refused(error);
    }
  }

  /** Drives a phone held in the hand that touches its screen. */
  playOnPhone(hand = 'right') {
    const amplitude = this.amplitude(hand);
    if (amplitude > PHONE_WEAKEST) globalThis.navigator?.vibrate?.(PULSE_MS);
    return amplitude;
  }

  /** Returns the reason why this controller is silent, in one sentence; empty if there is none. */
  silence(source) {
    if (this.#gain === 0) return 'the gain of the controllers is 0';
    if (this.#haptics?.silence) return this.#haptics.silence;
    if (!source) return 'no controller is connected';
    if (source.hand) return 'a tracked hand holds no controller';
    return motorOf(source.gamepad) ? this.#problem : 'the browser gives this controller no motor';
  }
}

/** Returns the actuator of this gamepad by WebXR or the Gamepad API; null if it has none. */
function motorOf(gamepad) {
  const [pulsed] = gamepad?.hapticActuators ?? [];
  if (pulsed?.pulse) return (amplitude) => pulsed.pulse(amplitude, PULSE_MS);
  const rumble = gamepad?.vibrationActuator;
  if (!rumble?.playEffect) return null;
  return (amplitude) => rumble.playEffect('dual-rumble', {duration: PULSE_MS, strongMagnitude: amplitude, weakMagnitude: amplitude});
}
