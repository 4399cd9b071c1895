/**
 * The wave of touches that a bake plays, in numbered pieces of the true voice, as the service streams its own. The page
 * can then play and show both alike.
 */
import {FeelPlayer} from 'hapticvlm';

const RATE_HZ = 3000;
const EVERY_MS = 10;
const LONGEST_S = 0.5; // of one piece; a page that slept longer skips the rest
const FIRST = 1e9; // number of the first sample, far from those of a service

export class BakedWave {
  #player;
  #receive;
  #until = 0; // samples since the page began that are rendered

  /** `feel` is opened by `openFeel`; `receive` gets {start, samples, rate_hz} a hundred times a second. */
  constructor(feel, receive) {
    this.#player = new FeelPlayer(feel, ({felt}) => felt, {soundHz: RATE_HZ});
    this.#receive = receive;
    setInterval(() => this.#step(), EVERY_MS);
  }

  /** Plays a touch on a surface, as `felt.surfaceOf(touch)` returns it. */
  touch(touch, surface) {
    this.#player.touch({...touch, felt: surface}, performance.now() / 1000);
  }

  stop() {
    this.#player.stop();
  }

  #step() {
    const now = Math.floor((performance.now() / 1000) * RATE_HZ);
    const start = Math.max(this.#until, now - LONGEST_S * RATE_HZ);
    this.#until = now;
    if (now <= start) return;
    const samples = Float32Array.from(this.#player.render(now - start, start / RATE_HZ));
    this.#receive({start: FIRST + start, samples, rate_hz: RATE_HZ});
  }
}
