/** What sounds of a hand: impacts, textures, breaks, presses and hums, each from the clips of a feel file and its tables. */
import {SINE, blended, decoded} from './clips.js';

export const IMPACTS = ['tap', 'strike', 'press'];
export const TEXTURES = ['slide', 'carve', 'swing'];
const MODULUS = 65537;

/**
 * Advances voices of hands. A voice with a `key` follows touches by its values `to`; impacts and grains have none. A `sink` gets each piece
 * that sounds: clip, place in it (s), rate, gain of its samples at the begin and the end, then level, loudness and frequency for a pad, and
 * the level that the compression follows.
 */
export class Voices {
  drawn = 1;

  constructor(feel) {
    this.feel = feel;
    this.rules = feel.rules;
  }

  /** Lets a hand sound for `dt`, s. */
  advance(hand, dt, sink) {
    const step = dt / this.rules.fade_s;
    for (const voice of hand.voices) { // grains that begin are added at the end, and sound at once
      const before = voice.fade;
      voice.fade += Math.min(Math.max(voice.aim - before, -step), step);
      this[voice.kind](voice, hand, before, dt, sink);
    }
    hand.voices = hand.voices.filter((voice) => voice.fade || voice.aim);
  }

  /** Begins an impact. */
  strike(hand, facts, kind, speed, force, gain) {
    const ringing = hand.voices.filter((voice) => voice.isImpact);
    if (ringing.length >= this.rules.max_impacts) return;
    const loud = ringing.filter(({aim}) => aim > 0);
    if (loud.length >= this.rules.max_ringing) loud[0].aim = 0;
    const table = this.feel.impacts[kind];
    const {clips, ...levels} = facts[kind];
    const place = Math.min(this.#look(table.place, speed, force), clips.length - 1);
    const first = Math.floor(place);
    const clip = blended(this.#clip(clips[first]), this.#clip(clips[first + 1] ?? clips[first]), place - first);
    const varied = 2 * this.#draw() - 1;
    const [level, rate] = [1 - this.rules.level_varies * varied, 1 + this.rules.pitch_varies * varied];
    const [palm, pad] = ['palm', 'pad'].map((on) => Math.min(level * levels[on] * this.#look(table[on], speed, force), clip.most));
    hand.voices.push({kind: 'shot', isImpact: true, isNew: true, clip, palm, pad, fade: gain, aim: gain, rate, hz: facts.hz, at: this.#look(table.skip_s, speed, force)});
  }

  /** Gives the voices of a key what they follow, and begins them if there are none. */
  follow(hand, key, aim, to, begin) {
    let same = hand.voices.filter((voice) => voice.key === key);
    if (!same.length) {
      same = begin();
      hand.voices.push(...same);
    }
    for (const voice of same) Object.assign(voice, {key, aim, to});
  }

  /** Returns the voices of a texture: a loop for each layer, and breaks. Too many others that fade end at once. */
  texture(hand, {layers, breaks}, grain, speed) {
    const others = new Set(hand.voices.filter(({kind}) => kind === 'layer').map(({key}) => key));
    if (others.size > this.rules.max_textures) hand.voices = hand.voices.filter(({kind}) => kind !== 'layer');
    const voices = layers.map((facts) => {
      const clip = decoded(this.feel.loops.get(facts.loop));
      return {kind: 'layer', fade: 0, clip, facts, at: (this.#draw() * clip.size) / clip.rate_hz, flow: [speed, 0], level: [0, 0]};
    });
    return breaks ? [...voices, {kind: 'breaks', fade: 0, facts: breaks, grain, toNext: this.#draw(), level: [0, 0]}] : voices;
  }

  /** Returns the voice of a press on something that yields: a grain for each step that it deepens with the force. */
  pressOn(facts, gain) {
    return [{kind: 'press', fade: gain, facts, next: 0.3 + 0.4 * this.#draw(), depth: [0, 0], rest: 0}];
  }

  shot(voice, hand, before, dt, sink) {
    const {clip, palm, pad, at, fade} = voice;
    const step = Math.max(this.#stepOf(at), 0);
    const [drive, felt, hz, body] = step < clip.drive.length ? [clip.drive[step], clip.felt[step] ?? 0, clip.hz[step] ?? 0, clip.body[step] ?? 0] : [0, 0, 0, 0];
    sink(clip, at, voice.rate, palm * before, palm * fade, pad * fade * drive, pad * fade * felt, hz, palm * fade * body);
    voice.at += voice.rate * dt;
    voice.hasBegun = true;
    if (voice.at >= clip.size / clip.rate_hz && step >= clip.drive.length) voice.fade = voice.aim = 0;
  }

  /** One loop of a texture. It follows speed, force, and the speed at which it is read. */
  layer(voice, hand, before, dt, sink) {
    const {clip, facts, at, to: [speed, force, pitch]} = voice;
    const [old] = voice.level;
    voice.flow = this.#smooth(voice.flow, pitch, dt);
    const place = between(this.feel.speeds_mps, voice.flow[0]);
    const rate = along(clip.rate, place);
    const loud = along(clip.loud, place);
    const level = facts.factor * this.#look(this.feel.levels.get(facts.level), speed, force) * along(clip.gain, between(this.feel.speeds_mps, pitch));
    voice.level = this.#smooth(voice.level, level, dt);
    const gain = voice.level[0] * voice.fade;
    const drive = gain * clip.drive[this.#stepOf(at) % clip.drive.length];
    sink(clip, at, rate, old * before * loud, gain * loud, drive, drive * along(clip.felt, place), along(clip.hz, place), gain * along(clip.body, place));
    voice.at = (at + rate * dt) % (clip.size / clip.rate_hz);
  }

  /** The fibres that break under a blade, a grain each. */
  breaks(voice, hand, before, dt) {
    const {facts, to: [speed, force]} = voice;
    voice.level = this.#smooth(voice.level, this.#look(this.feel.levels.get(facts.level), speed, force), dt);
    const perS = along(facts.per_s, between(this.feel.speeds_mps, speed));
    voice.toNext -= perS * dt;
    if (voice.toNext >= 0) return;
    this.#grain(hand, voice.grain, (0.4 + 0.6 * this.#draw()) * voice.level[0] * voice.fade, dt + voice.toNext / perS);
    voice.toNext = Math.max(voice.toNext + 0.5 + this.#draw(), 0);
  }

  press(voice, hand, before, dt) {
    const {facts} = voice;
    const [old] = voice.depth;
    voice.depth = this.#smooth(voice.depth, voice.to / facts.n_per_grain, dt);
    const [depth] = voice.depth;
    const deeper = depth - old;
    if (depth >= voice.next && voice.rest < dt) {
      const late = Math.max(voice.rest, deeper > 0 ? (dt * (voice.next - old)) / deeper : 0, 0);
      this.#grain(hand, late > voice.rest ? facts.grain : facts.again, this.rules.grain_strength * voice.fade, late);
      voice.next += Math.floor(Math.max(old + (deeper * late) / dt - voice.next, 0)) + 1;
      voice.rest = late + 1 / this.rules.grains_per_s;
    }
    voice.rest -= dt;
    const left = voice.next - 1 - depth - this.rules.grain_back;
    if (left > 0) voice.next -= Math.floor(left) + 1;
  }

  /** A tone and its harmonics; `fade` is its level. */
  hum(voice, hand, before, dt, sink) {
    const {pad, sound} = this.rules;
    voice.turns = voice.to.drives.map((drive, order) => {
      const hz = (order + 1) * voice.to.hz;
      const place = between(pad.hum_hz, hz);
      const weight = sound ? along(sound.hum_weight, place) : 1;
      const level = drive * voice.fade;
      const rate = hz * (sound?.times ?? 1);
      const turn = voice.turns[order] ?? 0;
      sink(SINE, turn, rate, drive * before * weight, level * weight, level, level * along(pad.hum_felt, place), hz, level * Math.SQRT1_2);
      return (turn + rate * dt) % 1;
    });
  }

  #grain(hand, name, gain, late) {
    hand.voices.push({kind: 'shot', clip: this.#clip(name), palm: gain, pad: gain, fade: 1, aim: 1, rate: 1, at: -late});
  }

  #clip(name) {
    return decoded(this.feel.clips.get(name));
  }

  #stepOf(at) {
    return Math.trunc(at / this.rules.step_s + 1e-9);
  }

  /** Returns the value of a table by speed and force. */
  #look(table, speed, force) {
    const place = between(this.feel.speeds_mps, speed);
    const on = between(this.feel.forces_n, force);
    const row = Math.min(Math.floor(place), table.length - 2);
    const [low, high] = [along(table[row], on), along(table[row + 1], on)];
    return low + (place - row) * (high - low);
  }

  /** Returns value and slope of a number that follows its target through two low-passes. */
  #smooth([value, slope], target, dt) {
    const time = dt / this.rules.smooth_s;
    const distance = value - target;
    const push = slope + distance;
    const decay = Math.exp(-time);
    return [target + (distance + push * time) * decay, (slope - push * time) * decay];
  }

  /** Returns the next number of a sequence that looks random, 0..1; every player has it. */
  #draw() {
    this.drawn = (75 * this.drawn + 74) % MODULUS;
    return (this.drawn + 0.5) / MODULUS;
  }
}

/** Returns the place of a value on an axis: the entry below it, and as a fraction the share of the next one. */
function between(axis, value) {
  let at = 0;
  while (at < axis.length - 2 && axis[at + 1] <= value) at++;
  return at + Math.min(Math.max((value - axis[at]) / (axis[at + 1] - axis[at]), 0), 1);
}

/** Returns the value of a table at a place of its axis. */
function along(table, place) {
  const at = Math.min(Math.floor(place), table.length - 2);
  return table[at] + (place - at) * (table[at + 1] - table[at]);
}
