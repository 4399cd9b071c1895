/** What the palm speaker plays, played here and turned into light: a second connection, which only watches. */
import {sound, speakerIs} from '/hear.js';
import {Link} from '/link.js';

const FULL = 0.35; // of the speaker's full scale: what counts as strong in a picture
const FALLS = 9; // 1/s, of the level once it is quiet
const LEAST = 1e-4; // of the full level: less is none

export class Stream {
  #level = 0;

  constructor(url, token) {
    const onMessage = (message) => this.#receive(message);
    const onState = (state) => state === 'gone' && this.silence();
    this.link = new Link(url, {onMessage, onState, token, name: 'webxr sound'});
    this.link.connect();
  }

  /** How strongly it vibrates now, 0..1; falls off when nothing comes. */
  level(elapsed) {
    const now = this.#level;
    this.#level *= Math.exp(-FALLS * elapsed);
    return now < LEAST * FULL ? 0 : Math.min(1, now / FULL);
  }

  /** At once: a stop, or no service. */
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
