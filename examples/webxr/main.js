/** Combines the parts of the example: scene, hands, frames, the service, and the display and sound of touches. */
import * as THREE from 'three';
import {Felt, Haptics, Pulses, Textures, openFeel, surfacesOf} from 'hapticvlm';
import {copyAddress} from '../../dom.js';
import {offerSound, startWithTouch} from '../../hear.js';
import {Surface} from './room/collision.js';
import {pointingHand} from './bodies.js';
import {Drawing} from './drawing.js';
import {FrameCamera} from './frames.js';
import {Hands} from './hands.js';
import {readMoment, writeMoment} from './moments.js';
import {buildObjects, makeGlass} from './objects.js';
import {Board, explain, write} from './panel.js';
import {Pointer} from './pointer.js';
import {isPlain, pixelRatio} from './quality.js';
import {Readout} from './readout.js';
import {buildScene} from './scene.js';
import {Stream} from './stream.js';
import {TouchLight} from './touchlight.js';

const LONGEST_STEP = 0.1; // s, of one animation frame
const PANEL_WAIT = 200; // ms between updates of the panel
const PLAIN_WAIT = 100; // ms between updates of the card when the CPU draws it

const load = async (file) => (await fetch(new URL(file, import.meta.url))).json();
const [described, materials, tables] = await Promise.all(['scene.json', 'materials.json', 'client/feel.true.json'].map(load));
const query = new URLSearchParams(location.search);
const part = (id) => document.getElementById(id);

/** The emulated headset if the address contains `?emulate`, else null. */
export const headset = query.has('emulate') ? (await import('./headset.js')).device : null;
export const objects = buildObjects().map((object, index) => ({...object, says: described.objects[index]}));
if (isPlain) makeGlass(objects, {refracts: false});
document.body.classList.toggle('plain', isPlain);
/** The newest decision for each object id. */
export const decisions = new Map();

const renderer = new THREE.WebGLRenderer({canvas: part('view'), antialias: !headset && !isPlain, preserveDrawingBuffer: isPlain});
renderer.toneMapping = THREE.NeutralToneMapping;
renderer.shadowMap.enabled = true;
renderer.shadowMap.autoUpdate = false; // nothing on the table moves
renderer.shadowMap.needsUpdate = true;
renderer.xr.enabled = true;
renderer.xr.setReferenceSpaceType('local-floor');

const scene = buildScene(renderer, objects);
/** The page's own view. */
export const camera = new THREE.PerspectiveCamera(38, 1, 0.05, 20);
/** The drawing of the page, with counts and times of its pictures. */
export const drawn = new Drawing(renderer, scene, camera, {inParts: isPlain});
const board = new Board(scene);
const readout = new Readout(part('overlay'), isPlain ? PLAIN_WAIT : 0);
const light = new TouchLight(objects);
const cursor = pointingHand();
cursor.visible = false;
scene.add(readout.mesh, cursor);
/** The vibration of controllers and phones. */
export const pulses = new Pulses();
/** Takes the pictures; `frameCamera.frame` also takes one on request. */
export const frameCamera = new FrameCamera(renderer, scene, objects, (fields) => haptics?.frame(fields));
/** Meshes and touches of controllers and tracked hands. */
export const hands = new Hands(objects.map((object) => new Surface(object)), touched, pulses);
scene.add(hands.root);
frameCamera.exclude(hands.root, board.mesh, readout.mesh, cursor, light);
const pointer = new Pointer(renderer.domElement, camera, objects, touched);
resize();
drawn.step();
/** Connects last, because the set-up above blocks the page for seconds and a service waits ten for a hello. */
const token = query.get('token') ?? undefined;
const address = service();
export const haptics = address && new Haptics(address, {token});
const feel = openFeel(tables);
/** The service where it answers, else the bake in client/feel.true.json and materials.json. */
export const felt = new Felt(haptics, feel, {materials, mode: haptics ? (query.get('felt') ?? 'auto') : 'baked'});
const stream = new Stream(felt, feel, address, token);
/** Sends the texture maps of surfaces that neither their name nor their shader tells. */
const textures = new Textures();
let devices = null; // the output devices of the service
let mode = 'ids';
let last = null; // the object touched last
let lastSurface = 0;
let moment = null; // of the newest touch, or of the address
export let plate = null; // the newest telemetry
let steppedAt = 0;
let shownAt = 0;

