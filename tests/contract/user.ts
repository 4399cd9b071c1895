/**
 * Two scenes of one page that use the installed package: `node user.js ws://127.0.0.1:8790/`.
 *
 * The first is felt, also after somebody has ended its connection. The second is told why it is not, and is felt as
 * soon as the first has gone. Says what each of them came to know, as one JSON object.
 */
import {Haptics, Pulses} from 'hapticvlm';
import type {Controller, Decision, HandName, HapticsEvents, TouchFields} from 'hapticvlm';
import WebSocket from 'ws';

const PATIENCE_MS = 10_000;
const url = process.argv[2] ?? '';
const slide: TouchFields = {phase: 'slide', hand: 'right', object_id: 'table', speed_mps: 0.3, force_n: 1.5};

function next<K extends keyof HapticsEvents>(scene: Haptics, type: K): Promise<HapticsEvents[K]> {
  return new Promise((resolve) => scene.addEventListener(type, ({detail}) => resolve(detail)));
}

const pause = (ms: number) => new Promise((done) => setTimeout(done, ms));

function open(name: string): Haptics {
  const scene = new Haptics(url, {name, WebSocket});
  scene.scene([{object_id: 'table', name: 'Oak_Table_02'}], {ambient_c: 21});
  return scene;
}

/** Rubs until a controller's motor was told to run; what it was told first. */
async function rub(scene: Haptics, pulses: Pulses): Promise<number> {
  let strongest = 0;
  const hapticActuators = [{pulse: (amplitude: number) => (strongest = amplitude)}];
  const source: Controller = {handedness: 'right', gamepad: {hapticActuators}};
  while (strongest === 0) {
    scene.touch(slide);
    await pause(15);
    pulses.play(source);
  }
  return strongest;
}

/** Ends the connection of who owns the outputs, as a person can from the dashboard. */
async function endOwner(): Promise<void> {
  const observer = new WebSocket(url);
  await new Promise((resolve) => observer.once('open', resolve));
  const hello = {type: 'hello', id: 1, role: 'observer', protocol: {major: 1, minor: 1}, client: {name: 'person', version: '1'}};
  const answered = new Promise((resolve) => observer.on('message', (data) => JSON.parse(String(data)).id === 2 && resolve(data)));
  for (const message of [hello, {type: 'set', id: 2, ownership: 'end'}]) observer.send(JSON.stringify(message));
  await answered;
  observer.close();
}

const giveUp = setTimeout(() => process.exit(1), PATIENCE_MS);
const first = open('first');
const firstPulses = new Pulses();
firstPulses.follow(first);
const before = first.silence;
await next(first, 'welcome');
const decided: Promise<Decision> = next(first, 'decision');
first.touch({...slide, phase: 'contact'});
const {material} = await decided;
const felt = await rub(first, firstPulses);
const hand: HandName = 'left';
const bare = firstPulses.silence({handedness: hand});

const back = next(first, 'welcome');
const ended = next(first, 'state');
await endOwner();
const states = [await ended, first.silence, (await back).owner];
const feltAgain = await rub(first, firstPulses);

const second = open('second');
const secondPulses = new Pulses();
secondPulses.follow(second);
await next(second, 'welcome');
second.touch(slide);
const refused = second.silence;
const taken = next(second, 'ownership');
first.close();
await taken;
while (!second.isOwner) await pause(10);
const feltAfter = await rub(second, secondPulses);
second.stop();
while (!second.silence) await pause(10);
const stopped = second.silence;
second.touch({...slide, phase: 'release'});
second.touch({...slide, phase: 'contact'});
await rub(second, secondPulses);
console.log(JSON.stringify({before, material, felt, bare, states, feltAgain, refused, feltAfter, stopped, after: second.silence, lost: second.lost}));
clearTimeout(giveUp);
second.close();
