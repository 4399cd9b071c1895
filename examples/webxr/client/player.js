/**
 * Plays a feel file of `hapticvlm bake` without a service, for pads or as samples; docs/player.md explains each rule.
 *
 * It knows no clock, no socket and no motor: times are arguments, in s of any one clock.
 */
import {addSamples} from './clips.js';
import {IMPACTS, TEXTURES, Voices} from './voices.js';

const SOON = 1e-9;
const LONGEST_RUN_S = 0.5;
const MOST_DRIVES = 16;
const MOST_DRIVE = 100;
const MILLISECONDS = [5, 1000]; // "s" between two touches of a slide, which are ms
const MOST_GAPS = 3;
const MOST_SAMPLES = 1e6; // of one call
const FORMS = ['amplitude', 'parametric'];

/** The two hands of one scene: receives touches, gives plans or samples. */
export class FeelPlayer {
  /** Factor of everything, 0 to 1. */
  gain = 1;
  /** Fields of a touch or surface of which a problem was said. */
  said = new Set();
  #rules;
  #feel;
  #surfaceOf;
  #rate;
  #say;
  #voices;
  #hands;
  #turn = 0; // of the shift of the sound voice
  #held = 0; // level that the compression of the sound voice follows
  #compression = null;
  #turnedDown = 0;

  /**
   * `surfaceOf(touch)` returns {material, impact_gain?, thickness_m?, hum?} of what is touched, or undefined. With `soundHz` the player
   * renders samples at that rate, and else it plans. `say(text)` gets each problem of a touch once.
   */
  constructor(feel, surfaceOf, {soundHz, say = (text) => console.warn(`hapticvlm: ${text}`)} = {}) {
    if (!(feel?.materials instanceof Map)) throw new TypeError('feel: pass what `openFeel` returned of the file');
    this.#feel = feel;
    this.#rules = feel.rules;
    this.#surfaceOf = surfaceOf;
    this.#rate = soundHz;
    this.#say = say;
    this.#voices = new Voices(feel);
    this.#hands = new Map(feel.words.hand.map((name) => [name, {isHeld: false, isArmed: false, touches: false, leaseUntil: -Infinity, time: null, touchedAt: 0, gaps: 0, voices: []}]));
  }

