// The vibration, heard: plays the service's waveform stream in this browser. Knows nothing of the page.
//
// A browser lets sound begin only after a click. `take` each waveform view; `silence` at a stop and when the
// service is gone. `lagMs` is about how long after the palm speaker it sounds.

const PIECE_MS = 10; // half a piece: a sample waits on average so long to be sent
const GLIDE_S = 0.02;
const LOUDEST = 2; // of the speaker's own level: what a palm feels is quiet in headphones

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

  // Call it from a click. Resolves when sound is on, whatever the browser has to load first. After a `stop`
  // meanwhile it stays off; after a failure, too, so that a next click tries anew.
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

  // 0..1, as it is heard: the gain is its square.
  set level(level) {
    this.#level = level;
    this.#gain?.gain.setTargetAtTime(this.#strength, this.#context.currentTime, GLIDE_S);
  }

  get level() { return this.#level; }

  // The node that all sound goes through, for who records or measures it; null while it is off.
  get output() { return this.#gain; }

  take({ start, samples, rate_hz: rateHz }) {
    if (start != null) this.#player?.port.postMessage({ start, samples, rateHz });
  }

  silence() {
    this.#player?.port.postMessage({ silence: true });
  }

  get #strength() { return LOUDEST * this.#level ** 2; }
}
