/**
 * Plays touches as sound, from the tables of a bake: for speakers and headphones, or for a palm speaker on an audio output.
 *
 * The same player that drives motors renders in an AudioWorklet at the output's rate. In the true voice a touch is heard
 * with the next block of the worklet, 128 samples, and as sound 24 ms later.
 */
export class FeltSound {
  #node;
  #voice;

  /**
   * Opens the sound of an AudioContext; `feel` is opened by `openFeel`. Connect `output` to hear it. `voice` is `sound`
   * (audible on ears and small speakers), or `true` for a palm speaker.
   */
  static async open(context, feel, {voice = 'sound'} = {}) {
    if (!context.audioWorklet) throw new Error('no AudioWorklet on this page: browsers have it on https and localhost only');
    await context.audioWorklet.addModule(new URL('./sound.worklet.js', import.meta.url));
    const sound = new FeltSound();
    sound.#voice = voice;
    sound.#node = new AudioWorkletNode(context, 'hapticvlm-felt', {numberOfInputs: 0, outputChannelCount: [1], processorOptions: {feel, voice}});
    return sound;
  }

  get output() {
    return this.#node;
  }

  /** `sound` or `true`; what is heard fades and goes on in the other voice. */
  get voice() {
    return this.#voice;
  }

  set voice(voice) {
    if (voice !== 'sound' && voice !== 'true') throw new Error(`voice: ${voice} is not one of sound, true`);
    this.#voice = voice;
    this.#node.port.postMessage({voice});
  }

  /** Plays a touch on a surface: {material, impact_gain?, thickness_m?, hum?}, as `felt.surfaceOf(touch)` returns it. */
  touch(touch, surface) {
    this.#node.port.postMessage({touch: {...touch, felt: surface}});
  }

  /** Ends everything within 20 ms, as sound 24 ms later; a hand is heard again after its release and a new approach or contact. */
  stop() {
    this.#node.port.postMessage({stop: true});
  }

  close() {
    this.#node.port.postMessage({close: true});
    this.#node.disconnect();
  }
}
