// Plays the service's waveform stream in this browser. Independent of the page.
//
// Browsers allow sound only after a click. Call `take` for each waveform view, and `silence` at a stop and when
// the service is lost. `lagMs` is the approximate delay relative to the palm speaker. `voice` is "sound" (the vibration
// moved to where ears and small speakers hear, sound.voice.js) or "true" (what the palm speaker gets).
import { BufferPlayer } from "./sound.buffers.js";
import { HALF_S, IN_HZ, OUT_HZ, SoundVoice, UP } from "./sound.voice.js";

const PIECE_MS = 10; // half the length of a piece: the mean time that a sample waits to be sent
const GLIDE_S = 0.02;
// Relative to full scale. The true voice is quiet in headphones; the sound voice has its peaks near 0.6.
const MAX_GAIN = { true: 2, sound: 1.5 };

export class Sound extends EventTarget {
  #context = null;
  #player = null;
  #gain = null;
  #level = 0.5;
  #inHandMs = null;
  #voice = "sound";
  #mover = new SoundVoice();
  #next = null; // number of the sample that follows those the mover has

  get isOn() { return this.#player !== null; }

  get lagMs() {
    if (this.#inHandMs === null || !this.#context) return null;
    const { outputLatency = 0, baseLatency = 0 } = this.#context;
    const moving = this.#voice === "sound" ? 1000 * HALF_S : 0;
    return this.#inHandMs + moving + PIECE_MS + 1000 * (outputLatency || baseLatency);
  }

  // Call it from a click. Resolves when sound is on, after the browser has loaded the player. After a `stop`
  // in the meantime it stays off; also after a failure, so that the next click tries again.
  async start() {
    if (this.#context) return;
    const context = (this.#context = new AudioContext({ latencyHint: "interactive" }));
    const report = (data) => {
      this.#inHandMs = data.inHandMs;
      this.dispatchEvent(new CustomEvent("report", { detail: data }));
    };
    let player = null;
    try {
      [player] = await Promise.all([playerOf(context, report), context.resume()]);
    } catch (error) {
      if (this.#context !== context) return; // `stop` closed it
      this.stop();
      throw error;
    }
    if (this.#context !== context) return;
    this.#gain = new GainNode(context, { gain: this.#strength });
    this.#player = player;
    this.#player.connect(this.#gain).connect(context.destination);
    this.dispatchEvent(new Event("change"));
  }

  stop() {
    this.#player?.disconnect();
    this.#context?.close();
    this.#context = this.#player = this.#gain = this.#inHandMs = null;
    this.dispatchEvent(new Event("change"));
  }

  // The perceived level, 0..1: the gain is its square.
  set level(level) {
    this.#level = level;
    this.#glide();
  }

  get level() { return this.#level; }

  set voice(voice) {
    if (voice === this.#voice) return;
    this.silence();
    this.#voice = voice;
    this.#glide();
    this.dispatchEvent(new Event("change"));
  }

  get voice() { return this.#voice; }

  // The node that carries all sound, for recordings and measurements; null while sound is off.
  get output() { return this.#gain; }

  take({ start, samples, rate_hz: rateHz }) {
    if (start == null || !this.#player) return;
    this.#player.send(this.#voice === "sound" && rateHz === IN_HZ ? this.#moved(start, samples) : { start, samples, rateHz });
  }

  silence() {
    this.#next = null;
    this.#player?.send({ silence: true });
  }

  // Returns the piece as sound; samples that the mover had already are left out, and a gap begins it anew.
  #moved(start, samples) {
    const known = this.#next === null ? 0 : this.#next - start;
    if (this.#next === null || known < 0 || known > IN_HZ) this.#mover = new SoundVoice();
    const begin = Math.max(0, known > IN_HZ ? 0 : known);
    this.#next = start + Math.max(begin, samples.length);
    return { start: UP * (start + begin), samples: this.#mover.render(samples.slice(begin)), rateHz: OUT_HZ };
  }

  #glide() { this.#gain?.gain.setTargetAtTime(this.#strength, this.#context.currentTime, GLIDE_S); }

  get #strength() { return MAX_GAIN[this.#voice] * this.#level ** 2; }
}

// Returns a player of this context: `connect`, `disconnect` and `send` a piece.
async function playerOf(context, onReport) {
  if (!context.audioWorklet) return new BufferPlayer(context, onReport);
  await context.audioWorklet.addModule(new URL("sound.worklet.js", import.meta.url));
  const node = new AudioWorkletNode(context, "stream-player", { numberOfInputs: 0 });
  node.port.onmessage = ({ data }) => onReport(data);
  node.send = (message) => node.port.postMessage(message);
  return node;
}
