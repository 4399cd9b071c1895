/** Puts the example together: scene, hands, eyes, the service, and the panel that says why. */
import * as THREE from 'three';
import {Surface} from '../captures/make/page/collision.js';
import {Eyes} from './eyes.js';
import {Hands} from './hands.js';
import {Haptics} from './haptics.js';
import {buildObjects, makeGlass} from './objects.js';
import {Board, explain, write} from './panel.js';
import {Pointer} from './pointer.js';
import {buildScene} from './scene.js';

const LONGEST_STEP = 0.1; // s, of one animation frame
const PANEL_WAIT = 200; // ms between updates of the panel

const query = new URLSearchParams(location.search);
const part = (id) => document.getElementById(id);

/** The emulated headset when the address says `?emulate`, else null. */
export const headset = query.has('emulate') ? (await import('./headset.js')).device : null;
export const objects = buildObjects();
/** The newest decision on each object, by object id. */
export const decisions = new Map();

const renderer = new THREE.WebGLRenderer({canvas: part('view'), antialias: !headset});
renderer.toneMapping = THREE.NeutralToneMapping;
renderer.shadowMap.enabled = true;
renderer.shadowMap.autoUpdate = false; // nothing on the table moves
renderer.shadowMap.needsUpdate = true;
renderer.xr.enabled = true;
renderer.xr.setReferenceSpaceType('local-floor');

const scene = buildScene(renderer, objects);
const camera = new THREE.PerspectiveCamera(45, 1, 0.05, 20);
camera.position.set(0, 1.5, 1.15);
camera.lookAt(0, 0.78, -0.16);
const board = new Board(scene);
/** Takes the pictures; `eyes.look` also for whoever wants one. */
export const eyes = new Eyes(renderer, scene, objects, (fields) => haptics.frame(fields));
const hands = new Hands(objects.map((object) => new Surface(object)), touched);
scene.add(hands.root);
eyes.overlook(hands.root, board.mesh);
const pointer = new Pointer(renderer.domElement, camera, objects, touched);
/** Connects last: what came before kept the page busy for seconds, and a service waits ten for a hello. */
export const haptics = new Haptics(service(), {token: query.get('token') ?? undefined});
// All that the things on the table can be made of: recognition considers no other.
const MATERIALS = ['wood', 'glass', 'fabric', 'metal'];

let mode = 'ids';
let last = null; // the object touched last
export let plate = null; // the newest telemetry
let steppedAt = 0;
let shownAt = 0;

/** Says all of what the scene knows ('ids'), or nothing but that there are objects ('frames'). */
export function tell(wanted) {
  mode = wanted;
  decisions.clear();
  for (const [index, object] of objects.entries()) object.object_id = `${mode}-${index}`;
  haptics.scene(
    objects.map(({object_id, says}) => ({object_id, ...(mode === 'ids' && says)})),
    {materials: MATERIALS},
  );
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
  makeGlass(objects, {refracts: true});
}

function touched(fields, object, point) {
  last = object;
  haptics.touch({...fields, object_id: object.object_id});
  if (fields.phase !== 'release' && needsLook(object)) eyes.want(object, point);
}

/** A picture is worth its cost only where nothing else has said what the object is. */
function needsLook({object_id}) {
  const decision = decisions.get(object_id);
  return decision ? decision.material === 'unknown' : mode === 'frames';
}

function animate(now, frame) {
  const elapsed = Math.min(LONGEST_STEP, Math.max(0.001, (now - steppedAt) / 1000));
  steppedAt = now;
  const space = renderer.xr.getReferenceSpace();
  const viewer = frame?.getViewerPose(space)?.transform;
  board.mesh.visible = Boolean(frame);
  if (frame) hands.step(frame, space, now / 1000, elapsed);
  else pointer.step(now);
  renderer.render(scene, camera);
  if (viewer) eyes.step(viewer.position, now);
  else if (!frame) eyes.step(camera.position, now);
  if (now - shownAt > PANEL_WAIT) show(now);
}

function show(now) {
  shownAt = now;
  const title = last ? `${last.key} (truly ${last.truth})` : 'Touch something';
  const rows = last ? explain(decisions.get(last.object_id), plate) : [];
  part('touched').textContent = title;
  write(part('why'), rows);
  if (board.mesh.visible) board.write(title, rows);
}

function resize() {
  if (renderer.xr.isPresenting) return;
  renderer.setPixelRatio(Math.min(2, devicePixelRatio));
  const {clientWidth, clientHeight} = renderer.domElement;
  renderer.setSize(clientWidth, clientHeight, false);
  camera.aspect = clientWidth / clientHeight;
  camera.updateProjectionMatrix();
}

/** The service that served this page, unless the address says `?service=ws://...`. */
function service() {
  return query.get('service') ?? `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/`;
}

function greet({detail: {owner, devices}}) {
  const simulated = devices.peltier.simulated ? ' (simulated)' : '';
  const watching = owner ? '' : '; another scene owns the outputs';
  part('state').textContent = `Connected; plate: ${devices.peltier.name}${simulated}${watching}`;
}

haptics.addEventListener('welcome', greet);
haptics.addEventListener('state', ({detail}) => {
  if (detail === 'disconnected') part('state').textContent = 'The service is gone; trying again';
});
haptics.addEventListener('decision', ({detail}) => decisions.set(detail.object_id, detail));
haptics.addEventListener('telemetry', ({detail}) => (plate = detail));
haptics.addEventListener('refused', ({detail}) => console.warn(`HapticVLM: ${detail.text}`));
for (const choice of document.getElementsByName('mode')) {
  choice.addEventListener('change', () => tell(choice.value));
}
part('stop').addEventListener('click', () => haptics.stop());
part('enter').addEventListener('click', enter);
part('enter').disabled = !(await navigator.xr?.isSessionSupported('immersive-vr'));
addEventListener('resize', resize);
resize();
tell('ids');
if (!haptics.isConnected) part('state').textContent = 'Looking for the service';
renderer.setAnimationLoop(animate);
