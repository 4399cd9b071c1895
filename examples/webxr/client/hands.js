/**
 * Makes two hands of all input sources. A runtime may list several for one hand, a tracked hand beside the controller that
 * it holds, in any order. While one of them touches, the others of that hand are not felt; a hand whose source vanishes
 * while it touches is released.
 */
const STILL = {phase: 'release', speed_mps: 0, force_n: 0};

export class Hands {
  #send;
  #touching = {left: null, right: null}; // the source that touches with this hand

  /** `send(touch, source)` sends a touch of one hand, as `(touch) => haptics.touch(touch)`. */
  constructor(send) {
    this.#send = send;
  }

  /**
   * Takes what each source does in this picture: [{source, touches}]. Sources are those of an XR session or any others
   * with a `handedness`; `touches` are new touches without their hand, often none. Call it with all sources.
   */
  step(sources) {
    for (const [hand, touching] of Object.entries(this.#touching)) {
      if (touching && !sources.some(({source}) => source === touching)) this.#pass(touching, hand, STILL);
    }
    for (const {source, touches} of sources) {
      for (const touch of touches) this.#pass(source, handOf(source), touch);
    }
  }

  #pass(source, hand, touch) {
    const touching = this.#touching[hand];
    if (touching && touching !== source) return;
    if (touch.phase === 'release') this.#touching[hand] = null;
    else if (touch.phase !== 'approach') this.#touching[hand] = source;
    this.#send({...touch, hand}, source);
  }
}

/** Returns the hand of a source; one that belongs to neither counts as the right hand. */
function handOf({handedness}) {
  return handedness === 'left' ? 'left' : 'right';
}
