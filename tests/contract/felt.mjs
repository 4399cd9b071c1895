/**
 * Plays the scripts of tests/support/switch_cases.py, JSON on its input, on a clock of our own. `Haptics`, `Felt` and
 * `Pulses` are real; the socket is ours, with a player behind it that answers as a service does. Prints what they say.
 */
import {readFileSync} from 'node:fs';

let now = 1000;
const timers = new Map();
let timer = 0;
Object.defineProperty(globalThis, 'performance', {value: {now: () => now}});
const every = (call, wait, again) => timers.set(++timer, {call, at: now + wait, wait: again ? wait : 0}) && timer;
globalThis.setTimeout = (call, wait) => every(call, wait, false);
globalThis.setInterval = (call, wait) => every(call, wait, true);
globalThis.clearTimeout = globalThis.clearInterval = (id) => timers.delete(id);
Math.random = () => 0.5;

const {Bake, Haptics, Pulses, Felt, FeelPlayer, openFeel} = await import('../../examples/webxr/client/index.js');
const {decode, encode} = await import('@msgpack/msgpack');
const FEEL = new URL('../../examples/webxr/client/feel.true.json', import.meta.url);
const feel = openFeel(JSON.parse(readFileSync(FEEL)));
const STRIKE = 0.2; // the vibration of a struck glass is above it
const STEP_MS = 1;
const PICTURE_MS = 11;
const TOUCH_MS = 16;
const PLAN_MS = 40;

/** The service: alive, frozen (the socket stays open and says nothing) or dead. */
const service = {state: 'alive', sockets: new Set(), isOurs: true};

class Socket {
  #player = new FeelPlayer(feel, ({object_id: material}) => ({material}));
  #hands = new Set();
  #plannedAt = now;

