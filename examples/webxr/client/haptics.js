/**
 * A scene's connection to HapticVLM: protocol v1 over one WebSocket. Knows no engine.
 *
 * Events, each with the service's message as `detail`: welcome, decision, telemetry, vibration, ownership, skipped,
 * refused (an `error` of the service); and `state`, whose detail is 'connected' or 'disconnected'.
 *
 * What a scene is told once (objects, hands that feel, gains) is said again after each reconnect, and what only an
 * owner may say after each change of owner.
 */
import {decode, encode} from '@msgpack/msgpack';

const FIRST_WAIT = 250; // ms before the first reconnect, doubled each time, with jitter
const LONGEST_WAIT = 5000;
const SILENT = 10_000; // ms without telemetry, which comes ten times a second: the link is dead
const ASK_AGAIN = 2000; // ms between two requests for outputs that another scene owns
const FASTEST = 20; // m/s, the protocol's limit: a tracked hand that jumps is faster
const STRONGEST = 200; // N
const HANDS = ['left', 'right'];

export class Haptics extends EventTarget {
  #url;
  #hello;
  #Socket;
  #socket = null;
  #objects = new Map(); // by id: what the scene has said of each
  #fields = null; // of the scene as a whole; null: nothing was said of it yet
  #settings = {}; // of the owner: feel and gains
  #wait = FIRST_WAIT;
  #retry = 0;
  #watch = 0;
  #heard = 0;
  #ids = 0;
  #isClosed = false;
  #isOpen = false;
  #isOwner = false;
  #wantsOutputs = true;
  #asked = -Infinity; // when the outputs were asked for
  #askId = 0;
  #isStopped = false;
  #problem = ''; // why the service refused this connection or its `feel`, in its words
  #feelId = 0;
  #looking = 0; // id of the frame the service has; 0: none
  #nextFrame = null;

  /** What was not sent: touches while another scene was felt or none, frames that a newer one replaced. */
  lost = {touches: 0, frames: 0};

  constructor(url, {name = 'web scene', version = '1', token, WebSocket = globalThis.WebSocket} = {}) {
    super();
    this.#url = url;
    this.#Socket = WebSocket;
    this.#hello = {client: {name, version}, protocol: {major: 1, minor: 1}, role: 'scene', token};
    this.#connect();
  }

  get isConnected() {
    return this.#isOpen;
  }

  /** Whether this scene drives the outputs: one scene does, and only it is felt. */
  get isOwner() {
    return this.#isOwner;
  }

