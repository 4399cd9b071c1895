// Plays the stream by buffers that the page schedules: where the browser has no audio worklets, as on plain http by
// a network address. A timer of the page fills them, so they are scheduled further ahead than a worklet needs.
import { StreamPlayer } from "./sound.stream.js";

const BLOCK = 1024; // samples
const AHEAD_S = 0.08;
const EVERY_MS = 15;
const FADE_S = 0.004;

export class BufferPlayer {
  #context;
  #player;
  #timer;
  #target = null;
  #gate = null; // carries the buffers that are scheduled; a stop closes it and opens another one
  #next = 0; // time at which the next buffer begins

  constructor(context, onReport) {
    this.#context = context;
    this.#player = new StreamPlayer(context.sampleRate, ({ inHandMs, peak }) => onReport({ inHandMs: inHandMs === null ? null : inHandMs + 1000 * AHEAD_S, peak }));
  }

  connect(node) {
    this.#target = node;
    this.#gate = new GainNode(this.#context);
    this.#gate.connect(node);
    this.#timer = setInterval(() => this.#schedule(), EVERY_MS);
    return node;
  }

  disconnect() {
    clearInterval(this.#timer);
  }

  send(message) {
    if (message.silence) this.#closeGate();
    this.#player.receive(message);
  }

  #schedule() {
    const now = this.#context.currentTime;
    if (this.#next < now) this.#next = now + AHEAD_S / 2; // the timer was late, or the tab in the background
    while (this.#next < now + AHEAD_S) {
      const buffer = new AudioBuffer({ length: BLOCK, sampleRate: this.#context.sampleRate });
      if (!this.#player.fill(buffer.getChannelData(0), this.#next)) {
        const source = new AudioBufferSourceNode(this.#context, { buffer });
        source.connect(this.#gate);
        source.start(this.#next);
      }
      this.#next += buffer.duration;
    }
  }

  // What is scheduled already would sound on after a stop.
  #closeGate() {
    const closed = this.#gate;
    closed.gain.setTargetAtTime(0, this.#context.currentTime, FADE_S);
    setTimeout(() => closed.disconnect(), 1000 * AHEAD_S);
    this.#gate = new GainNode(this.#context);
    this.#gate.connect(this.#target);
  }
}
