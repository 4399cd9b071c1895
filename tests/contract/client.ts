/**
 * A client that knows nothing but the types made from the contract: `node client.js ws://127.0.0.1:8790/`.
 *
 * It says what it was answered, one JSON object, and ends with 0 once it has felt something.
 */
import {decode, encode} from '@msgpack/msgpack';
import WebSocket from 'ws';
import type {Frame, Hello, Scene, Set, Socket, Stop, Touch, Vibration, Welcome} from './messages.js';

type Answer = Socket; // every message of the service: what the channel sends
type Request = Hello | Scene | Frame | Touch | Set | Stop;
type WithoutId<T> = T extends Request ? Omit<T, 'id'> : never; // of each of them, and not of what all share

const SIDE = 64; // px
const PATIENCE_MS = 10_000;

class Client {
  #socket: WebSocket;
  #answers = new Map<number, (answer: Answer) => void>();
  #events = new Map<Answer['type'], (event: Answer) => void>();
  #ids = 0;

  constructor(url: string) {
    this.#socket = new WebSocket(url);
    this.#socket.on('message', (data: Buffer) => this.#receive(decode(data) as Answer));
  }

  async open(): Promise<Welcome> {
    await new Promise((resolve, reject) => this.#socket.once('open', resolve).once('error', reject));
    const protocol = {major: 1, minor: 1};
    return this.ask({type: 'hello', role: 'scene', protocol, client: {name: 'contract', version: '1'}}, 'welcome');
  }

  /** Resolves with the answer, which has to be of this kind. */
  async ask<K extends Answer['type']>(request: WithoutId<Request>, kind: K): Promise<Extract<Answer, {type: K}>> {
    const id = ++this.#ids;
    const answered = new Promise<Answer>((resolve) => this.#answers.set(id, resolve));
    this.#socket.send(encode({...request, id}));
    const answer = await answered;
    if (answer.type === 'error') throw new Error(`${answer.code}: ${answer.text} at ${answer.path ?? '$'}`);
    if (answer.type !== kind) throw new Error(`${request.type} is answered by ${answer.type}`);
    return answer as Extract<Answer, {type: K}>;
  }

  /** Resolves with the next event of this kind. */
  async next<K extends Answer['type']>(kind: K): Promise<Extract<Answer, {type: K}>> {
    const event = await new Promise<Answer>((resolve) => this.#events.set(kind, resolve));
    return event as Extract<Answer, {type: K}>;
  }

  close(): void {
    this.#socket.close();
  }

  #receive(message: Answer): void {
    const waiting = message.id === 0 ? this.#events.get(message.type) : this.#answers.get(message.id);
    waiting?.(message);
  }
}

const touch = (phase: Touch['phase']): WithoutId<Touch> => ({
  type: 'touch', phase, hand: 'right', object_id: 'table', speed_mps: 0.3, force_n: 1.5, captured_at: performance.now() / 1000,
});

const giveUp = setTimeout(() => process.exit(1), PATIENCE_MS);
const client = new Client(process.argv[2] ?? '');
const welcome = await client.open();
await client.ask({type: 'scene', replace: true, objects: [{object_id: 'table', name: 'Oak_Table_02'}, {object_id: 'thing'}]}, 'ok');
const decided = client.next('decision');
await client.ask(touch('contact'), 'ok');
const decision = await decided;
await client.ask({type: 'set', feel: {right: 'parametric'}}, 'ok');
const felt = client.next('vibration');
await client.ask(touch('slide'), 'ok');
const vibration: Vibration = await felt;
const seen = await client.ask({
  type: 'frame', object_id: 'thing', captured_at: performance.now() / 1000, format: 'rgb8', origin: 'top',
  width: SIDE, height: SIDE, image: new Uint8Array(3 * SIDE * SIDE).fill(128),
}, 'decision');
await client.ask(touch('release'), 'ok');
await client.ask({type: 'stop', scope: 'all'}, 'ok');
console.log(JSON.stringify({welcome, decision, vibration, seen}));
clearTimeout(giveUp);
client.close();
