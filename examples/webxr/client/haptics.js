/**
 * A scene's connection to HapticVLM: protocol v1 over one WebSocket. Works with any engine.
 *
 * Events, each with the service's message as `detail`: welcome, decision, telemetry, vibration, ownership, textures,
 * skipped, refused (an `error` of the service); `state`, whose detail is 'connected' or 'disconnected'; and `left_out`, whose
 * detail names a part of the scene that was not sent or not taken: {object_id?, path, text}. Whatever is refused or left
 * out also goes to the console, once.
 *
 * Objects, requested hands and gains are sent again after each reconnect, and the settings of the
 * owner after each change of owner.
 */
import {decode} from '@msgpack/msgpack';
import {encoded, fitted, isId, isObject, listed, pieces} from './fitting.js';

const FIRST_WAIT = 250; // ms before the first reconnect, doubled each time, with jitter
const LONGEST_WAIT = 5000;
const SILENT = 10_000; // ms without telemetry, which arrives ten times a second, until the link counts as dead
const ASK_AGAIN = 2000; // ms between two requests for outputs that another scene owns
const FASTEST = 20; // m/s, the protocol's limit, which a jumping tracked hand can exceed
const STRONGEST = 200; // N
const GENTLE = 1.5; // N, of an engine that computes no forces
const MOST_WARNINGS = 100;
const HANDS = ['left', 'right'];

export class Haptics extends EventTarget {
  #url;
  #hello;
  #Socket;
  #socket = null;
  #objects = new Map(); // descriptions by id
  #fields = null; // fields of the whole scene; null: not set yet
  #settings = {}; // settings of the owner: feel and gains
  #wait = FIRST_WAIT;
  #retry = 0;
  #watch = 0;
  #receivedAt = 0;
  #ids = 0;
  #minor = 0; // of the service's protocol
  #isClosed = false;
  #isOpen = false;
  #isOwner = false;
  #wantsOutputs = true;
  #askedAt = -Infinity; // time of the last request for the outputs
  #askId = 0;
  #isStopped = false;
  #problem = ''; // the service's reason for refusing this connection or its `feel`
  #feelId = 0;
  #materials = []; // of the service
  #pieces = new Map(); // unanswered `scene` messages by id: their objects
  #warned = new Set();
  #sceneProblem = ''; // the reason why the scene was refused as a whole
  #frameId = 0; // id of the unanswered frame; 0: none
  #nextFrame = null;

  /** Numbers of dropped messages: touches without ownership of the outputs, frames replaced by a newer one. */
  lost = {touches: 0, frames: 0};

  constructor(url, {name = 'web scene', version = '1', token, WebSocket = globalThis.WebSocket} = {}) {
    super();
    if (!WebSocket) throw new TypeError('this platform has no WebSocket: pass the class of the package ws, as {WebSocket}');
    this.#url = url;
    this.#Socket = WebSocket;
    this.#hello = {client: {name, version}, protocol: {major: 1, minor: 2}, role: 'scene', token};
    this.#connect();
  }

  get isConnected() {
    return this.#isOpen;
  }

  /** Whether this scene owns the outputs and is felt; one scene does at a time. */
  get isOwner() {
    return this.#isOwner;
  }

  /** Time of the service's last message, on the clock of `performance.now`, ms. */
  get receivedAt() {
    return this.#receivedAt;
  }

