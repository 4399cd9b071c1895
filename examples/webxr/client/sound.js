/**
 * Plays touches as sound, from a feel file: `feel.sound.json` for ears and small speakers, `feel.true.json` for a palm speaker on
 * an audio output.
 *
 * The same player that drives motors renders in an AudioWorklet at the output's rate. A touch is heard with the next block of the
 * worklet, 128 samples.
 */
export class FeltSound {
  #node;

  /** Opens the sound of an AudioContext; `feel` is opened by `openFeel`. Connect `output` to hear it. */
  static async open(context, feel) {
    if (!context.audioWorklet) throw new Error('no AudioWorklet on this page: browsers have it on https and localhost only');
    await context.audioWorklet.addModule(new URL('./sound.worklet.js', import.meta.url));
    const sound = new FeltSound();
    sound.#node = new AudioWorkletNode(context, 'hapticvlm-felt', {numberOfInputs: 0, outputChannelCount: [1], processorOptions: {feel}});
    return sound;
  }

  get output() {
    return this.#node;
  }

  /** Plays a touch on a surface: {material, impact_gain?, thickness_m?, hum?}, as `felt.surfaceOf(touch)` returns it. */
  touch(touch, surface) {
    const {phase, hand, interaction, speed_mps, force_n} = touch ?? {}; // a page's own fields may be what no worklet can get
    this.#node.port.postMessage({touch: {phase, hand, interaction, speed_mps, force_n, felt: surface}});
  }

  /** Ends everything within 20 ms; a hand is heard again after its release and a new approach or contact. */
  stop() {
    this.#node.port.postMessage({stop: true});
  }

  close() {
    this.#node.port.postMessage({close: true});
    this.#node.disconnect();
  }
}