/** Sends the descriptions of all objects ('ids'), or only their ids ('frames'). */
export function tell(newMode) {
  mode = newMode;
  decisions.clear();
  for (const [index, object] of objects.entries()) object.object_id = `${mode}-${index}`;
  const {objects: stated, materials: possible} = described;
  const whole = stated.map((says, index) => ({...says, ...(objects[index].truths && {surfaces: surfacesOf(objects[index].root, textures)})}));
  felt.scene(mode === 'ids' ? whole : objects.map(({object_id}) => ({object_id})), {materials: possible});
}

/** Enters VR; resolves when the session has begun. */
export async function enter() {
  const session = await navigator.xr.requestSession('immersive-vr', {
    requiredFeatures: ['local-floor'],
    optionalFeatures: ['hand-tracking'],
  });
  makeGlass(objects, {refracts: false});
  session.addEventListener('end', leave);
  await renderer.xr.setSession(session);
  return session;
}

function leave() {
  hands.clear();
  makeGlass(objects, {refracts: !isPlain});
  drawn.change();
}

function touched({surface: index, ...fields}, object, point) {
  const surface = object.truths && mode === 'ids' ? index : 0;
  const decision = decisionOn(object, surface);
  if ((object !== last || surface !== lastSurface) && decision) announce(object, decision);
  [last, lastSurface] = [object, surface];
  remember(fields, object, index);
  const touch = {...fields, object_id: object.object_id, ...(surface > 0 && {surface})};
  felt.touch(touch);
  stream.touch(touch, felt.surfaceOf(touch));
  if (fields.phase === 'contact') {
    part('hint').className = 'done';
    if (!pointer.isPlaying) part('feel').hidden = true;
  }
  const warmth_c = decision?.thermal_cue ? decision.setpoint_c : null;
  light.touch(fields, object, point, {material: decision?.material, warmth_c});
  if (fields.phase !== 'release' && point) readout.show(object, surface, decision, point, performance.now());
  if (fields.phase !== 'release' && needsFrame(object)) frameCamera.want(object, point);
}

/** The names of what a link can open at: objects, and the further surfaces of an object by their material. */
const places = new Map(objects.flatMap((object) => (object.truths ?? [object.truth]).map((truth, surface) => [surface ? `${object.key} ${truth}` : object.key, {object, surface}])));

/** Keeps the moment of a touch for the link that is copied. */
function remember({phase, interaction, speed_mps: speed, force_n: force}, object, surface) {
  const kind = phase === 'slide' ? 'slide' : phase === 'contact' ? interaction : null;
  if (!kind || pointer.isPlaying) return;
  const [target] = [...places].find(([, place]) => place.object === object && place.surface === surface);
  offerLink({target, kind, speed, force});
}

function offerLink(one) {
  moment = one;
  part('link').textContent = 'Copy link';
  part('link').hidden = false;
}

/** Opens at the moment of the address: the hand is over its object, and a key or a tap plays it. */
function open() {
  part('feel').hidden = true;
  try {
    const one = readMoment(location.hash, [...places.keys()]);
    if (!one) return;
    const {object, surface} = places.get(one.target);
    const place = pointer.find(object, surface);
    if (!place) throw new Error(`The link opens at "${one.target}", which is hidden from here. Make the window larger, or choose another object.`);
    part('hint').className = 'done';
    pointer.hover(place);
    offerLink(one);
    offer(one, place);
  } catch (error) {
    part('hint').className = '';
    part('hint').textContent = error.message;
  }
}

