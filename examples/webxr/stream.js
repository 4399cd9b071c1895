/** Receives the palm speaker's waveform by a second, observing connection, for sound and light in the page. */
import {sound, speakerIs} from '/hear.js';
import {Link} from '/link.js';

const FULL = 0.35; // share of the speaker's full scale that is shown as strongest
const FALLS = 9; // 1/s, decay of the level
const LEAST = 1e-4; // share of the full level below which it is zero

export class Stream {
  #level = 0;

  constructor(url, token) {
    const onMessage = (message) => this.#receive(message);
    const onState = (state) => state === 'gone' && this.silence();
    this.link = new Link(url, {onMessage, onState, token, name: 'webxr sound'});
    this.link.connect();
  }

  /** Returns the current strength of vibration, 0..1; it decays without new samples. */
  level(elapsed) {
    const now = this.#level;
    this.#level *= Math.exp(-FALLS * elapsed);
    return now < LEAST * FULL ? 0 : Math.min(1, now / FULL);
  }

  /** Silences at once, for a stop or a lost service. */
  silence() {
    this.#level = 0;
    sound.silence();
  }

  #receive(message) {
    if (message.type === 'welcome') {
      speakerIs(message.devices.speaker);
      this.link.ask({type: 'set', watch: ['waveform']});
    }
    if (message.kind !== 'waveform') return;
    sound.take(message);
    for (const sample of message.samples) this.#level = Math.max(this.#level, Math.abs(sample));
  }
}