  /** Why nothing is felt, in one sentence; empty when nothing stands in the way. */
  get silence() {
    if (this.#isClosed) return 'the connection was closed';
    if (!this.#isOpen) return this.#problem || `no service answers at ${this.#url}`;
    if (!this.#wantsOutputs) return 'this scene gave the outputs up';
    if (!this.#isOwner) return 'another scene owns the outputs';
    if (this.#isStopped) return 'a stop holds the outputs: let go and touch again';
    return this.#settings.vibration_gain === 0 ? 'the vibration gain is 0' : this.#problem;
  }

  /** Says what the scene holds, now and after each reconnect; forgets what it held before. */
  scene(objects, fields = {}) {
    this.#objects = new Map(objects.map((object) => [object.object_id, object]));
    this.#fields = fields;
    this.#describe();
  }

  /** States one object anew, as {object_id, material}, or adds it. */
  state(object) {
    const known = {...this.#objects.get(object.object_id), ...object};
    this.#objects.set(object.object_id, known);
    this.#fields ??= {};
    if (this.#isOpen) this.#send('scene', {objects: [known], replace: false});
  }

  /** Forgets objects that are no more, by their ids. */
  forget(ids) {
    for (const id of ids) this.#objects.delete(id);
    if (this.#isOpen) this.#send('scene', {objects: [], replace: false, forget: [...ids]});
  }

  /** Asks for `vibration` events for these hands, as {left: 'amplitude', right: 'amplitude'}. */
  feel(hands) {
    this.#set({feel: hands});
  }

  /** Sets how strong vibration and temperature are, each 0 to 1: {vibration_gain, thermal_gain}. */
  gains(gains) {
    this.#set(gains);
  }

  /** Sends a touch: {phase, hand, object_id, speed_mps, force_n, interaction?}. */
  touch({speed_mps, force_n, ...fields}) {
    if (!this.#isOwner) {
      this.lost.touches++;
      this.#ask();
      return;
    }
    if (fields.phase === 'release') this.#isStopped = false;
    this.#send('touch', {
      captured_at: seconds(),
      ...fields,
      speed_mps: Math.min(FASTEST, speed_mps),
      force_n: Math.min(STRONGEST, force_n),
    });
  }

  /** Sends a frame when the service has answered the one before; the newest waits, older ones are dropped. */
  frame(fields) {
    if (!this.#isOpen || this.#nextFrame) this.lost.frames++;
    if (!this.#isOpen) return;
    this.#nextFrame = {captured_at: seconds(), ...fields};
    this.#pump();
  }

  /** Rests outputs at once: all, speaker or peltier. */
  stop(scope = 'all') {
    if (this.#isOpen) this.#send('stop', {scope});
  }

  /** Gives the outputs up, or takes them again: a scene that nobody looks at should not keep them. */
  own(wanted = true) {
    this.#wantsOutputs = wanted;
    this.#asked = -Infinity;
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

  /** Ends a link on which nothing comes any more; its closing handshake would not end either. */
  #check() {
    if (performance.now() - this.#heard < SILENT) return;
    const dead = this.#socket;
    this.#disconnected();
    dead.close();
  }

  #disconnected() {
    clearInterval(this.#watch);
    const wasOpen = this.#isOpen;
    this.#isOpen = false;
    this.#isOwner = false;
    this.#looking = 0;
    this.#nextFrame = null;
    if (wasOpen) this.#notify('state', 'disconnected');
    if (this.#isClosed) return;
    this.#socket = null;
    this.#retry = setTimeout(() => this.#connect(), this.#wait * (0.5 + Math.random()));
    this.#wait = Math.min(LONGEST_WAIT, 2 * this.#wait);
  }

  #receive(message) {
    this.#heard = performance.now();
    if (message.id && message.id === this.#looking) {
      this.#looking = 0;
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
    this.#wait = FIRST_WAIT;
    this.#problem = '';
    this.#asked = -Infinity;
    this.#watch = setInterval(() => this.#check(), SILENT / 4);
    this.#describe();
    if (message.owner && this.#wantsOutputs) this.#begin();
    else if (message.owner) this.#send('set', {ownership: 'give'});
    this.#notify('welcome', message);
    this.#notify('state', 'connected');
  }

  /** Says what only the owner may say, and lets go of what a stop of an earlier session may hold. */
  #begin() {
    this.#isOwner = true;
    this.#isStopped = false;
    const {feel, ...gains} = this.#settings;
    for (const hand of HANDS) this.#send('touch', {phase: 'release', hand, speed_mps: 0, force_n: 0, captured_at: seconds()});
    if (Object.keys(gains).length) this.#send('set', gains);
    if (feel) this.#feelId = this.#send('set', {feel});
  }

  /** Follows whose the outputs are; takes them when they are free. */
  #follow(message) {
    this.#isOwner = message.owner;
    if (message.free) this.#asked = -Infinity;
    if (message.free) this.#ask();
    this.#notify('ownership', message);
  }

  #ask() {
    if (!this.#isOpen || this.#isOwner || !this.#wantsOutputs || performance.now() < this.#asked + ASK_AGAIN) return;
    this.#asked = performance.now();
    this.#askId = this.#send('set', {ownership: 'take'});
  }

  #granted({id}) {
    if (id !== this.#askId) return;
    this.#askId = 0;
    this.#begin();
    this.#notify('ownership', {type: 'ownership', id, owner: true, free: false});
  }

  #refused(message) {
    if (message.code === 'unsafe') this.#isStopped = true;
    if (message.code === 'not_owner') this.#isOwner = false;
    if (!this.#isOpen || message.id === this.#feelId) this.#problem = message.text;
    if (message.id && message.id === this.#askId) this.#askId = 0; // the owner is not idle: asked again at a touch
    else this.#notify('refused', message);
  }

  #describe() {
    if (this.#isOpen && this.#fields) this.#send('scene', {...this.#fields, objects: [...this.#objects.values()], replace: true});
  }

  #set(settings) {
    Object.assign(this.#settings, settings);
    if (!this.#isOwner) return;
    const id = this.#send('set', settings);
    if (settings.feel) this.#feelId = id;
  }

  #pump() {
    if (this.#looking || !this.#nextFrame) return;
    const frame = this.#nextFrame;
    this.#nextFrame = null;
    this.#looking = this.#send('frame', frame);
  }

  #send(type, fields) {
    const id = ++this.#ids;
    this.#socket.send(encode({type, id, ...fields}, {ignoreUndefined: true}));
    return id;
  }

  #notify(type, detail) {
    this.dispatchEvent(new CustomEvent(type, {detail}));
  }
}

function seconds() {
  return performance.now() / 1000;
}
