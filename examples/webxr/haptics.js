/**
 * A scene's connection to HapticVLM: protocol v1 over one WebSocket. Knows nothing of three.js.
 *
 * Events, each with the service's message as `detail`: welcome, decision, telemetry, vibration, skipped, refused
 * (an `error` of the service); and `state`, whose detail is 'connected' or 'disconnected'.
 */
import {decode, encode} from '@msgpack/msgpack';

const FIRST_WAIT = 250; // ms before the first reconnect, doubled each time, with jitter
const LONGEST_WAIT = 5000;
const FASTEST = 20; // m/s, the protocol's limit: a tracked hand that jumps is faster
const STRONGEST = 200; // N

export class Haptics extends EventTarget {
  #url;
  #hello;
  #scene = null;
  #socket = null;
  #wait = FIRST_WAIT;
  #retry = 0;
  #ids = 0;
  #isClosed = false;
  #isOpen = false;
  #looking = 0; // id of the frame the service has; 0: none
  #nextFrame = null;
  #feel = null;
  #feelId = 0; // of a request that an older service refuses

  /** What was not sent: touches while disconnected, frames that a newer one replaced. */
  lost = {touches: 0, frames: 0};

  constructor(url, {name = 'webxr example', version = '1', token} = {}) {
    super();
    this.#url = url;
    this.#hello = {client: {name, version}, protocol: {major: 1, minor: 0}, role: 'scene', token};
    this.#connect();
  }

  get isConnected() {
    return this.#isOpen;
  }

  /** Says what the scene holds, now and after each reconnect; forgets what it held before. */
  scene(objects, fields = {}) {
    this.#scene = {objects, replace: true, ...fields};
    if (this.#isOpen) this.#send('scene', this.#scene);
  }

  /** States one object anew, as {object_id, material}; kept over reconnects like the rest of the scene. */
  state(object) {
    const known = this.#scene.objects.find(({object_id}) => object_id === object.object_id);
    if (known) Object.assign(known, object);
    if (this.#isOpen) this.#send('scene', {objects: [known ?? object], replace: false});
  }

  /** Asks for `vibration` events for these hands, as {left: 'amplitude', right: 'amplitude'}; kept likewise. */
  feel(hands) {
    this.#feel = hands;
    this.#askToFeel();
  }

  /** Sends a touch: {phase, object_id, hand, speed_mps, force_n, interaction?}. */
  touch({speed_mps, force_n, ...fields}) {
    if (!this.#isOpen) {
      this.lost.touches++;
      return;
    }
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

  close() {
    this.#isClosed = true;
    clearTimeout(this.#retry);
    this.#socket.close();
  }

  #connect() {
    this.#socket = new WebSocket(this.#url);
    this.#socket.binaryType = 'arraybuffer';
    this.#socket.onopen = () => this.#send('hello', this.#hello);
    this.#socket.onmessage = ({data}) => this.#receive(decode(new Uint8Array(data)));
    this.#socket.onclose = () => this.#disconnected();
  }

  #disconnected() {
    if (this.#isOpen) this.#notify('state', 'disconnected');
    this.#isOpen = false;
    this.#looking = 0;
    this.#nextFrame = null;
    if (this.#isClosed) return;
    this.#retry = setTimeout(() => this.#connect(), this.#wait * (0.5 + Math.random()));
    this.#wait = Math.min(LONGEST_WAIT, 2 * this.#wait);
  }

  #receive(message) {
    if (message.id && message.id === this.#looking) {
      this.#looking = 0;
      this.#pump();
    }
    if (message.type === 'error' && message.id && message.id === this.#feelId) return; // controllers stay silent
    if (message.type === 'welcome') this.#welcomed(message);
    else if (message.type === 'error') this.#notify('refused', message);
    else if (message.type !== 'ok') this.#notify(message.type, message);
  }

  #welcomed(message) {
    this.#isOpen = true;
    this.#wait = FIRST_WAIT;
    if (this.#scene) this.#send('scene', this.#scene);
    if (message.owner) this.#askToFeel();
    this.#notify('welcome', message);
    this.#notify('state', 'connected');
  }

  #askToFeel() {
    if (this.#isOpen && this.#feel) this.#feelId = this.#send('set', {feel: this.#feel});
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
