/** The palm speaker's waveform, of the service by a second, observing connection or of the bake, as sound and light in the page. */
import {sound, speakerIs} from '../../hear.js';
import {Link} from '../../link.js';
import {BakedWave} from './baked.js';

const FULL = 0.35; // share of the speaker's full scale that is shown as strongest
const FALLS = 9; // 1/s, decay of the level
const LEAST = 1e-4; // share of the full level below which it is zero

export class Stream {
  #felt;
  #baked;
  #level = 0;

  /** `felt` tells whether the service or the bake `feel` is played; `url` is null without a service. */
  constructor(felt, feel, url, token) {
    this.#felt = felt;
    this.#baked = new BakedWave(feel, (piece) => felt.by === 'baked' && this.#play(piece));
    if (!url) return;
    const onMessage = (message) => this.#receive(message);
    const onState = (state) => state === 'gone' && felt.by === 'service' && this.silence();
    this.link = new Link(url, {onMessage, onState, token, name: 'webxr sound'});
    this.link.connect();
  }

  /** Returns the current strength of vibration, 0..1; it decays without new samples. */
  level(elapsed) {
    const now = this.#level;
    this.#level *= Math.exp(-FALLS * elapsed);
    return now < LEAST * FULL ? 0 : Math.min(1, now / FULL);
  }

  /** Plays a touch from the bake, if that is what is felt. */
  touch(touch, surface) {
    this.#baked.touch(touch, surface);
  }

  /** Silences at once, for a stop or a lost service. */
  silence() {
    this.#level = 0;
    this.#baked.stop();
    sound.silence();
  }

  #receive(message) {
    if (message.type === 'welcome') {
      speakerIs(message.devices.speaker);
      this.link.ask({type: 'set', watch: ['waveform']});
    }
    if (message.kind === 'waveform' && this.#felt.by === 'service') this.#play(message);
  }

  #play(piece) {
    sound.take(piece);
    for (const sample of piece.samples) this.#level = Math.max(this.#level, Math.abs(sample));
  }
}