  constructor() {
    setTimeout(() => (service.state === 'dead' ? this.onclose() : this.#open()), 1);
  }

  #open() {
    service.sockets.add(this);
    this.onopen();
  }

  close() {
    if (service.sockets.delete(this)) this.onclose();
  }

  send(data) {
    if (service.state !== 'alive') return;
    const {type, id, ...fields} = decode(data);
    if (type === 'hello') return this.#answer({type: 'welcome', id, owner: service.isOurs, protocol: {major: 1, minor: 2}});
    if (type === 'set' && fields.ownership && !service.isOurs) return this.#answer({type: 'error', id, code: 'not_owner', text: 'in use'});
    if (type === 'stop') this.stop();
    if (type === 'touch') {
      const onset = this.#player.touch(fields, now / 1000);
      this.#hands.add(fields.hand);
      if (onset) this.#plan(fields.hand);
    }
    this.#answer({type: 'ok', id});
  }

  stop() {
    this.#player.stop();
    for (const hand of this.#hands) this.#answer({type: 'vibration', id: 0, hand, period_ms: 12.5, amplitude: [], stopped: true});
  }

  step() {
    if (service.state !== 'alive' || now - this.#plannedAt < PLAN_MS) return;
    this.#plannedAt = now;
    for (const hand of this.#hands) this.#plan(hand);
    this.#answer({type: 'telemetry', id: 0});
  }

  #plan(hand) {
    const plan = this.#player.plan(hand, 'amplitude', now / 1000);
    if (plan.amplitude.length) this.#answer({type: 'vibration', id: 0, hand, ...plan});
  }

  #answer(message) {
    setTimeout(() => service.sockets.has(this) && service.state === 'alive' && this.onmessage({data: encode(message)}), 2);
  }
}

function change(state) {
  service.state = state;
  if (state === 'dead') for (const socket of [...service.sockets]) socket.close();
}

function scene(mode, hasService = true) {
  service.state = hasService ? 'alive' : 'dead';
  service.sockets.clear();
  timers.clear();
  const haptics = new Haptics('ws://here', {WebSocket: Socket});
  const felt = new Felt(haptics, feel, {mode});
  const pulses = new Pulses();
  felt.scene(['rubber', 'stone', 'glass'].map((name) => ({object_id: name, material: name})));
  pulses.follow(felt);
  return {felt, pulses, told: [], played: 0};
}

/** Lets time pass; `at` is called each TOUCH_MS. Pictures are drawn each PICTURE_MS. */
function pass(one, ms, at) {
  for (const end = now + ms; now < end; now += STEP_MS) {
    for (const [id, entry] of [...timers]) {
      if (!timers.has(id) || entry.at > now) continue;
      if (entry.wait) entry.at = now + entry.wait;
      else timers.delete(id);
      entry.call();
    }
    for (const socket of service.sockets) socket.step();
    if (now % TOUCH_MS === 0) at?.();
    if (now % PICTURE_MS === 0) one.told.push({at: now, amplitude: one.pulses.play({handedness: 'right', gamepad: {hapticActuators: [{pulse() {}}]}})});
  }
}

const touch = (one, phase, object_id, more = {}) => one.felt.touch({phase, hand: 'right', object_id, speed_mps: 0.5, force_n: 2, ...more});

/** Returns the longest time without vibration after `since`, ms. */
function longestGap({told}, since) {
  let [gap, quietSince] = [0, null];
  for (const {at, amplitude} of told.filter((each) => each.at >= since)) {
    if (amplitude > 0) quietSince = null;
    else gap = Math.max(gap, at - (quietSince ??= at - PICTURE_MS));
  }
  return gap;
}

const strongest = ({told}, since) => Math.max(...told.filter(({at}) => at >= since).map(({amplitude}) => amplitude));

/** Follows a script of tests/support/switch_cases.py; returns what it says, by name. */
function play(steps) {
  const said = {};
  let one = null;
  let since = now;
  const soon = () => one.told.find(({at, amplitude}) => at >= since && amplitude >= STRIKE)?.at - since;
  const seen = {
    felt: () => strongest(one, since), gap: () => longestGap(one, since), soon,
    by: () => one.felt.by, silence: () => one.felt.silence, because: () => one.felt.bakedBecause,
  };
  const act = {
    begin(mode, how) {
      service.isOurs = how !== 'beside';
      one = scene(mode, how !== 'alone');
    },
    pass: (ms, phase, id) => pass(one, Number(ms), phase && (() => touch(one, phase, id))),
    touch: (phase, id) => touch(one, phase, id),
    service: change,
    stop(who) {
      if (!who) one.felt.stop();
      for (const socket of service.sockets) {
        if (who === 'another') socket.stop();
        if (who === 'left') socket.onmessage({data: encode({type: 'vibration', id: 0, hand: 'left', period_ms: 12.5, amplitude: [], stopped: true})});
      }
    },
    mode: (mode) => (one.felt.mode = mode),
    own() {
      service.isOurs = true;
      for (const socket of service.sockets) socket.onmessage({data: encode({type: 'ownership', id: 0, owner: true, free: false})});
    },
    mark: () => (since = now),
    say: (name, what) => seen[what] && (said[name] = seen[what]()),
  };
  for (const step of steps) {
    const [what, ...words] = step.split(' ');
    act[what](...words);
  }
  return said;
}

/** A stroked object leaves the scene, and the page goes on stroking it; then another hand touches it anew. */
function gone() {
  const one = scene('baked', false);
  touch(one, 'contact', 'stone');
  pass(one, 300, () => touch(one, 'slide', 'stone'));
  one.felt.scene([{object_id: 'glass', material: 'glass'}]);
  const since = now + 50;
  pass(one, 400, () => touch(one, 'slide', 'stone'));
  const after = strongest(one, since);
  touch(one, 'slide', 'glass');
  pass(one, 100, () => touch(one, 'slide', 'glass'));
  return {after, other: strongest(one, now - 50)};
}

/** A service that welcomes a scene, and says no more. */
class Deaf {
  constructor() {
    setTimeout(() => this.onmessage({data: encode({type: 'welcome', id: 1, owner: true, protocol: {major: 1, minor: 2}})}), 0);
  }

  send() {}

  close() {}
}

/** Returns the names of calls with values of no sense that throw, and what they left in the prototype of all objects. */
function odd() {
  const file = new URL('../identity_cases.json', import.meta.url);
  const bake = new Bake(JSON.parse(readFileSync(file)));
  timers.clear();
  const haptics = new Haptics('ws://here', {WebSocket: Deaf});
  const felt = new Felt(haptics, feel, {materials: bake});
  haptics.feel({left: 'amplitude'});
  const said = [];
  const {warn} = console;
  console.warn = (text) => said.push(text);
  const calls = {
    hand: (odd) => felt.touch({phase: 'contact', hand: odd, object_id: 'cup'}),
    place: (odd) => felt.touch({phase: 'contact', hand: 'left', object_id: odd, surface: odd}),
    objects: (odd) => felt.scene([{object_id: odd, name: odd, surfaces: odd, odd}]),
    part: (odd) => felt.bakedOf({name: odd, material: odd, userData: odd, parent: {isGroup: true, children: odd}}, odd),
    query: (odd) => bake.find({object_id: odd, paths: odd, material: odd, engine: odd}),
    path: (odd) => bake.find({paths: [odd]}),
    learn: (odd) => Bake.learn(odd),
    samples: (odd) => new FeelPlayer(feel, () => odd, {soundHz: 8000}).render(odd, 0),
  };
  for (const [name, of] of [['bake', bake], ['haptics', haptics], ['felt', felt]]) {
    for (const method of ['scene', 'forget', 'feel', 'gains', 'touch', 'bakedOf', 'surfaceOf', 'surface', 'find', 'nearest']) {
      if (of[method]) calls[`${name}.${method}`] = (odd) => of[method](odd);
    }
  }
  const ring = {};
  Object.assign(ring, {parent: ring, children: [ring]});
  const thrown = [];
  for (const [name, call] of Object.entries(calls)) {
    for (const each of [null, undefined, 7, NaN, 'x', '__proto__', {}, [], [null], [7], [{}], Symbol('x'), () => 1, ring, [ring], -1, 1e300]) {
      try {
        call(each);
        [felt.by, felt.silence, now += 40] && timers.forEach((timer) => timer.call());
      } catch ({message}) {
        thrown.push(`${name}: ${message}`);
      }
    }
  }
  felt.close();
  console.warn = warn;
  const alone = new Felt(null, feel, {mode: 'baked'});
  alone.touch({phase: 'contact', hand: 'left', ...alone.bakedOf({})});
  const nameless = alone.silence;
  alone.close();
  let raw = '';
  try {
    new Felt(null, JSON.parse(readFileSync(FEEL)));
  } catch ({message}) {
    raw = message;
  }
  return {raw, nameless, thrown, inherited: Object.keys(Object.prototype), saidTwice: said.filter((text, at) => said.indexOf(text) !== at)};
}

const scripts = Object.entries(JSON.parse(readFileSync(0, 'utf8')));
console.log(JSON.stringify({odd: odd(), gone: gone(), said: Object.fromEntries(scripts.map(([name, steps]) => [name, play(steps)]))}));