  /** The reason why nothing is felt, in one sentence; empty if there is none. */
  get silence() {
    if (this.#isClosed) return 'the connection was closed';
    if (!this.#isOpen) return this.#problem || `no service answers at ${this.#url}${this.#isForeign() ? ', or it refuses this page: its log says so' : ''}`;
    if (!this.#wantsOutputs) return 'this scene released the outputs';
    if (!this.#isOwner) return 'another scene owns the outputs';
    if (this.#isStopped) return 'outputs stopped: release and touch again';
    if (this.#settings.vibration_gain === 0) return 'the vibration gain is 0';
    if (this.#sceneProblem) return `the service refused the scene: ${this.#sceneProblem}`;
    return this.#problem;
  }

  /** Describes all objects of the scene, now and after each reconnect; replaces earlier objects. */
  scene(objects, fields = {}) {
    const list = listed(objects, isObject, (text) => this.#leftOut(undefined, 'objects', text));
    if (!list) return;
    this.#objects = new Map();
    for (const object of list) {
      const id = object.object_id;
      if (this.#objects.has(id)) this.#leftOut(id, 'object_id', 'another object has this id: left out; give each object its own');
      else this.#objects.set(id, object);
    }
    this.#fields = fields;
    this.#describe();
  }

  /** Changes or adds one object, as {object_id, material}. */
  state(object) {
    const known = {...this.#objects.get(object?.object_id), ...object};
    this.#objects.set(known.object_id, known);
    this.#fields ??= {};
    if (this.#isOpen) this.#sendObjects([known], {replace: false});
  }

  /** Removes objects by their ids. */
  forget(ids) {
    const gone = listed(ids, isId, (text) => this.#leftOut(undefined, 'forget', text)) ?? [];
    for (const id of gone) this.#objects.delete(id);
    if (this.#isOpen && gone.length) this.#send('scene', {objects: [], replace: false, forget: gone});
  }

  /** Requests `vibration` events for these hands, as {left: 'amplitude', right: 'amplitude'}. */
  feel(hands) {
    this.#set({feel: hands});
  }

  /** Sets the gains of vibration and temperature, each 0 to 1: {vibration_gain, thermal_gain}. */
  gains(gains) {
    this.#set(gains);
  }

  /** Sends a touch: {phase, hand, object_id, surface?, speed_mps, force_n, interaction?}. */
  touch(touch) {
    const {speed_mps, force_n, ...fields} = touch ?? {};
    if (!this.#isOwner) {
      this.lost.touches++;
      this.#ask();
      return;
    }
    if (fields.phase === 'release') this.#isStopped = false;
    const id = fields.object_id;
    if (id !== undefined && !this.#objects.has(id)) this.#warn(`a touch of \`${String(id)}\`, which no scene has described: its id is read as a name`);
    this.#send('touch', {
      captured_at: seconds(),
      ...fields,
      speed_mps: this.#within(FASTEST, speed_mps, 'speed_mps', 0),
      force_n: this.#within(STRONGEST, force_n, 'force_n', GENTLE),
    });
  }

  /** Returns a quantity within 0 and its limit; the default for one that is missing or not a number. */
  #within(most, value, name, missing) {
    if (Number.isFinite(value) || value === Infinity) return Math.min(most, Math.max(0, value));
    this.#warn(`a touch with ${name} ${value}: ${missing} is sent; pass a number`);
    return missing;
  }

  /** Sends a frame once the service has answered the last one; the newest waits, older ones are dropped. */
  frame(fields) {
    if (!this.#isOpen || this.#nextFrame) this.lost.frames++;
    if (!this.#isOpen) return;
    this.#nextFrame = {captured_at: seconds(), ...fields};
    this.#pump();
  }

  /** Sends the texture map of this hash, as a frame without object, if a surface still states it. */
  texture(hash, fields) {
    const place = this.#isOpen && surfaceWith(this.#objects.values(), hash);
    if (place) this.#send('frame', {captured_at: seconds(), ...fields, ...place, purpose: 'texture'});
  }

  /** Stops outputs at once: all, speaker or peltier. */
  stop(scope = 'all') {
    if (this.#isOpen) this.#send('stop', {scope});
  }

  /** Takes or releases the outputs; a hidden scene should release them. */
  own(wanted = true) {
    this.#wantsOutputs = wanted;
    this.#askedAt = -Infinity;
    if (wanted) this.#ask();
    else if (this.#isOpen) this.#send('set', {ownership: 'give'});
    if (!wanted) this.#isOwner = false;
  }

  close() {
    this.#isClosed = true;
    clearTimeout(this.#retry);
    clearInterval(this.#watch);
    this.#socket?.close();
  }

  #connect() {
    const socket = new this.#Socket(this.#url);
    this.#socket = socket;
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => this.#send('hello', this.#hello);
    socket.onmessage = ({data}) => socket === this.#socket && this.#receive(decode(new Uint8Array(data)));
    socket.onclose = () => socket === this.#socket && this.#disconnected();
    socket.onerror = () => {}; // `onclose` follows
  }

  /** Drops a dead link without waiting for its closing handshake, which would not end either. */
  #check() {
    if (performance.now() - this.#receivedAt < SILENT) return;
    const dead = this.#socket;
    this.#disconnected();
    dead.close();
  }

  #disconnected() {
    clearInterval(this.#watch);
    const wasOpen = this.#isOpen;
    this.#isOpen = false;
    this.#isOwner = false;
    this.#frameId = 0;
    this.#nextFrame = null;
    this.#pieces.clear();
    if (wasOpen) this.#notify('state', 'disconnected');
    if (this.#isClosed) return;
    this.#socket = null;
    this.#retry = setTimeout(() => this.#connect(), this.#wait * (0.5 + Math.random()));
    this.#wait = Math.min(LONGEST_WAIT, 2 * this.#wait);
  }

  #receive(message) {
    this.#receivedAt = performance.now();
    if (message.id && message.id === this.#frameId) {
      this.#frameId = 0;
      this.#pump();
    }
    if (message.type === 'welcome') this.#welcomed(message);
    else if (message.type === 'ownership') this.#follow(message);
    else if (message.type === 'error') this.#refused(message);
    else if (message.type === 'ok') this.#granted(message);
    else {
      if (message.type === 'vibration') this.#isStopped = message.stopped ?? false;
      this.#notify(message.type, message);
    }
  }

  #welcomed(message) {
    this.#isOpen = true;
    this.#minor = message.protocol.minor;
    this.#materials = message.materials ?? [];
    this.#sceneProblem = '';
    this.#wait = FIRST_WAIT;
    this.#problem = '';
    this.#askedAt = -Infinity;
    this.#watch = setInterval(() => this.#check(), SILENT / 4);
    this.#describe();
    if (message.owner && this.#wantsOutputs) this.#begin();
    else if (message.owner) this.#send('set', {ownership: 'give'});
    this.#notify('welcome', message);
    this.#notify('state', 'connected');
  }

  /** Sends the owner's settings, and a release for each hand, which ends a stop of an earlier session. */
  #begin() {
    this.#isOwner = true;
    this.#isStopped = false;
    const {feel, ...gains} = this.#settings;
    for (const hand of HANDS) this.#send('touch', {phase: 'release', hand, speed_mps: 0, force_n: 0, captured_at: seconds()});
    if (Object.keys(gains).length) this.#send('set', gains);
    if (feel) this.#feelId = this.#send('set', {feel});
  }

  /** Applies a change of ownership; takes the outputs when they are free. */
  #follow(message) {
    this.#isOwner = message.owner;
    if (message.free) this.#askedAt = -Infinity;
    if (message.free) this.#ask();
    this.#notify('ownership', message);
  }

  #ask() {
    if (!this.#isOpen || this.#isOwner || !this.#wantsOutputs || performance.now() < this.#askedAt + ASK_AGAIN) return;
    this.#askedAt = performance.now();
    this.#askId = this.#send('set', {ownership: 'take'});
  }

  #granted({id, left_out: leftOut = []}) {
    const objects = this.#pieces.get(id);
    this.#pieces.delete(id);
    for (const {path, text} of leftOut) this.#leftOut(objects?.[/^objects\[(\d+)\]/.exec(path)?.[1]]?.object_id, path, text);
    if (id !== this.#askId) return;
    this.#askId = 0;
    this.#begin();
    this.#notify('ownership', {type: 'ownership', id, owner: true, free: false});
  }

  #refused(message) {
    const isAsked = message.path === '$.token' && !this.#hello.token && new URL(this.#url).host === globalThis.location?.host;
    if (isAsked) this.#getToken().then((isGiven) => isGiven || this.#tell(message));
    else this.#tell(message);
  }

  /** Gets the token with which this browser got the page from the same service; the next connection has it. */
  async #getToken() {
    const answer = await fetch('/token', {cache: 'no-store'}).catch(() => null);
    if (answer?.ok) this.#hello.token = await answer.text();
    return Boolean(answer?.ok);
  }

  #tell(message) {
    if (message.code === 'unsafe') this.#isStopped = true;
    if (message.code === 'not_owner') this.#isOwner = false;
    if (!this.#isOpen || message.id === this.#feelId) this.#problem = message.text;
    if (this.#pieces.delete(message.id)) this.#sceneProblem = message.text;
    if (message.id && message.id === this.#askId) this.#askId = 0; // the owner is not idle: requested again at a later touch
    else {
      if (!['unsafe', 'not_owner'].includes(message.code)) this.#warn(`the service refused a message: ${message.text}`);
      this.#notify('refused', message);
    }
  }

  #describe() {
    if (this.#isOpen && this.#fields) this.#sendObjects([...this.#objects.values()], {...this.#fields, replace: true});
  }

  /** Sends objects as they fit the protocol, in as many messages as they need. */
  #sendObjects(objects, fields) {
    const fit = objects.map((object) => fitted(object, this.#materials, (path, text) => this.#leftOut(object.object_id, path, text)));
    for (const [number, piece] of pieces(fit, ({object_id: id}, text) => this.#leftOut(id, 'fields', text)).entries()) {
      const id = this.#send('scene', {...(number ? {replace: false} : fields), objects: piece});
      this.#pieces.set(id, piece);
    }
  }

  /** Tells of a part of the scene that was not sent or not taken. */
  #leftOut(object_id, path, text) {
    this.#warn(`${object_id === undefined ? 'the scene' : `object \`${String(object_id)}\``}, ${path}: ${text}`);
    this.#notify('left_out', {object_id, path, text});
  }

  /** Writes a sentence to the console, once. */
  #warn(text) {
    if (this.#warned.has(text) || this.#warned.size >= MOST_WARNINGS) return;
    this.#warned.add(text);
    console.warn(`hapticvlm: ${text}`);
  }

  /** Whether the page comes from another place than the service, which may refuse it then. */
  #isForeign() {
    const {origin, hostname, host} = globalThis.location ?? {};
    return origin !== undefined && !/^(localhost|127\.0\.0\.1|\[::1\])$/.test(hostname) && host !== new URL(this.#url).host;
  }

  #set(settings) {
    if (!isObject(settings)) return this.#warn('settings that are not an object are not sent');
    Object.assign(this.#settings, settings);
    if (!this.#isOwner) return;
    const id = this.#send('set', settings);
    if (settings.feel) this.#feelId = id;
  }

  #pump() {
    if (this.#frameId || !this.#nextFrame) return;
    const frame = this.#nextFrame;
    this.#nextFrame = null;
    this.#frameId = this.#send('frame', frame);
  }

  #send(type, fields) {
    const id = ++this.#ids;
    const known = this.#minor < 2 ? withoutSurfaces(fields) : fields;
    const bytes = encoded({type, id, ...known}, (text) => this.#warn(`${type}: ${text}`));
    if (bytes) this.#socket.send(bytes);
    return id;
  }

  #notify(type, detail) {
    this.dispatchEvent(new CustomEvent(type, {detail}));
  }
}

/** Returns fields as a service before protocol 1.2 takes them: each object is its largest surface. */
function withoutSurfaces({surface, objects, ...fields}) {
  return objects ? {...fields, objects: objects.map(asLargest)} : fields;
}

function asLargest({surfaces, ...object}) {
  const [largest] = surfaces ?? [];
  if (!largest) return object;
  const {opacity, ...shader} = largest.shader ?? {};
  return {name: largest.name, material: largest.material, shader: largest.shader && shader, ...object};
}

/** Returns the first surface that states this texture, as {object_id, surface}; null: none does. */
function surfaceWith(objects, hash) {
  for (const {object_id, surfaces = []} of objects) {
    const surface = surfaces.findIndex(({texture}) => texture === hash);
    if (surface >= 0) return {object_id, surface};
  }
  return null;
}

function seconds() {
  return performance.now() / 1000;
}
