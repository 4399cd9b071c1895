/**
 * Plays `feel.json` without a service: the same vibration as the service's `vibration` events, from the same touches.
 *
 * This is a port of the service's voices (rendering/vibration) and of the rules of its hands (session/hands.py). It has
 * the equations; every figure is in the file. It knows no clock, no socket and no motor: times are arguments, in s.
 * The golden vectors of schemas/vectors/feel.json compare it with the service.
 */
const VERSION = 1;
const IMPACTS = ['tap', 'strike', 'press'];
const TEXTURES = ['slide', 'carve', 'swing'];
const HANDS = ['left', 'right'];
const NEGLIGIBLE = 1e-6;

/** Opens the parsed contents of `feel.json`. Throws where its version is unknown. */
export function openFeel(file) {
  if (file?.version !== VERSION) {
    throw new Error(`feel.json: version ${file?.version} is not ${VERSION}; bake it again, or update the client`);
  }
  const draws = bytesOf(file.draws);
  const drawn = Float64Array.from({length: draws.length / 2}, (_, at) => (draws[2 * at] + 256 * draws[2 * at + 1] + 0.5) / 65536);
  const materials = Object.entries(file.materials).map(([name, feel]) => [name, {
    ...feel,
    slide: {...feel.slide, loop: loopOf(feel.slide.loop)},
    swing: {...feel.swing, loop: loopOf(feel.swing.loop)},
  }]);
  return {rules: file.rules, weights: weightsOf(file.rules), seeds: file.seeds, drawn, slips: loopOf(file.slips), materials: new Map(materials)};
}

/** The two hands of one scene: receives touches, gives the vibration of each hand. */
export class FeelPlayer {
  #feel;
  #surfaceOf;
  #hands;
  #onsets = 0;

