// Plays what a participant hears: noise that masks the device or, in a pilot without a device, the
// vibration. A browser allows sound only after a click, so both start with one.
import { byId } from "./dom.js";
import { Sound } from "./sound.js";

const SECONDS = 6;
const FADE_S = 0.3;

export const sound = new Sound();

class Masking {
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

const masking = new Masking();

// Connects the controls; `send` sends the study a command when a participant switches the noise.
export function offerSound(send) {
  byId("masking-on").addEventListener("change", ({ target }) => setMasking(target.checked, send));
  byId("masking-level").addEventListener("input", ({ target }) => masking.setLevel(Number(target.value)));
  byId("hear-on").addEventListener("change", ({ target }) => hear(target.checked));
  byId("hear-level").addEventListener("input", ({ target }) => { sound.level = Number(target.value); });
  addEventListener("pagehide", silence);
}

// Called from clicks that start a pattern or the trials.
export function startSound(view, send) {
  if (view.hear) hear(true);
  else if (view.masking_noise && !masking.isOn) setMasking(true, send);
}

// Ends all sound and clears the noise's check box, without a command to the study.
export function silence() {
  sound.silence();
  if (masking.isOn) setMasking(false);
}

function setMasking(on, send = null) {
  if (on) masking.start(Number(byId("masking-level").value));
  else masking.stop();
  byId("masking-on").checked = on;
  send?.({ do: "masking", on });
}

function hear(on) {
  byId("hear-on").checked = on;
  sound.level = Number(byId("hear-level").value);
  if (on) sound.start().catch(() => (byId("hear-on").checked = false));
  else sound.stop();
}

// Returns pink noise with a peak below 1: white noise through Paul Kellet's filter (coefficients unchecked).
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