/** Shows the button that plays a moment. */
function offer(one, place) {
  part('feel').textContent = `Feel it: ${one.target}, ${one.kind}`;
  part('feel').hidden = false;
  part('feel').onclick = async () => {
    await startWithTouch();
    pointer.play(one, place);
  };
  part('feel').focus();
}

/** Returns what is known of a surface: the newest decision of the service, else what the bake has; or null. */
function decisionOn(object, surface) {
  const decision = decisions.get(keyOf(object.object_id, surface));
  if (decision || (haptics?.isConnected && felt.mode !== 'baked')) return decision ?? null;
  const {material, belief, by} = felt.surfaceOf({object_id: object.object_id, surface});
  return material ? {material, confidence: belief ?? 1, source: by ?? 'scene', isBaked: true} : null;
}

const keyOf = (id, surface = 0) => (surface ? `${id}/${surface}` : id);

/** Returns whether a picture is needed because nothing else identifies the material. */
function needsFrame({object_id, truths}) {
  if (truths && mode === 'ids') return false; // a picture shows all its surfaces at once
  const decision = decisions.get(object_id);
  return decision ? decision.material === 'unknown' : mode === 'frames';
}

function animate(now, frame) {
  const elapsed = Math.min(LONGEST_STEP, Math.max(0.001, (now - steppedAt) / 1000));
  steppedAt = now;
  const space = renderer.xr.getReferenceSpace();
  const viewer = frame?.getViewerPose(space)?.transform;
  board.mesh.visible = Boolean(frame && readout.hasShown);
  if (frame) hands.step(frame, space, now / 1000, elapsed);
  else pointer.step(now);
  show(now, elapsed, viewer);
  if (frame) drawn.all();
  else drawn.step();
  if (viewer) frameCamera.step(viewer.position, now);
  else if (!frame) frameCamera.step(camera.position, now);
  if (now - shownAt > PANEL_WAIT) explainLast(now);
}

/** Redraws the page although nothing has changed. */
export function redraw() {
  drawn.change();
}

/** Updates light, card and pointing hand. */
function show(now, elapsed, viewer) {
  const level = stream.level(elapsed);
  for (const place of light.step(performance.now(), elapsed, level)) drawn.change(place);
  const isShown = readout.step(performance.now(), level);
  if (viewer) readout.inHeadset(isShown, viewer.position);
  else readout.onPage(isShown, camera, renderer.domElement);
  if (!renderer.xr.isPresenting) point(pointer.tip);
  if (!viewer) pulses.playOnPhone();
}

/** Draws the mouse's hand at this tip. */
function point(tip) {
  if (cursor.visible === (tip !== null) && (!tip || cursor.position.equals(tip.point))) return;
  if (cursor.visible) drawn.change(new THREE.Box3().setFromObject(cursor));
  cursor.visible = tip !== null;
  renderer.domElement.classList.toggle('pointing', cursor.visible);
  if (!tip) return;
  const [right, up, back] = [0, 1, 2].map((column) => new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, column));
  const into = back.negate().multiplyScalar(0.7).addScaledVector(up, 0.55).addScaledVector(right, -0.4).addScaledVector(tip.normal, -0.25);
  const turn = new THREE.Matrix4().lookAt(new THREE.Vector3(), into, up.addScaledVector(right, -0.2));
  cursor.quaternion.setFromRotationMatrix(turn);
  cursor.position.copy(tip.point);
  drawn.change(new THREE.Box3().setFromObject(cursor));
}

/** Announces a decision to screen readers. */
function announce({key}, {material}) {
  part('said').textContent = `The ${key} is ${material}.`;
}

function explainLast(now) {
  shownAt = now;
  const title = last ? `${last.key} (truly ${last.truths?.[lastSurface] ?? last.truth})` : 'Touch something';
  const rows = last ? explain(decisionOn(last, lastSurface), plate) : [];
  part('touched').textContent = title;
  part('teach').hidden = !last || !haptics;
  write(part('why'), rows);
  if (board.mesh.visible) board.write(title, rows);
}