  /** Receives a touch at `now`; returns whether an impact begins, which asks for a plan at once. */
  touch(touch, now) {
    if (!this.#isTime(now) || !this.#knows(touch)) return false;
    const hand = this.#hands.get(touch.hand);
    const {phase, interaction} = touch;
    if (phase === 'release') {
      hand.isArmed = hand.isHeld;
      this.#rest(hand);
      return false;
    }
    if (hand.isArmed && phase !== 'slide') hand.isHeld = hand.isArmed = false;
    if (hand.isHeld) return false;
    if (now > hand.leaseUntil) this.#rest(hand);
    if (!this.#rate) this.#run(hand, now);
    this.#noteMilliseconds(hand, phase, now);
    const onset = !hand.touches && phase === 'contact';
    hand.leaseUntil = now + this.#rules.lease_s;
    hand.touches = phase !== 'approach';
    if (!hand.touches && interaction !== 'swing') {
      this.#letGo(hand);
      return false;
    }
    const isTexture = TEXTURES.includes(interaction);
    const slides = phase === 'slide' || isTexture || !(onset || interaction);
    this.#follow(hand, touch, slides && !isTexture ? 'slide' : (interaction ?? 'strike'), onset);
    return onset;
  }

  /** Ends everything; a hand is felt again after its release and a new approach or contact. */
  stop() {
    for (const hand of this.#hands.values()) {
      Object.assign(hand, {isHeld: true, isArmed: false});
      this.#rest(hand);
    }
  }

  /** Whether a stop keeps this hand silent. */
  isHeld(name) {
    return this.#isWord('hand', name) && this.#hands.get(name).isHeld;
  }

  /** Returns the next 100 ms of a hand as {period_ms, amplitude, frequency_hz, transients}; empty lists are silence. */
  plan(name, form, now) {
    const {pad, step_s: stepS} = this.#rules;
    const isForm = this.#isWord('form', form, FORMS);
    const periodS = pad.period_s[isForm ? form : FORMS[0]];
    const plan = {period_ms: 1000 * periodS, amplitude: [], frequency_hz: [], transients: []};
    if (!isForm || !this.#isTime(now) || !this.#isWord('hand', name)) return plan;
    const hand = this.#hands.get(name);
    if (hand.leaseUntil <= now) {
      this.#rest(hand);
      return plan;
    }
    const begun = hand.voices.filter(({isNew}) => isNew);
    for (const shot of begun) shot.isNew = false;
    this.#run(hand, now);
    const {drawn} = this.#voices;
    const ahead = {...hand, voices: hand.voices.map((voice) => ({...voice}))};
    const count = Math.max(1, Math.floor(Math.min(pad.horizon_s, hand.leaseUntil - now) / periodS + SOON));
    const powers = Array.from({length: count}, () => this.#powers(ahead, Math.round(periodS / stepS)));
    this.#voices.drawn = drawn;
    const gain = this.#within('gain', this.gain, 1);
    const least = begun.length ? Math.floor(pad.min_impact_s / periodS + SOON) : 0;
    const amplitude = powers.map(({drive, felt}, at) => gain * Math.max(this.#onPad(Math.sqrt(form === 'amplitude' ? felt : drive), form), at < least ? pad.min_impact : 0));
    if (Math.max(...amplitude) < pad.min_amplitude) return plan;
    plan.amplitude = amplitude.map((value) => round(value, 1e4));
    if (form !== 'parametric') return plan;
    plan.frequency_hz = powers.map(({drive, turned}) => round(Math.min(Math.max(Math.sqrt(turned / Math.max(drive, 1e-12)), 20), 1000), 10));
    plan.transients = begun.map(({pad: level, fade, clip, hz}) => {
      const peak = Math.max(this.#onPad((level * fade) / clip.most, form), pad.min_impact);
      return {at_ms: 0, amplitude: round(gain * peak, 1e4), frequency_hz: hz};
    });
    return plan;
  }

  /** Returns the next samples of both hands, -1..1, at `soundHz`; `now` is the time of the first. */
  render(count, now) {
    const wave = new Float64Array(Number.isInteger(count) ? Math.min(Math.max(count, 0), MOST_SAMPLES) : 0);
    if (!this.#rate || !this.#isTime(now)) return wave;
    const piece = Math.max(1, Math.floor(this.#rules.step_s * this.#rate));
    for (let begin = 0; begin < wave.length; begin += piece) {
      const part = wave.subarray(begin, begin + piece);
      const dt = part.length / this.#rate;
      const shift = this.#shift(part.length);
      let body = 0;
      const sink = (clip, at, rate, first, last, drive, felt, hz, level) => {
        addSamples(part, clip, at, rate / this.#rate, first, last, shift);
        body += level * level;
      };
      for (const hand of this.#hands.values()) {
        if (hand.leaseUntil < now + begin / this.#rate) this.#rest(hand);
        this.#voices.advance(hand, dt, sink);
      }
      this.#level(part, Math.sqrt(body), dt);
    }
    return wave;
  }

  /** Tells a hand what it feels now. */
  #follow(hand, touch, kind, onset) {
    const surface = this.#surfaceOf(touch) ?? {};
    const speed = this.#within('speed_mps', touch.speed_mps, 0);
    const force = this.#within('force_n', touch.force_n, 1.5);
    const impactGain = this.#within('impact_gain', surface.impact_gain, 1);
    const gain = IMPACTS.includes(kind) ? impactGain : 1;
    const thickness = this.#within('thickness_m', surface.thickness_m, null);
    const hum = hand.touches ? this.#hum(surface.hum) : null;
    for (const voice of hand.voices) if (voice.key) voice.aim = 0;
    if (hum) this.#voices.follow(hand, 'hum', hum.level, hum, () => [{kind: 'hum', fade: 0, turns: []}]);
    const name = surface.material;
    const facts = this.#feel.materials.get(name);
    if (!facts) {
      if (name != null && name !== 'unknown') this.#note('material', `${shown(name)} is not in the feel file; bake it`);
      return;
    }
    if (onset && kind !== 'swing') this.#voices.strike(hand, facts, IMPACTS.includes(kind) ? kind : 'tap', speed, force, gain);
    if (kind === 'press' && facts.n_per_grain !== null) this.#voices.follow(hand, `press ${name}`, gain, force, () => this.#voices.pressOn(facts, gain));
    if (!TEXTURES.includes(kind)) return;
    const pitch = kind === 'swing' && thickness ? (speed * facts.thickness_m) / thickness : speed;
    const key = `${kind} ${kind === 'swing' ? thickness : ''} ${name}`;
    this.#voices.follow(hand, key, 1, [speed, force, pitch], () => this.#voices.texture(hand, facts[kind], facts.grain, pitch));
  }

  /** Ends what sounds: at once for plans, with a fade for samples. */
  #letGo(hand) {
    hand.voices = this.#rate ? hand.voices.filter((voice) => !voice.isImpact || voice.hasBegun) : [];
    hand.time = null;
    for (const voice of hand.voices) voice.aim = 0;
  }

  /** Ends the lease, and what sounds. */
  #rest(hand) {
    hand.leaseUntil = -Infinity;
    hand.touches = false;
    this.#letGo(hand);
  }

  /** Lets a hand that is planned sound until `now`. */
  #run(hand, now) {
    const step = this.#rules.step_s;
    let left = hand.time === null ? 0 : Math.min(Math.max(now - hand.time, 0), LONGEST_RUN_S);
    hand.time = now;
    for (; left > SOON && hand.voices.length; left -= step) this.#voices.advance(hand, Math.min(left, step), () => {});
  }

  /** Returns the means of the squares of level, of loudness, and of level times frequency in the next steps. */
  #powers(hand, steps) {
    const sums = {drive: 0, felt: 0, turned: 0};
    for (let step = 0; step < steps; step++) {
      this.#voices.advance(hand, this.#rules.step_s, (clip, at, rate, first, last, drive, felt, hz) => {
        sums.drive += drive ** 2 / steps;
        sums.felt += felt ** 2 / steps;
        sums.turned += (drive * hz) ** 2 / steps;
      });
    }
    return sums;
  }

  #onPad(level, form) {
    const {pad} = this.#rules;
    const most = Math.min(level, 1);
    return most < pad.min_level ? 0 : Math.min(pad.scale[form] * most ** pad.exponent, 1);
  }

  /** Returns the factors of complex samples in the next ones; null in the true voice. */
  #shift(count) {
    if (!this.#rules.sound) return null;
    const turns = this.#rules.sound.shift_hz / this.#rate;
    const angles = Float64Array.from({length: count}, (_, n) => 2 * Math.PI * (this.#turn + n * turns));
    this.#turn = (this.#turn + count * turns) % 1;
    return {re: angles.map(Math.cos), im: angles.map(Math.sin)};
  }

  /** Compresses samples in the sound voice, and turns down at once what would leave the range; it recovers slowly. */
  #level(part, body, dt) {
    const {sound, ceiling, recover_s: recoverS} = this.#rules;
    const gain = this.#within('gain', this.gain, 1);
    let to = 1;
    if (sound) {
      this.#held = Math.max(this.#held * Math.exp(-sound.fall_per_s * dt), body);
      to = sound.level * Math.max(this.#held, sound.lowest) ** (sound.exponent - 1);
    }
    const from = this.#compression ?? to;
    this.#compression = to;
    let peak = ceiling;
    for (let n = 0; n < part.length; n++) {
      part[n] *= gain * (from + ((to - from) * n) / Math.max(part.length - 1, 1));
      peak = Math.max(peak, Math.abs(part[n]));
    }
    this.#turnedDown = Math.max(1 - ceiling / peak, this.#turnedDown * Math.exp(-dt / recoverS));
    for (let n = 0; n < part.length; n++) part[n] *= 1 - this.#turnedDown;
  }

  /** Returns a quantity within its range; `missing` for what is not a number. */
  #within(name, value, missing) {
    if (value == null) return missing;
    const [low, high] = this.#feel.ranges[name];
    if (typeof value !== 'number' || Number.isNaN(value)) {
      this.#note(name, `${shown(value)} is not a number; ${missing} is used; pass a number`);
      return missing;
    }
    if (!(low <= value && value <= high)) this.#note(name, `${value} is outside ${low} to ${high}; the nearest is used`);
    return Math.min(Math.max(value, low), high);
  }

  #hum(hum) {
    if (hum == null) return null;
    const {drives} = hum;
    const level = this.#within('hum.level', hum.level, 0);
    const hz = this.#within('hum.frequency_hz', hum.frequency_hz, 0);
    const isDrive = (drive) => typeof drive === 'number' && Math.abs(drive) <= MOST_DRIVE;
    if (level && hz && Array.isArray(drives) && drives.length <= MOST_DRIVES && drives.every(isDrive)) return {level, hz, drives};
    this.#note('hum', 'needs frequency_hz, level and drives, as materials.json has them');
    return null;
  }

  #knows(touch) {
    return this.#isWord('phase', touch?.phase) && this.#isWord('hand', touch.hand) && (touch.interaction == null || this.#isWord('interaction', touch.interaction));
  }

  #isWord(field, word, words = this.#feel.words[field]) {
    if (words.includes(word)) return true;
    this.#note(field, `${shown(word)} is not one of ${words.join(', ')}: the call is refused`);
    return false;
  }

  #noteMilliseconds(hand, phase, now) {
    const gap = now - hand.touchedAt;
    const [least, most] = MILLISECONDS;
    hand.touchedAt = now;
    hand.gaps = phase === 'slide' && gap >= least && gap <= most ? hand.gaps + 1 : 0;
    if (hand.gaps === MOST_GAPS) this.#note('now', `${gap} s between the touches of a slide; pass s, not ms`);
  }

  #isTime(now) {
    if (Number.isFinite(now)) return true;
    this.#note('now', `${shown(now)} is not a time in s: the call is refused`);
    return false;
  }

  #note(field, text) {
    if (this.said.has(field)) return;
    this.said.add(field);
    this.#say(`${field}: ${text}`);
  }
}

function round(value, to) {
  return Math.round(value * to) / to;
}

/** Returns a wrong value for a sentence. */
function shown(value) {
  return typeof value === 'string' ? `"${value}"` : typeof value === 'object' && value ? 'an object' : String(value);
}
