// Noise for the participant's headphones, so that patterns are felt and not heard.
const SECONDS = 6;
const FADE_S = 0.3;

export class Masking {
  #context = null;
  #gain = null;

  get isOn() { return this.#context !== null; }

  start(level) {
    if (this.isOn) return;
    this.#context = new AudioContext();
    const source = new AudioBufferSourceNode(this.#context, { buffer: pink(this.#context), loop: true });
    this.#gain = new GainNode(this.#context, { gain: 0 });
    source.connect(this.#gain).connect(this.#context.destination);
    source.start();
    this.setLevel(level);
  }

  setLevel(level) {
    this.#gain?.gain.setTargetAtTime(level, this.#context.currentTime, FADE_S / 3);
  }

  stop() {
    this.#context?.close();
    this.#context = this.#gain = null;
  }
}

// Pink by Paul Kellet's filter of white noise (from memory), peak below 1.
function pink(context) {
  const buffer = new AudioBuffer({ length: SECONDS * context.sampleRate, sampleRate: context.sampleRate });
  const samples = buffer.getChannelData(0);
  let [low, middle, high] = [0, 0, 0];
  for (let at = 0; at < samples.length; at++) {
    const white = 2 * Math.random() - 1;
    low = 0.99765 * low + 0.099046 * white;
    middle = 0.963 * middle + 0.2965164 * white;
    high = 0.57 * high + 1.0526913 * white;
    samples[at] = Math.max(-1, Math.min(1, 0.15 * (low + middle + high + 0.1848 * white)));
  }
  return buffer;
}