function resize() {
  if (renderer.xr.isPresenting) return;
  const {clientWidth, clientHeight} = renderer.domElement;
  const ratio = pixelRatio(clientWidth, clientHeight);
  const [width, height] = [clientWidth, clientHeight].map((side) => Math.floor(side * ratio));
  renderer.setSize(width, height, false); // whole px, so that partial redraws align
  camera.aspect = width / height;
  const far = Math.max(1, 1.35 / camera.aspect); // moves back on an upright phone to show the whole table
  camera.position.set(0, 0.78 + 0.74 * far, -0.16 + 1.22 * far);
  camera.lookAt(0, 0.79, -0.17);
  camera.updateProjectionMatrix();
  camera.updateMatrixWorld();
  drawn.change();
}

/** Returns the address in `?service=ws://...`, else the service that served this page; null where plain files are served. */
function service() {
  if (query.has('service')) return query.get('service');
  if (document.documentElement.dataset.service === 'none') return null;
  return `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/`;
}

function showState() {
  if (!haptics) return say('Felt and heard without a service; warmth needs one with a plate');
  if (!haptics.isConnected) return say(felt.by === 'baked' ? 'Service unreachable; the bake is felt instead' : 'Service unreachable; retrying');
  if (!devices) return say('Connecting to the service');
  const {speaker, peltier} = devices;
  const outputs = speaker.simulated && peltier.simulated ? 'plate and speaker are simulated' : `plate: ${peltier.name}`;
  const isBaked = felt.mode === 'baked' || (felt.mode === 'auto' && !haptics.isOwner);
  if (isBaked) return say(`Connected; the bake is felt: ${felt.bakedBecause}`);
  say(`Connected; ${haptics.silence ? `nothing is felt: ${haptics.silence}` : outputs}`);
}

function say(text) {
  part('state').textContent = text;
}

felt.addEventListener('welcome', ({detail}) => {
  ({devices} = detail);
  showState();
});
felt.addEventListener('ownership', showState);
felt.addEventListener('state', showState);
felt.addEventListener('decision', ({detail}) => {
  decisions.set(keyOf(detail.object_id, detail.surface), detail);
  readout.update(detail);
  if (last?.object_id === detail.object_id && lastSurface === (detail.surface ?? 0)) announce(last, detail);
});
felt.addEventListener('telemetry', ({detail}) => (plate = detail));
felt.addEventListener('refused', ({detail}) => console.warn(`HapticVLM: ${detail.text}`));
if (haptics) textures.follow(haptics);
pulses.follow(felt);
part('felt').value = felt.mode;
part('felt').addEventListener('change', ({target}) => {
  felt.mode = target.value;
  showState();
});
for (const choice of document.querySelectorAll('.served')) choice.hidden = !haptics;
for (const choice of document.getElementsByName('mode')) {
  choice.addEventListener('change', () => tell(choice.value));
}
part('stop').addEventListener('click', () => {
  pointer.stop();
  stream.silence();
  felt.stop();
});
part('enter').addEventListener('click', enter);
part('enter').disabled = !(await navigator.xr?.isSessionSupported('immersive-vr'));
part('why-button').addEventListener('click', () => {
  const isOpen = part('drawer').toggleAttribute('hidden') === false;
  part('why-button').setAttribute('aria-expanded', String(isOpen));
});
part('teach').addEventListener('submit', (event) => {
  event.preventDefault();
  haptics.state({object_id: last.object_id, material: part('teach-material').value});
});
renderer.domElement.addEventListener('pointerdown', () => setTimeout(startWithTouch)); // after the first picture
part('teach-material').append(...described.materials.map((name) => new Option(name)));
offerSound();
addEventListener('resize', resize);
part('link').addEventListener('click', async () => {
  part('link').textContent = part('said').textContent = await copyAddress(writeMoment(moment));
});
addEventListener('hashchange', open);
tell('ids');
showState();
open();
renderer.setAnimationLoop(animate);
