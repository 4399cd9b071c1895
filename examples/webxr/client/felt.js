/**
 * One switch for what is felt: the service where it answers and serves this page, else a bake in this page.
 *
 * Every touch goes to both. The bake's player therefore knows each hand at any moment and can take over in the middle of
 * a stroke: when the connection ends, or when a touch is unanswered for BRIDGE_MS, which is before the service's last
 * plan (100 ms) has ended. It hands a hand back when the service sends that hand its next plan.
 */
import {Bake} from './bake.js';
import {isId, isObject, listed, textOf} from './fitting.js';
import {FeelPlayer} from './player.js';

const BRIDGE_MS = 60;
const PLAN_EVERY_MS = 35; // with a plan of 100 ms, two are there for each moment
const HAND_BACK_MS = 1000; // after which a service that stays silent means silence
const FORWARDED = ['welcome', 'decision', 'telemetry', 'ownership', 'skipped', 'refused', 'state'];
const MOST_WARNINGS = 100;
const HANDS = ['left', 'right'];
const MODES = ['auto', 'service', 'baked'];

export class Felt extends EventTarget {
  #haptics;
  #player;
  #bake; // null: no materials.json
  #declared = new Map(); // objects of the scene, by id
  #baked = new Map(); // what the bake has of a touched surface, by object id and surface
  #missing = null; // the touched object that the bake does not have, or has no material of
  #decided = new Map(); // materials that the service rendered, by object id and surface
  #mode;
  #warned = new Set(); // sentences
  #forms = {};
  #hands = Object.fromEntries(HANDS.map((name) => [name, {served: false, touches: false, vibrates: false, plannedAt: -Infinity, missed: null}]));
  #connectedAt = -Infinity;
  #askedAt = null; // time of the first touch that the service has not answered
  #timer = 0;

