/**
 * The service's `vibration` events, played on what people own: a controller's motor, or a phone. Each plan covers at
 * most 100 ms and replaces the one before; after it there is silence, so a lost link ends by itself.
 */
const PULSE_MS = 22; // a frame and a half at 72 Hz: the next call takes over before it ends
const WEAKEST = 0.02;
const PHONE_WEAKEST = 0.1; // a phone's motor is on or off

export class Pulses {
  #plans = {left: null, right: null};

  /** Receives one `vibration` event. */
  receive({hand, period_ms: period, amplitude = []}) {
    this.#plans[hand] = amplitude.length ? {from: performance.now(), period, amplitude} : null;
  }

  /** What this hand feels now, 0..1. */
  amplitude(hand) {
    const plan = this.#plans[hand];
    if (!plan) return 0;
    return plan.amplitude[Math.floor((performance.now() - plan.from) / plan.period)] ?? 0;
  }

  /** Moves the motor of this hand's controller; call it every XR frame. */
  play({handedness, gamepad}) {
    const amplitude = this.amplitude(handedness);
    const motor = gamepad?.hapticActuators?.[0];
    if (amplitude > WEAKEST) motor?.pulse(Math.min(1, amplitude), PULSE_MS);
    return amplitude;
  }

  /** The same on a phone held in the hand that touches its screen. */
  playOnPhone() {
    if (this.amplitude('right') > PHONE_WEAKEST) navigator.vibrate?.(PULSE_MS);
  }
}