  /**
   * `surfaceOf(touch)` returns {material, impact_gain?, thickness_m?, hum?} of what is touched, or undefined. With
   * `soundHz`, `render` gives the touches as sound, too.
   */
  constructor(feel, surfaceOf, {soundHz} = {}) {
    this.#feel = feel;
    this.#surfaceOf = surfaceOf;
    this.#hands = Object.fromEntries(HANDS.map((name) => [name, {
      planner: new Planner(feel), heard: soundHz ? new Voices(feel, soundHz) : null, isHeld: false, isArmed: false, ...RELEASED,
    }]));
  }

  /** Factor of every vibration, 0 to 1. */
  set gain(value) {
    for (const {planner} of Object.values(this.#hands)) planner.gain = within(1, value, 1);
  }

  /** Receives a touch at `now`; returns whether it begins an impact, which asks for a plan at once. */
  touch(given, now) {
    const touch = fitted(given, this.#feel.rules.touch);
    if (!touch) return false;
    const hand = this.#hands[touch.hand];
    if (touch.phase === 'release') {
      hand.isArmed = hand.isHeld;
      release(hand);
      return false;
    }
    if (hand.isArmed && (touch.phase === 'approach' || touch.phase === 'contact')) hand.isHeld = hand.isArmed = false;
    if (hand.isHeld) return false;
    lapse(hand, now);
    const vibrated = hand.vibrates;
    const onset = follow(hand, touch, now + this.#feel.rules.lease_s);
    if (hand.vibrates) this.#play(hand, touch, onset, now);
    else if (vibrated) silence(hand);
    return onset;
  }

  /** Ends everything at once; a hand is felt again after its release and a new approach or contact. */
  stop() {
    for (const hand of Object.values(this.#hands)) {
      hand.isHeld = true;
      hand.isArmed = false;
      release(hand);
    }
  }

  /** Whether a stop keeps this hand silent. */
  isHeld(name) {
    return this.#hands[name].isHeld;
  }

  /** Returns the next 100 ms of a hand as {period_ms, amplitude, frequency_hz, transients}; empty lists are silence. */
  plan(name, form, now) {
    const hand = this.#hands[name];
    lapse(hand, now);
    return hand.planner.plan(form, now);
  }

  /** Returns the next `count` samples of both hands, -1..1, at the rate of the constructor. */
  render(count, now) {
    const [left, right] = HANDS.map((name) => this.#hands[name].heard.render(count, now));
    return left.map((sample, at) => Math.min(Math.max(sample + right[at], -1), 1));
  }

  #play(hand, touch, onset, now) {
    this.#onsets += onset;
    const surface = this.#surfaceOf(touch) ?? {};
    const interaction = interactionOf(hand);
    const command = {
      material: surface.material,
      interaction,
      onset,
      speed: touch.speed_mps,
      force: touch.force_n,
      seed: this.#onsets,
      expiresAt: hand.leaseUntil,
      gain: IMPACTS.includes(interaction) ? within(1, surface.impact_gain, 1) : 1,
      thickness: interaction === 'swing' ? surface.thickness_m : undefined,
      hum: hand.touches ? surface.hum : undefined,
    };
    hand.planner.apply(command, now);
    hand.heard?.apply(command);
  }
}

const told = new Set();

/** Returns a touch as the service takes it: its quantities within the limits. An unknown word is told once, and undefined returned. */
function fitted(touch, {fastest_mps: fastest, strongest_n: strongest, gentle_n: gentle, ...words}) {
  for (const [name, known] of Object.entries(words)) {
    const word = touch[name];
    if (known.includes(word) || (name === 'interaction' && word == null)) continue;
    const text = `a touch is not felt: its ${name} is \`${word}\`, not one of ${known.join(', ')}`;
    if (!told.has(text) && told.size < 100) console.warn(text);
    told.add(text);
    return undefined;
  }
  return {...touch, speed_mps: within(fastest, touch.speed_mps, 0), force_n: within(strongest, touch.force_n, gentle)};
}

/** Returns a quantity between 0 and `most`; `missing` for what is no number. */
function within(most, value, missing) {
  return typeof value !== 'number' || Number.isNaN(value) ? missing : Math.min(most, Math.max(0, value));
}

const RELEASED = {leaseUntil: null, touches: false, vibrates: false, slides: false, interaction: undefined};

function silence(hand) {
  hand.planner.rest();
  hand.heard?.rest();
}

function release(hand) {
  Object.assign(hand, RELEASED);
  silence(hand);
}

/** Ends a touch that was not renewed. */
function lapse(hand, now) {
  if (hand.leaseUntil !== null && hand.leaseUntil < now) release(hand);
}

/** Applies a touch to a hand; returns whether it is an onset. As `Hand.update` of the service. */
function follow(hand, {phase, interaction}, leaseUntil) {
  const begins = !hand.touches;
  const isTexture = TEXTURES.includes(interaction);
  const onset = begins && phase === 'contact';
  hand.leaseUntil = leaseUntil;
  hand.interaction = interaction;
  hand.touches = phase !== 'approach';
  hand.vibrates = hand.touches || interaction === 'swing';
  hand.slides = hand.touches ? phase === 'slide' || isTexture || !(onset || interaction) : interaction === 'swing';
  return onset;
}

function interactionOf(hand) {
  if (hand.slides && !TEXTURES.includes(hand.interaction)) return 'slide';
  return hand.interaction ?? 'strike';
}

/** Plans the vibration of one hand: vibration_plan.py. */
class Planner {
  gain = 1;
  #feel;
  #voices;
  #renderedUntil = null;
  #renewal = null;
  #expiresAt = -Infinity;

  constructor(feel) {
    this.#feel = feel;
    this.#voices = new Voices(feel, feel.rules.plan.rate_hz);
  }

  apply(command, now) {
    this.#expiresAt = command.expiresAt;
    if (!command.onset) {
      this.#renewal = command;
      return;
    }
    this.#advance(now);
    this.#voices.apply(command);
  }

  rest() {
    this.#voices.silence();
    this.#renewal = null;
    this.#renderedUntil = null;
  }

  plan(form, now) {
    const rules = this.#feel.rules.plan;
    const impacts = this.#voices.beginning();
    this.#advance(now);
    const period = rules.period_s[form];
    const silence = {period_ms: 1000 * period, amplitude: [], frequency_hz: [], transients: []};
    const ahead = Math.min(rules.horizon_s, this.#expiresAt - now);
    if (this.#voices.isSilent || ahead <= 0) return silence;
    const wave = this.#voices.fork().render(Math.round(rules.horizon_s * rules.rate_hz), now);
    const count = Math.max(1, Math.floor(ahead / period + 1e-9));
    const amplitude = this.#amplitude(wave, form, impacts.length > 0).slice(0, count);
    if (Math.max(...amplitude) < rules.min_amplitude) return silence;
    const played = amplitude.map((value) => round(value, 4));
    if (form === 'amplitude') return {...silence, amplitude: played};
    const frequency = frequencies(wave, period, rules).slice(0, count).map((value) => round(value, 1));
    return {...silence, amplitude: played, frequency_hz: frequency, transients: impacts.map((impact) => this.#transient(impact))};
  }

  #amplitude(wave, form, hasImpact) {
    const rules = this.#feel.rules.plan;
    const drive = form === 'amplitude' ? loudness(wave, this.#feel.weights) : wave;
    const played = levels(drive, rules.period_s[form], rules.rate_hz).map((level) => controllerAmplitude(level, form, rules));
    const beginning = hasImpact ? Math.round(rules.min_impact_s / rules.period_s[form]) : 0;
    return played.map((value, at) => this.gain * (at < beginning ? Math.max(value, rules.min_impact) : value));
  }

  #transient({material, peak}) {
    const rules = this.#feel.rules.plan;
    const amplitude = Math.max(controllerAmplitude(peak, 'parametric', rules), rules.min_impact);
    return {at_ms: 0, amplitude: round(amplitude * this.gain, 4), frequency_hz: this.#feel.materials.get(material).impact.modes[0].frequency_hz};
  }

  #advance(now) {
    const rules = this.#feel.rules.plan;
    const elapsed = this.#renderedUntil === null ? 0 : Math.min(Math.max(now - this.#renderedUntil, 0), rules.stale_s);
    this.#renderedUntil = now;
    const count = Math.round(elapsed * rules.rate_hz);
    if (count && !this.#voices.isSilent) this.#voices.render(count, now - elapsed);
    if (this.#renewal) this.#voices.apply(this.#renewal);
    this.#renewal = null;
  }
}

/** The voices of one hand: voices.py. */
class Voices {
  #feel;
  #rate;
  #voices = [];
  #texture = null;
  #press = null;
  #hum = null;
  #expiresAt = -Infinity;
  #limiter;

  constructor(feel, rate) {
    this.#feel = feel;
    this.#rate = rate;
    this.#limiter = new Limiter(feel.rules.voices, rate);
  }

  fork() {
    const forked = new Voices(this.#feel, this.#rate);
    forked.#voices = this.#voices.map((voice) => voice.fork());
    forked.#texture = this.#texture;
    forked.#press = this.#press;
    forked.#hum = this.#hum;
    forked.#expiresAt = this.#expiresAt;
    forked.#limiter = this.#limiter.fork();
    return forked;
  }

  get isSilent() {
    return !this.#voices.length && !this.#texture && !this.#press && !this.#hum && this.#limiter.isEmpty;
  }

  silence() {
    this.rest();
    this.#voices = [];
    this.#limiter = new Limiter(this.#feel.rules.voices, this.#rate);
  }

  /** Fades what sounds; an impact that has not begun is dropped. */
  rest() {
    this.#texture = this.#press = this.#hum = null;
    this.#expiresAt = -Infinity;
    this.#voices = this.#voices.filter((voice) => !voice.isImpact || voice.source.at);
    for (const voice of this.#voices) voice.aim = 0;
  }

  /** Returns the material and the peak of each impact that begins in the next block. */
  beginning() {
    return this.#impacts().filter(({source}) => source.at === 0).map(({material, source}) => ({material, peak: source.peak}));
  }

  apply(command) {
    this.#expiresAt = command.expiresAt;
    this.#hum = command.hum ?? null;
    const facts = this.#feel.materials.get(command.material);
    if (!facts) {
      this.#texture = this.#press = null;
      return;
    }
    const {interaction, onset} = command;
    this.#press = interaction === 'press' && facts.press_n_per_grain !== null ? command : null;
    if (onset && interaction !== 'swing') this.#strike(command, facts);
    const isHeld = onset || IMPACTS.includes(interaction);
    this.#texture = TEXTURES.includes(interaction) || !isHeld ? command : null;
  }

  /** Returns the next `count` samples; `now` is the time of the first. */
  render(count, now) {
    const wave = new Float64Array(count);
    const chunk = this.#feel.rules.voices.chunk;
    if (this.isSilent) return wave;
    for (let begin = 0; begin < count; begin += chunk) {
      this.#mix(wave.subarray(begin, Math.min(begin + chunk, count)), now + begin / this.#rate);
    }
    return wave;
  }

  #mix(part, now) {
    if (!(this.#expiresAt >= now)) this.rest();
    this.#followTexture();
    this.#followPress();
    this.#followHum();
    const step = 1 / (this.#feel.rules.voices.fade_s * this.#rate);
    for (const voice of this.#voices) voice.addTo(part, step);
    this.#voices = this.#voices.filter((voice) => !voice.ended);
    this.#limiter.apply(part);
  }

  #impacts() {
    return this.#voices.filter((voice) => voice.isImpact);
  }

  #strike(command, facts) {
    const {max_impacts: most, max_ringing: ringing} = this.#feel.rules.voices;
    const impacts = this.#impacts();
    if (impacts.length >= most) return;
    const loud = impacts.filter((voice) => voice.aim > 0);
    if (loud.length >= ringing) loud[0].aim = 0;
    const kind = IMPACTS.includes(command.interaction) ? command.interaction : 'tap';
    const gain = Math.min(command.gain, 1);
    const wave = impact(this.#feel, facts, kind, command, this.#rate);
    this.#voices.push(new Voice(new Played(wave), command, kind, gain, gain));
  }

  #followTexture() {
    const command = this.#texture;
    const textures = this.#voices.filter((voice) => TEXTURES.includes(voice.kind));
    for (const voice of textures) voice.aim = 0;
    if (!command) return;
    const kind = TEXTURES.includes(command.interaction) ? command.interaction : 'slide';
    const gain = Math.min(command.gain, 1);
    const current = textures.findLast((voice) => voice.is(command.material, kind) && voice.thickness === command.thickness);
    if (current) {
      current.motion = command;
      current.aim = gain;
    } else if (textures.length <= this.#feel.rules.voices.max_fading_textures) {
      this.#voices.push(new Voice(new Texture(this.#feel, kind, command, this.#rate), command, kind, 0, gain));
    }
  }

  #followPress() {
    const yielding = this.#voices.filter((voice) => voice.kind === 'grains');
    for (const voice of yielding) voice.aim = 0;
    if (!this.#press) return;
    const gain = Math.min(this.#press.gain, 1);
    let current = yielding.find((voice) => voice.material === this.#press.material);
    if (!current) {
      current = new Voice(new Grains(this.#feel, this.#press, this.#rate), this.#press, 'grains', gain, gain);
      this.#voices.push(current);
    }
    current.motion = this.#press;
    current.aim = gain;
  }

  #followHum() {
    const humming = this.#voices.filter((voice) => voice.kind === 'hum');
    for (const voice of humming) {
      voice.aim = this.#hum?.level ?? 0;
      if (this.#hum) voice.source.hum = this.#hum;
    }
    if (this.#hum && !humming.length) {
      this.#voices.push(new Voice(new Tone(this.#feel.rules, this.#hum, this.#rate), {}, 'hum', 0, this.#hum.level));
    }
  }
}

/** One source with a gain that fades towards `aim`: voice.py. */
class Voice {
  ended = false;

  constructor(source, motion, kind, gain, aim) {
    this.source = source;
    this.motion = motion;
    this.material = motion.material;
    this.thickness = motion.thickness;
    this.kind = kind;
    this.gain = gain;
    this.aim = aim;
  }

  get isImpact() {
    return IMPACTS.includes(this.kind);
  }

  is(material, kind) {
    return this.material === material && this.kind === kind;
  }

  fork() {
    return Object.assign(copy(this), {source: this.source.fork()});
  }

  addTo(part, step) {
    const block = this.source.render(part.length, this.motion);
    for (let at = 0; at < part.length; at++) {
      if (this.gain < this.aim) this.gain = Math.min(this.gain + step, this.aim);
      else if (this.gain > this.aim) this.gain = Math.max(this.gain - step, this.aim);
      part[at] += this.gain * block[at];
    }
    this.ended = Boolean(this.source.ended) || (this.gain === 0 && this.aim === 0);
  }
}

/** An impact that was computed as a whole. */
class Played {
  at = 0;

  constructor(wave) {
    this.wave = wave;
    this.peak = peakOf(wave);
  }

  get ended() {
    return this.at >= this.wave.length;
  }

  fork() {
    return copy(this);
  }

  render(count) {
    const block = new Float64Array(count);
    block.set(this.wave.subarray(this.at, this.at + count));
    this.at += count;
    return block;
  }
}

/** Sliding, carving and swinging: textures.py. */
class Texture {
  constructor(feel, kind, command, rate) {
    const facts = feel.materials.get(command.material);
    const draws = new Draws(feel, command.seed);
    this.rules = feel.rules.textures;
    this.kind = kind;
    this.roughness = kind === 'swing' ? 1 : facts.slide.roughness;
    this.period = kind === 'swing' ? (command.thickness ?? facts.swing.thickness_m) / this.rules.strouhal : facts.slide.period_m;
    this.surface = new Reader(kind === 'swing' ? facts.swing.loop : facts.slide.loop, draws.next(), feel.rules, rate);
    this.stick = {slide: facts.slide.stick, carve: facts.carve.stick, swing: 0}[kind];
    this.slips = this.stick ? new Reader(feel.slips, draws.next(), feel.rules, rate) : null;
    this.breaks = kind === 'carve' && facts.carve.fibre_m !== null ? new Breaks(facts, draws, feel.rules, rate) : null;
  }

  fork() {
    return Object.assign(copy(this), {surface: this.surface.fork(), slips: this.slips?.fork() ?? null, breaks: this.breaks?.fork() ?? null});
  }

  render(count, {speed, force}) {
    const {rules} = this;
    const moved = shareOf(this.kind, speed, force, rules);
    const caught = caughtOf(this.stick, speed, force, rules);
    const wave = new Float64Array(count);
    const centre = Math.max(bent(speed / this.period, rules), rules.lowest_hz);
    this.surface.addTo(wave, centre, moved * this.roughness * Math.sqrt(1 - caught ** 2));
    this.slips?.addTo(wave, Math.min(Math.max(speed / rules.slip_m, rules.slips_hz[0]), rules.slips_hz[1]), moved * caught);
    if (!this.breaks) return wave;
    for (let at = 0; at < count; at++) wave[at] *= rules.carve_rub;
    this.breaks.addTo(wave, moved, speed);
    return wave;
  }
}

/** Returns the share of its full strength that a texture reaches by this speed and force. */
function shareOf(kind, speed, force, rules) {
  if (kind === 'swing') return 1 - Math.exp((-speed * speed) / rules.swing_speed_mps ** 2);
  const pressed = 0.3 + (0.7 * force) / (force + rules.light_force_n);
  return (pressed * speed) / (speed + rules.slow_speed_mps);
}

/** Returns the share of a surface that catches and slips. */
function caughtOf(stick, speed, force, rules) {
  const held = (stick * force) / (force + rules.stuck_n);
  const limit = rules.catch_mps * held;
  return limit === 0 ? 0 : held * (limit / Math.hypot(limit, speed)) ** 2;
}

/** Reads a loop at a rate and a level that follow their targets. */
class Reader {
  constructor(loop, place, rules, rate) {
    this.loop = loop;
    this.rules = rules;
    this.rate = rate;
    this.at = place * loop.wave.length;
    this.centre = null;
    this.level = new Smoothed(0, rules, rate);
  }

  fork() {
    return Object.assign(copy(this), {centre: this.centre?.fork() ?? null, level: this.level.fork()});
  }

  addTo(wave, centre, strength) {
    const {wave: samples, samples: perPeriod, drive} = this.loop;
    const {rms, grid_hz: grid} = this.rules.textures;
    this.centre ??= new Smoothed(centre, this.rules, this.rate);
    const level = rms * strength * interpolated(centre, grid, drive);
    const perHz = perPeriod / this.rate;
    for (let at = 0; at < wave.length; at++) {
      this.at = (this.at + this.centre.step(centre) * perHz) % samples.length;
      wave[at] += cubic(samples, this.at) * this.level.step(level);
    }
    this.centre.settle(centre);
    this.level.settle(level);
  }
}

/** Fibre breaks under a blade. */
class Breaks {
  constructor(facts, draws, rules, rate) {
    this.draws = draws;
    this.rate = rate;
    this.spacing = facts.carve.fibre_m;
    this.limits = rules.textures.breaks_hz;
    this.grain = grain(facts.grain, rules, rate);
    this.tail = new Float64Array(this.grain.length);
    this.toNext = draws.next(); // in mean spacings
    this.level = new Smoothed(0, rules, rate);
  }

  fork() {
    return Object.assign(copy(this), {draws: copy(this.draws), level: this.level.fork()});
  }

  addTo(wave, target, speed) {
    const count = wave.length;
    const level = this.level.block(target, count);
    const all = extended(this.tail, count);
    const [slowest, fastest] = this.limits;
    const perSample = speed > 0 ? Math.min(Math.max(speed / this.spacing, slowest), fastest) / this.rate : 0;
    this.toNext -= perSample * count;
    while (this.toNext < 0) {
      const begin = Math.max(count + Math.floor(this.toNext / perSample), 0);
      const strength = (0.4 + 0.6 * this.draws.next()) * level[begin];
      this.grain.forEach((sample, at) => (all[begin + at] += strength * sample));
      this.toNext += 0.5 + this.draws.next();
    }
    for (let at = 0; at < count; at++) wave[at] += all[at];
    this.tail = all.subarray(count);
  }
}

/** A press on something that yields: grains.py. */
class Grains {
  constructor(feel, command, rate) {
    const facts = feel.materials.get(command.material);
    const {strength, max_rate_hz: fastest, back} = feel.rules.press;
    this.perGrain = facts.press_n_per_grain;
    this.grain = grain(facts.grain, feel.rules, rate).map((sample) => strength * sample);
    this.gap = Math.round(rate / fastest);
    this.back = back;
    this.tail = new Float64Array(this.grain.length);
    this.depth = new Smoothed(0, feel.rules, rate);
    this.next = 0.3 + 0.4 * new Draws(feel, command.seed).next();
    this.rest = 0;
  }

  fork() {
    return Object.assign(copy(this), {depth: this.depth.fork()});
  }

  render(count, {force}) {
    const wave = extended(this.tail, count);
    const depth = this.depth.block(force / this.perGrain, count);
    for (let at = this.rest; at < count; at++) {
      if (depth[at] < this.next) continue;
      this.grain.forEach((sample, after) => (wave[at + after] += sample));
      this.next += Math.floor(depth[at] - this.next) + 1;
      this.rest = at + this.gap;
      at = this.rest - 1;
    }
    const left = this.next - 1 - depth[count - 1] - this.back;
    if (left > 0) this.next -= Math.floor(left) + 1;
    this.rest = Math.max(this.rest - count, 0);
    this.tail = wave.subarray(count);
    return wave.subarray(0, count);
  }
}

/** The hum of a thing that runs: hum.py. `hum` is {frequency_hz, level, drives}. */
class Tone {
  turns = 0;

  constructor(rules, hum, rate) {
    this.hum = hum;
    this.rate = rate;
    this.pitch = new Smoothed(hum.frequency_hz, rules, rate);
  }

  fork() {
    return Object.assign(copy(this), {pitch: this.pitch.fork()});
  }

  render(count) {
    const wave = new Float64Array(count);
    for (let at = 0; at < count; at++) {
      this.turns = (this.turns + this.pitch.step(this.hum.frequency_hz) / this.rate) % 1;
      this.hum.drives.forEach((drive, order) => (wave[at] += drive * Math.sin(2 * Math.PI * (order + 1) * this.turns)));
    }
    this.pitch.settle(this.hum.frequency_hz);
    return wave;
  }
}

/** A value that follows its target through two low-passes: smoothing.py, one sample at a time. */
class Smoothed {
  slope = 0;

  constructor(value, rules, rate) {
    this.value = value;
    this.time = 1 / (rules.voices.smooth_s * rate);
    this.decay = Math.exp(-this.time);
  }

  fork() {
    return copy(this);
  }

  step(target) {
    const distance = this.value - target;
    const push = this.slope + distance;
    this.value = target + (distance + push * this.time) * this.decay;
    this.slope = (this.slope - push * this.time) * this.decay;
    return this.value;
  }

  settle(target) {
    if (Math.abs(this.value - target) >= NEGLIGIBLE || Math.abs(this.slope) >= NEGLIGIBLE) return;
    this.value = target;
    this.slope = 0;
  }

  block(target, count) {
    const values = Float64Array.from({length: count}, () => this.step(target));
    this.settle(target);
    return values;
  }
}

/** Keeps a sequence of blocks within the ceiling, with look-ahead: `Limiter` of voices.py. */
class Limiter {
  constructor({delay_s: delay, release_s: release, ceiling}, rate) {
    this.delay = Math.round(delay * rate);
    this.ceiling = ceiling;
    this.fall = Math.exp(-1 / (release * rate));
    const window = Array.from({length: this.delay + 1}, (_, at) => Math.sin((Math.PI * (at + 1)) / (this.delay + 2)));
    const total = window.reduce((sum, value) => sum + value, 0);
    this.window = window.map((value) => value / total);
    this.delayed = new Float64Array(this.delay);
    this.reductions = new Float64Array(2 * this.delay);
  }

  get isEmpty() {
    return !this.delayed.some(Boolean);
  }

  fork() {
    return copy(this);
  }

  apply(part) {
    const {delay} = this;
    const line = extended(this.delayed, part.length);
    line.set(part, delay);
    const earlier = this.reductions;
    const isQuiet = peakOf(part) <= this.ceiling && !earlier.some(Boolean);
    this.delayed = line.slice(part.length);
    part.set(line.subarray(0, part.length));
    if (isQuiet) return;
    const reductions = extended(earlier, part.length);
    for (let at = 0; at < part.length; at++) {
      const needed = 1 - this.ceiling / Math.max(Math.abs(line[delay + at]), this.ceiling);
      reductions[2 * delay + at] = Math.max(needed, reductions[2 * delay + at - 1] * this.fall);
    }
    this.reductions = reductions.slice(part.length);
    if (peakOf(this.reductions) < NEGLIGIBLE) this.reductions.fill(0);
    const highest = Float64Array.from({length: part.length + delay}, (_, at) => peakOf(reductions.subarray(at, at + delay + 1)));
    for (let at = 0; at < part.length; at++) part[at] *= 1 - this.window.reduce((sum, weight, after) => sum + weight * highest[at + after], 0);
  }
}

/** The random numbers of one seed, as the service draws them. */
class Draws {
  drawn = 0;

  constructor({drawn, seeds}, seed) {
    const count = drawn.length / seeds;
    this.row = drawn.subarray((seed % seeds) * count, ((seed % seeds) + 1) * count);
  }

  next() {
    return this.row[this.drawn++ % this.row.length];
  }
}

/** Returns the waveform of one impact: impacts.py. */
function impact(feel, facts, kind, {speed, force, seed}, rate) {
  const rules = feel.rules.impacts;
  const draws = new Draws(feel, seed);
  const drawn = () => 2 * draws.next() - 1;
  const modes = facts.impact.modes.map((mode, order) => ({
    frequency_hz: mode.frequency_hz * (1 + rules.pitch_varies * drawn()),
    decay_per_s: mode.decay_per_s,
    gain: mode.gain * (order ? 10 ** ((rules.place_db / 20) * drawn()) : 1 + rules.gain_varies * drawn()),
  }));
  const contact = Math.max(rules.contact_s[kind] * Math.max(speed, 0.05) ** -0.2 * (1 + force / rules.hard_n) ** -0.1, rules.shortest_s);
  const held = 0.7 + (0.6 * force) / (force + rules.loud_force_n);
  const push = (held * speed) / rules.loud_speed_mps + (kind === 'press' ? force / rules.loud_force_n : 0);
  const level = (1 - Math.exp(-push)) * Math.exp(interpolated(Math.log(contact), rules.log_contact_s, facts.impact.log_level[kind]));
  const wave = struck(modes, contact, rules.damping[kind], rules, rate).map((sample) => level * sample);
  const peak = Math.max(peakOf(wave), 1);
  return wave.map((sample) => sample / peak);
}

/** Returns the response of modes to one soft pulse; the equations are at the head of impacts.py. */
function struck(modes, contact, damping, rules, rate) {
  const slowest = Math.min(...modes.map((mode) => mode.decay_per_s)) * damping;
  const count = Math.trunc(Math.min(contact + 6 / slowest, rules.longest_s) * rate);
  const pulse = Math.trunc(contact * rate);
  const turn = (2 * Math.PI * rate) / pulse;
  const wave = new Float64Array(count);
  for (const mode of modes) {
    const pole = [-damping * mode.decay_per_s, 2 * Math.PI * mode.frequency_hz];
    const gain = scaled(pole, (mode.gain * rate) / (pulse * Math.hypot(...pole)));
    const [re, im] = times(pole, pole);
    const below = [re + turn * turn, im];
    const pushed = (at) => {
      const time = at / rate;
      const size = Math.exp(pole[0] * time);
      const ring = [size * Math.cos(pole[1] * time), size * Math.sin(pole[1] * time)];
      const [a, b] = times(pole, [ring[0] - Math.cos(turn * time), ring[1]]);
      const swing = over([a + turn * Math.sin(turn * time), b], below);
      const built = over([ring[0] - 1, ring[1]], pole);
      return times(gain, [built[0] - swing[0], built[1] - swing[1]]);
    };
    for (let at = 0; at < Math.min(pulse, count); at++) wave[at] += pushed(at)[1];
    const size = Math.exp(pole[0] / rate);
    const step = [size * Math.cos(pole[1] / rate), size * Math.sin(pole[1] / rate)];
    let value = pushed(pulse);
    for (let at = pulse; at < count; at++) {
      wave[at] += value[1];
      value = times(value, step);
    }
  }
  const fade = Math.min(Math.trunc(rules.end_fade_s * rate), count >> 1);
  for (let at = 0; at < fade; at++) wave[count - fade + at] *= 0.5 + 0.5 * Math.cos((Math.PI * at) / Math.max(fade - 1, 1));
  return wave;
}

/** Returns the waveform of one grain. */
function grain(facts, rules, rate) {
  const mode = {...facts, gain: 1};
  const wave = struck([mode], rules.textures.grain_contact_s, 1, rules.impacts, rate);
  return wave.subarray(0, Math.trunc(rules.textures.grain_s * rate)).map((sample) => facts.gain * sample);
}

/** Returns the level of each period of a wave: sqrt(2) times its rms. */
function levels(wave, period, rate) {
  const size = Math.round(period * rate);
  return Array.from({length: Math.floor(wave.length / size)}, (_, at) => {
    const energy = wave.subarray(at * size, (at + 1) * size).reduce((sum, sample) => sum + sample * sample, 0);
    return Math.min(Math.sqrt((2 * energy) / size), 1);
  });
}

/** Returns the frequency of each period of a wave: that of a sine whose samples differ as much. */
function frequencies(wave, period, rules) {
  const size = Math.round(period * rules.rate_hz);
  const half = Math.round(rules.frequency_s * rules.rate_hz) >> 1;
  const energy = [0];
  const steps = [0, 0];
  wave.forEach((sample, at) => energy.push(energy[at] + sample * sample));
  for (let at = 1; at < wave.length; at++) steps.push(steps[at] + (wave[at] - wave[at - 1]) ** 2);
  return Array.from({length: Math.floor(wave.length / size)}, (_, at) => {
    const middle = at * size + (size >> 1);
    const begin = Math.min(Math.max(middle - half, 0), wave.length - 1);
    const end = Math.min(Math.max(middle + half, 1), wave.length);
    const share = (steps[end] - steps[begin]) / Math.max(energy[end] - energy[begin], 1e-12);
    const hertz = (Math.asin(Math.min(Math.sqrt(Math.max(share, 0)) / 2, 1)) * rules.rate_hz) / Math.PI;
    return Math.min(Math.max(hertz, rules.lowest_hz), rules.highest_hz);
  });
}

/** Returns the drive at the carrier that feels as strong as this wave: controller_scale.py. */
function loudness(wave, weights) {
  const size = weights.length;
  const re = new Float64Array(size);
  const im = new Float64Array(size);
  re.set(wave);
  transform(re, im);
  for (let bin = 0; bin < size; bin++) {
    re[bin] *= weights[bin];
    im[bin] *= weights[bin];
  }
  transform(im, re); // real and imaginary parts exchanged: the inverse
  return re.subarray(0, wave.length);
}

/** Returns the weight of each bin of the transform of one plan, over the number of bins. */
function weightsOf({plan, perception}) {
  let size = 1;
  while (size <= 2 * plan.horizon_s * plan.rate_hz - 1) size *= 2;
  const carrier = driveThreshold(plan.carrier_hz, perception);
  return Float64Array.from({length: size}, (_, bin) => {
    const hertz = (Math.min(bin, size - bin) * plan.rate_hz) / size;
    return 10 ** ((carrier - driveThreshold(hertz, perception)) / 20) / size;
  });
}

/** Returns the drive that is just felt, dB relative to the frequency that a palm feels best. */
function driveThreshold(hertz, {threshold_hz: at, threshold_db: decibels, resonance_hz: resonance, best_hz: best}) {
  const felt = (of) => interpolated(Math.log(Math.max(of, at[0])), at.map(Math.log), decibels);
  return felt(hertz) - felt(best) + 40 * Math.log10(Math.max(hertz, resonance) / best);
}

/** Fourier transform in place; the number of samples is a power of 2. */
function transform(re, im) {
  const count = re.length;
  for (let at = 1, to = 0; at < count; at++) {
    let bit = count >> 1;
    for (; to & bit; bit >>= 1) to ^= bit;
    to ^= bit;
    if (at < to) {
      [re[at], re[to]] = [re[to], re[at]];
      [im[at], im[to]] = [im[to], im[at]];
    }
  }
  for (let half = 1; half < count; half *= 2) {
    for (let order = 0; order < half; order++) {
      const [cosine, sine] = [Math.cos((-Math.PI * order) / half), Math.sin((-Math.PI * order) / half)];
      for (let at = order; at < count; at += 2 * half) {
        const other = at + half;
        const x = re[other] * cosine - im[other] * sine;
        const y = re[other] * sine + im[other] * cosine;
        re[other] = re[at] - x;
        im[other] = im[at] - y;
        re[at] += x;
        im[at] += y;
      }
    }
  }
}

function controllerAmplitude(level, form, {min_level: least, scale, exponent}) {
  return level < least ? 0 : Math.min(scale[form] * level ** exponent, 1);
}

/** Bends a frequency into the band of touch. */
function bent(hertz, {best_hz: best, highest_hz: highest, bend_hz: bend}) {
  return hertz <= best ? hertz : best - (highest - best) * Math.expm1((best - hertz) / bend);
}

/** Returns the value at `x` of a line through points with rising `xs`. */
function interpolated(x, xs, ys) {
  if (x <= xs[0]) return ys[0];
  const after = xs.findIndex((one) => one > x);
  if (after < 0) return ys[ys.length - 1];
  const share = (x - xs[after - 1]) / (xs[after] - xs[after - 1]);
  return ys[after - 1] + share * (ys[after] - ys[after - 1]);
}

/** Returns the value between the samples of a loop, by a cubic through the four around it. */
function cubic(samples, at) {
  const count = samples.length;
  const whole = Math.floor(at);
  const share = at - whole;
  const [a, b, c, d] = [whole + count - 1, whole, whole + 1, whole + 2].map((index) => samples[index % count]);
  return b + 0.5 * share * (c - a + share * (2 * a - 5 * b + 4 * c - d + share * (3 * (b - c) + d - a)));
}

function loopOf({samples, step, drive, wave}) {
  return {samples, drive, wave: Float64Array.from(new Int8Array(bytesOf(wave).buffer), (value) => value * step)};
}

function bytesOf(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

function extended(values, count) {
  const longer = new Float64Array(values.length + count);
  longer.set(values);
  return longer;
}

function peakOf(values) {
  let peak = 0;
  for (const value of values) peak = Math.max(peak, Math.abs(value));
  return peak;
}

function copy(object) {
  return Object.assign(Object.create(Object.getPrototypeOf(object)), object);
}

function times([a, b], [c, d]) {
  return [a * c - b * d, a * d + b * c];
}

function over([a, b], [c, d]) {
  const size = c * c + d * d;
  return [(a * c + b * d) / size, (b * c - a * d) / size];
}

function scaled([a, b], by) {
  return [a * by, b * by];
}

function round(value, digits) {
  return Number(value.toFixed(digits));
}