  /**
   * `haptics` is a `Haptics`, or null for a page that has no service; `feel` is opened by `openFeel`. `materials` is the
   * contents of `materials.json`, or a `Bake`; without it objects are felt as the scene or the service said.
   */
  constructor(haptics, feel, {materials, mode = 'auto'} = {}) {
    super();
    this.#haptics = haptics;
    this.#bake = materials instanceof Bake || !materials ? (materials ?? null) : new Bake(materials);
    this.#player = new FeelPlayer(feel, (touch) => this.surfaceOf(touch));
    this.mode = mode;
    for (const name of FORWARDED) haptics?.addEventListener(name, ({detail}) => this.#forward(name, detail));
    haptics?.addEventListener('vibration', ({detail}) => this.#served(detail));
    this.#timer = setInterval(() => this.#tick(), PLAN_EVERY_MS);
  }

  /** auto (the service where it answers, else the bake), service or baked. */
  get mode() {
    return this.#mode;
  }

  set mode(mode) {
    if (!MODES.includes(mode)) throw new Error(`mode: ${mode} is not one of ${MODES.join(', ')}`);
    if (this.#mode === mode) return;
    this.#mode = mode;
    for (const hand of Object.values(this.#hands)) hand.served = mode === 'service';
    if (mode === 'auto') this.#connectedAt = performance.now();
    this.#tick();
  }

  /** Which of the two is felt now: service or baked. */
  get by() {
    const vibrating = HANDS.filter((name) => this.#hands[name].vibrates);
    return (vibrating.length ? vibrating : HANDS).some((name) => this.#isBaked(name)) ? 'baked' : 'service';
  }

  /** The reason why the bake is felt and not the service, in one sentence; empty while the service is. */
  get bakedBecause() {
    if (this.by === 'service') return '';
    if (this.#mode === 'baked') return 'this page plays its bake';
    return this.#haptics?.silence || 'the service does not answer';
  }

  /** The reason why nothing is felt, in one sentence; empty if there is none. */
  get silence() {
    if (this.by === 'service') return this.#haptics?.silence ?? 'this page has no service: choose `auto` or `baked`';
    if (HANDS.some((name) => this.#hands[name].touches && this.#player.isHeld(name))) return 'outputs stopped: release and touch again';
    return this.#missing ?? '';
  }

  /** Describes all objects of the scene, as `Haptics.scene`. */
  scene(objects, fields = {}) {
    const list = listed(objects, isObject, (text) => this.#warn(`scene: ${text}`));
    if (!list) return;
    const before = this.#declared;
    this.#declared = new Map(list.map((object) => [textOf(object.object_id), object]));
    this.#baked.clear();
    this.#haptics?.scene(list, fields);
    this.#drop([...before.keys()].filter((id) => !this.#declared.has(id)));
  }

  /** Removes objects by their ids, as `Haptics.forget`. */
  forget(ids) {
    const gone = listed(ids, isId, (text) => this.#warn(`forget: ${text}`)) ?? [];
    for (const id of gone) this.#declared.delete(id);
    this.#haptics?.forget(gone);
    this.#drop(gone);
  }

  /** Requests plans for these hands, as `Haptics.feel`. */
  feel(hands) {
    if (!isObject(hands)) return this.#warn('feel: this is not {left, right}: the call is refused');
    this.#forms = hands;
    this.#haptics?.feel(hands);
  }

  /** Sets the gains of vibration and temperature, each 0 to 1. */
  gains(gains) {
    if (!isObject(gains)) return this.#warn('gains: this is not {vibration_gain, thermal_gain}: the call is refused');
    if (gains.vibration_gain !== undefined) this.#player.gain = gains.vibration_gain;
    this.#haptics?.gains(gains);
  }

  /** Sends a touch, as `Haptics.touch`. An object that left the scene is touched again from the next contact on. */
  touch(touch) {
    const now = performance.now();
    const hand = HANDS.includes(touch?.hand) && this.#hands[touch.hand];
    if (!hand) return void this.#player.touch(touch, now / 1000); // which says that there is no such hand
    if (touch.phase === 'slide' && touch.object_id !== undefined && touch.object_id === hand.gone) return;
    hand.gone = null;
    hand.touches = touch.phase !== 'release';
    hand.object = hand.touches ? touch.object_id : null;
    if (hand.touches) this.#miss(touch, this.surfaceOf(touch).material);
    if (this.#haptics?.isConnected && this.#mode !== 'baked') {
      const isAnswered = this.#askedAt === null || this.#haptics.receivedAt >= this.#askedAt;
      if (this.#haptics.isOwner && isAnswered) this.#askedAt = now;
      this.#haptics.touch(touch);
    }
    const onset = this.#player.touch(touch, now / 1000);
    if (touch.phase === 'release') hand.missed = null;
    if (onset) hand.missed = {plan: this.#plan(touch.hand, now), at: now};
    if (!this.#isBaked(touch.hand)) return;
    if (onset) this.#sendMissed(touch.hand, now);
    else if (touch.phase === 'release') this.#send(touch.hand, now);
  }

  /**
   * Returns {object_id, surface} of an object of the page for a touch, as the bake has it; `hit` is the intersection of a
   * Raycaster. An object that the bake does not have keeps its name as its id, and `silence` says so when it is touched.
   */
  bakedOf(object, hit) {
    return this.#bake?.bakedOf(object, hit) ?? {object_id: object?.userData?.name || object?.name};
  }

  /** Returns what is felt of a touched object without the service: a surface of `materials.json`. */
  surfaceOf(touch) {
    const {id, surface} = placeOf(touch);
    const key = `${id} ${surface}`;
    if (!this.#baked.has(key)) this.#baked.set(key, this.#find(id, surface));
    const baked = this.#baked.get(key);
    const material = this.#decided.get(key) ?? baked?.material ?? this.#declared.get(id)?.material;
    return {...baked, material};
  }

  /** Stops outputs at once. */
  stop(scope = 'all') {
    this.#haptics?.stop(scope);
    if (scope === 'peltier') return;
    this.#stopPlayer();
    for (const name of HANDS) {
      if (this.#isBaked(name)) this.#post(name, {period_ms: 12.5, amplitude: [], frequency_hz: [], transients: []}, true);
    }
  }

  close() {
    clearInterval(this.#timer);
    this.#haptics?.close();
  }

  /** Ends the touches of objects that left the scene. */
  #drop(ids) {
    for (const name of HANDS) {
      const {object} = this.#hands[name];
      if (!ids.includes(object)) continue;
      this.touch({phase: 'release', hand: name, speed_mps: 0, force_n: 0});
      this.#hands[name].gone = object;
    }
  }

  /** Finds a surface by its object's id, else by the names that the scene states. */
  #find(id, surface) {
    const {name, surfaces} = this.#declared.get(id) ?? {};
    const found = this.#bake?.find({object_id: id, paths: [name, id].filter(Boolean), engine: 'three', material: surfaces?.[surface]?.name, surface});
    return found && this.#bake.surface(found);
  }

  /** Notes why a touched surface is not felt; says it once in the console. */
  #miss(touch, material) {
    const {id, surface} = placeOf(touch);
    this.#missing = null;
    if (material || (id === undefined && touch.phase === 'approach')) return;
    if (id === undefined) this.#missing = 'the touched object has no name, so no bake has it: name it, or pass an `object_id`';
    else if (this.#baked.get(`${id} ${surface}`)) this.#missing = `the material of \`${id}\` is unknown: correct it in materials.json, or bake with --unknown`;
    else this.#missing = `\`${id}\` is not in the bake; ${this.#bake ? `nearest is \`${this.#bake.nearest(id)}\`` : 'there is no materials.json'}: bake the scene again, or state its material`;
    if (this.by === 'baked') this.#warn(this.#missing);
  }

  /** Writes a sentence to the console, once. */
  #warn(text) {
    if (this.#warned.has(text) || this.#warned.size >= MOST_WARNINGS) return;
    this.#warned.add(text);
    console.warn(`hapticvlm: ${text}`);
  }

  /** Whether the bake is felt by this hand. */
  #isBaked(name) {
    if (this.#mode !== 'auto') return this.#mode === 'baked';
    if (!this.#haptics?.isConnected) return true;
    const now = performance.now();
    const hand = this.#hands[name];
    const {isOwner, receivedAt} = this.#haptics;
    if (!isOwner) hand.served = false; // it serves another scene, or the ghost of this one
    else if (this.#askedAt !== null && receivedAt < this.#askedAt && now - this.#askedAt >= BRIDGE_MS) hand.served = false;
    // A hand that nobody asked plans for is not to wait for one.
    else if (now - this.#connectedAt >= HAND_BACK_MS && !(hand.vibrates && this.#forms[name])) hand.served = true;
    return !hand.served;
  }

  #forward(name, detail) {
    if (name === 'decision' && detail.object_id) this.#decided.set(`${detail.object_id} ${detail.surface ?? 0}`, materialOf(detail));
    if (name === 'state') this.#connectedAt = performance.now();
    if (name === 'state' && detail === 'disconnected') for (const hand of Object.values(this.#hands)) hand.served = false;
    this.dispatchEvent(new CustomEvent(name, {detail}));
    if (name === 'state') this.#tick(true);
  }

  /**
   * Passes a plan of the service on, and hands this hand back to it. A stop holds in both: the bake does not go on where
   * an operator stopped the service, and a service that began after a stop, and does not know of it, is not felt.
   */
  #served(vibration) {
    if (this.#mode === 'baked') return;
    if (vibration.stopped) this.#stopPlayer();
    const vibrates = (vibration.amplitude?.length ?? 0) > 0;
    if (vibrates && this.#player.isHeld(vibration.hand)) return;
    const hand = this.#hands[vibration.hand];
    hand.served = true;
    hand.missed = null;
    hand.vibrates = vibrates;
    this.dispatchEvent(new CustomEvent('vibration', {detail: vibration}));
  }

  #stopPlayer() {
    this.#player.stop();
    for (const hand of Object.values(this.#hands)) hand.missed = null;
  }

  #tick(atOnce = false) {
    const now = performance.now();
    for (const name of HANDS) {
      const hand = this.#hands[name];
      if (!this.#isBaked(name)) continue;
      if (hand.missed) this.#sendMissed(name, now);
      else if (atOnce || now - hand.plannedAt >= PLAN_EVERY_MS) this.#send(name, now);
    }
  }

  /** Sends the plan of an impact that the service did not play; it begins now. */
  #sendMissed(name, now) {
    const {plan, at} = this.#hands[name].missed;
    this.#hands[name].missed = null;
    this.#hands[name].plannedAt = now;
    if (now - at < 4 * PLAN_EVERY_MS) this.#post(name, plan);
  }

  #send(name, now) {
    const hand = this.#hands[name];
    hand.plannedAt = now;
    const plan = this.#plan(name, now);
    if (plan.amplitude.length || hand.vibrates) this.#post(name, plan);
  }

  #plan(name, now) {
    return this.#player.plan(name, this.#forms[name] ?? 'amplitude', now / 1000);
  }

  #post(name, plan, stopped = false) {
    this.#hands[name].vibrates = plan.amplitude.length > 0;
    this.dispatchEvent(new CustomEvent('vibration', {detail: {type: 'vibration', id: 0, hand: name, ...plan, stopped}}));
  }
}

/** Returns the touched object's id, undefined where it has none, and the index of the surface. */
function placeOf(touch) {
  const {object_id: id, surface} = touch ?? {};
  return {id: textOf(id), surface: Number.isInteger(surface) ? surface : 0};
}

function materialOf({felt, material}) {
  return felt ?? (material === 'unknown' ? undefined : material);
}
