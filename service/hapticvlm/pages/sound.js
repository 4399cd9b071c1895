// Plays the service's waveform stream in this browser. Independent of the page.
//
// Browsers allow sound only after a click. Call `take` for each waveform view, and `silence` at a stop and when
// the service is lost. `lagMs` is the approximate delay relative to the palm speaker.

const PIECE_MS = 10; // half the length of a piece: the mean time that a sample waits to be sent
const GLIDE_S = 0.02;
const MAX_GAIN = 2; // relative to the speaker's level, because vibration for a palm is quiet in headphones

export class Sound extends EventTarget {
  #context = null;
  #player = null;
  #gain = null;
  #level = 0.5;
  #inHandMs = null;

  get isOn() { return this.#player !== null; }

  get lagMs() {
    if (this.#inHandMs === null || !this.#context) return null;
    const { outputLatency = 0, baseLatency = 0 } = this.#context;
    return this.#inHandMs + PIECE_MS + 1000 * (outputLatency || baseLatency);
  }

  // Call it from a click. Resolves when sound is on, after the browser has loaded the player. After a `stop`
  // in the meantime it stays off; also after a failure, so that the next click tries again.
  async start() {
    if (this.#context) return;
    const context = (this.#context = new AudioContext({ latencyHint: "interactive" }));
    try {
      const player = context.audioWorklet.addModule(new URL("sound.worklet.js", import.meta.url));
      await Promise.all([context.resume(), player]);
    } catch (error) {
      if (this.#context !== context) return; // `stop` closed it
      this.stop();
      throw error;
    }
    if (this.#context !== context) return;
    this.#gain = new GainNode(context, { gain: this.#strength });
    this.#player = new AudioWorkletNode(context, "stream-player", { numberOfInputs: 0 });
    this.#player.port.onmessage = ({ data }) => {
      this.#inHandMs = data.inHandMs;
      this.dispatchEvent(new CustomEvent("report", { detail: data }));
    };
    this.#player.connect(this.#gain).connect(context.destination);
    this.dispatchEvent(new Event("change"));
  }

  stop() {
    this.#context?.close();
    this.#context = this.#player = this.#gain = this.#inHandMs = null;
    this.dispatchEvent(new Event("change"));
  }

  // The perceived level, 0..1: the gain is its square.
  set level(level) {
    this.#level = level;
    this.#gain?.gain.setTargetAtTime(this.#strength, this.#context.currentTime, GLIDE_S);
  }

  get level() { return this.#level; }

  // The node that carries all sound, for recordings and measurements; null while sound is off.
  get output() { return this.#gain; }

  take({ start, samples, rate_hz: rateHz }) {
    if (start != null) this.#player?.port.postMessage({ start, samples, rateHz });
  }

  silence() {
    this.#player?.port.postMessage({ silence: true });
  }

  get #strength() { return MAX_GAIN * this.#level ** 2; }
}
