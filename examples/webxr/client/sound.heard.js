/**
 * The touches of both hands as samples for an output that is not a motor, in one of two voices.
 *
 * `true` is what a palm speaker gets. Most of it is below 300 Hz, where small speakers play nothing. `sound` is the same
 * touch moved to where ears and small speakers hear (sound.voice.js). It is rendered at IN_HZ, moved at OUT_HZ, and read at
 * the output's rate through a windowed sinc. It knows no audio node and no clock: times are arguments, in s.
 */
import {FeelPlayer} from './feel.js';
import {IN_HZ, OUT_HZ, SoundVoice, UP} from './sound.voice.js';

const VOICES = ['sound', 'true'];
const ENDS_S = 0.1; // after which a voice that was switched off has faded
const HALF = 8; // taps on either side
const PHASES = 256;
const TABLE = taps();

export class Heard {
  #feel;
  #rate;
  #voice;
  #current;
  #ending = null; // the voice before a switch, which fades
  #endsAt = 0;

  /** `rate` is that of the output, Hz. */
  constructor(feel, rate, voice = 'sound') {
    this.#feel = feel;
    this.#rate = rate;
    this.#voice = checked(voice);
    this.#current = this.#made();
  }

  /** Changes the voice at `now`; a touch that goes on is heard in the new one at its next renewal. */
  setVoice(voice, now) {
    if (checked(voice) === this.#voice) return;
    this.#voice = voice;
    this.#ending = this.#current;
    this.#ending.player.stop();
    this.#endsAt = now + ENDS_S;
    this.#current = this.#made();
  }

  /** Receives a touch with what it feels: {...touch, felt}. */
  touch(touch, now) {
    this.#current.player.touch(touch, now);
  }

  stop() {
    this.#current.player.stop();
  }

  /** Returns the next `count` samples, -1..1; `now` is the time of the first. */
  render(count, now) {
    const wave = this.#current.render(count, now);
    if (this.#ending) this.#ending.render(count, now).forEach((sample, at) => (wave[at] += sample));
    if (now > this.#endsAt) this.#ending = null;
    return wave;
  }

  #made() {
    return this.#voice === 'sound' ? new AsSound(this.#feel, this.#rate) : new AsFelt(this.#feel, this.#rate);
  }
}

class AsFelt {
  constructor(feel, rate) {
    this.player = new FeelPlayer(feel, ({felt}) => felt, {soundHz: rate});
  }

  render(count, now) {
    return this.player.render(count, now);
  }
}

class AsSound {
  #voice = new SoundVoice();
  #step; // samples at OUT_HZ for each of the output
  #line = new Float64Array(2 * HALF); // samples at OUT_HZ that are not yet behind the window
  #at = 0; // position of the next output sample, from the begin of the first full window of the line

  constructor(feel, rate) {
    this.player = new FeelPlayer(feel, ({felt}) => felt, {soundHz: IN_HZ});
    this.#step = OUT_HZ / rate;
  }

  render(count, now) {
    const end = this.#at + count * this.#step;
    const missing = Math.ceil((Math.floor(end) + 2 * HALF - this.#line.length) / UP);
    if (missing > 0) this.#line = joined(this.#line, this.#voice.render(this.player.render(missing, now)));
    const wave = Float64Array.from({length: count}, (_, at) => this.#sample(this.#at + at * this.#step));
    const passed = Math.floor(end);
    this.#line = this.#line.slice(passed);
    this.#at = end - passed;
    return wave;
  }

  #sample(at) {
    const whole = Math.floor(at);
    const row = 2 * HALF * Math.round((at - whole) * PHASES);
    let sum = 0;
    for (let tap = 0; tap < 2 * HALF; tap++) sum += TABLE[row + tap] * this.#line[whole + tap];
    return sum;
  }
}

function checked(voice) {
  if (!VOICES.includes(voice)) throw new Error(`voice: ${voice} is not one of ${VOICES.join(', ')}`);
  return voice;
}

function joined(one, other) {
  const both = new Float64Array(one.length + other.length);
  both.set(one);
  both.set(other, one.length);
  return both;
}

/** Returns (PHASES + 1) rows of 2 * HALF weights; row r is for the position r / PHASES between two samples. */
function taps() {
  const table = new Float64Array((PHASES + 1) * 2 * HALF);
  for (let row = 0; row <= PHASES; row++) {
    for (let tap = 0; tap < 2 * HALF; tap++) {
      const x = tap - HALF + 1 - row / PHASES;
      const sinc = x === 0 ? 1 : Math.sin(Math.PI * x) / (Math.PI * x);
      table[row * 2 * HALF + tap] = sinc * Math.cos((Math.PI * x) / (2 * HALF)) ** 2;
    }
  }
  return table;
}
