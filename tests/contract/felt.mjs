/**
 * A hand strokes for seconds while the service behind it dies, freezes and comes back, on a clock of our own. `Haptics`,
 * `Felt` and `Pulses` are real; the socket is ours, with a player behind it that answers as a service does.
 * Prints, as JSON, what the motor was told: gaps, strikes, and what came after a stop.
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

const {Haptics, Pulses, Felt, FeelPlayer, openFeel} = await import('../../examples/webxr/client/index.js');
const {decode, encode} = await import('@msgpack/msgpack');
const feel = openFeel(JSON.parse(readFileSync(new URL('../../examples/webxr/client/feel.true.json', import.meta.url))));
const CHANGES = Number(process.argv[2] ?? 20);
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

/** Strokes through `count` deaths or freezes of the service. */
function stroke(mode, state, count) {
  const one = scene(mode);
  pass(one, 200);
  touch(one, 'contact', 'rubber');
  pass(one, 300, () => touch(one, 'slide', 'rubber'));
  const since = now;
  const by = new Set();
  for (let change_ = 0; change_ < count; change_++) {
    change(state);
    pass(one, 300 + 7 * (change_ % 9), () => touch(one, 'slide', 'rubber'));
    by.add(one.felt.by);
    change('alive');
    pass(one, 700, () => touch(one, 'slide', 'rubber'));
    by.add(one.felt.by);
  }
  return {gap_ms: longestGap(one, since), by: [...by].sort()};
}

/** Strikes glass just after the service froze, and while it is gone. */
function strike(state, afterMs) {
  const one = scene('auto');
  pass(one, 1500);
  change(state);
  pass(one, afterMs);
  const since = now;
  touch(one, 'contact', 'glass');
  pass(one, 140, () => touch(one, 'contact', 'glass'));
  return strongest(one, since);
}

/** Stops in the middle of a stroke that goes on; with a service and without. */
function stopped(hasService) {
  const one = scene('auto', hasService);
  pass(one, 1500);
  touch(one, 'contact', 'stone');
  pass(one, 300, () => touch(one, 'slide', 'stone'));
  one.felt.stop();
  pass(one, 30);
  const since = now;
  change(hasService ? 'dead' : 'alive'); // the other one takes over, and has to hold, too
  pass(one, 6000, () => touch(one, 'slide', 'stone')); // longer than until the next attempt to connect
  const isBack = one.felt.by === 'service';
  const held = strongest(one, since);
  const silences = [one.felt.silence];
  touch(one, 'release', undefined);
  pass(one, 50);
  const again = now;
  touch(one, 'contact', 'stone');
  pass(one, 100);
  return {held, isBack, again: strongest(one, again), silences: [...silences, one.felt.silence]};
}

/** An operator stops the service in the middle of a stroke, and then the service dies. */
function stoppedByAnother() {
  const one = scene('auto');
  pass(one, 1500);
  touch(one, 'contact', 'stone');
  pass(one, 300, () => touch(one, 'slide', 'stone'));
  for (const socket of service.sockets) socket.stop();
  pass(one, 30);
  const since = now;
  change('dead');
  pass(one, 900, () => touch(one, 'slide', 'stone'));
  return {held: strongest(one, since)};
}

/** The service swallows a strike, tells that the other hand was stopped, and dies. */
function stoppedMeanwhile() {
  const one = scene('auto');
  pass(one, 1500);
  change('frozen');
  const since = now;
  touch(one, 'contact', 'glass');
  const stop = {type: 'vibration', id: 0, hand: 'left', period_ms: 12.5, amplitude: [], stopped: true};
  for (const socket of service.sockets) socket.onmessage({data: encode(stop)});
  change('dead');
  pass(one, 140);
  return {held: strongest(one, since)};
}

/** Is felt for a while in this mode, and says by what. */
function mode(name, hasService) {
  const one = scene(name, hasService);
  pass(one, 1500);
  const since = now;
  touch(one, 'contact', 'stone');
  pass(one, 300, () => touch(one, 'slide', 'stone'));
  return {felt: strongest(one, since) > 0, by: one.felt.by, silence: one.felt.silence};
}

/** Another page owns the outputs; then it leaves them, and the service tells so. */
function secondPage() {
  service.isOurs = false;
  const one = scene('auto');
  pass(one, 1500);
  touch(one, 'contact', 'stone');
  pass(one, 1000, () => touch(one, 'slide', 'stone'));
  const [since, by, because] = [now, one.felt.by, one.felt.bakedBecause];
  const beside = strongest(one, since - 900);
  service.isOurs = true;
  for (const socket of service.sockets) socket.onmessage({data: encode({type: 'ownership', id: 0, owner: true, free: false})});
  pass(one, 500, () => touch(one, 'slide', 'stone'));
  return {felt: beside > 0, by, because, then: [one.felt.by, one.felt.bakedBecause], gap_ms: longestGap(one, since)};
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

console.log(JSON.stringify({
  'a second page': secondPage(),
  'an object that is gone': gone(),
  deaths: stroke('auto', 'dead', CHANGES),
  freezes: stroke('auto', 'frozen', CHANGES),
  'strike after a freeze': strike('frozen', 5),
  'strike after a death': strike('dead', 5),
  'strike long after': strike('dead', 2000),
  'stop with a service': stopped(true),
  'stop without one': stopped(false),
  'stop by another': stoppedByAnother(),
  'stop of a missed strike': stoppedMeanwhile(),
  'auto, service': mode('auto', true),
  'auto, none': mode('auto', false),
  'baked, service': mode('baked', true),
  'service, none': mode('service', false),
}));
