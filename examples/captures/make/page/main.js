/**
 * Runs an emulated WebXR headset session in which scripted hands touch the scene.
 *
 * Its exports drive it one frame at a time from outside. Simulated time advances only when
 * a frame is requested, so the capture does not depend on the speed of the machine.
 */
import * as THREE from 'three';
import {XRDevice, metaQuest3} from 'iwer';
import {DURATION, choreograph} from './choreography.js';
import {Surface} from './collision.js';
import {Hand} from './hand.js';
import {buildObjects, sceneEntry} from './objects.js';
import {Camera, SIDE} from './picture.js';
import {buildRoom} from './room.js';
import {SCRIPT} from './scripts.js';
import {Toucher} from './touch.js';

const STEPS_PER_SECOND = 60;
const REST_STEPS = 45; // steps of contact after which a hand counts as resting
const SMALLEST_SHARE = 0.004; // share of the frame below which an object gets no mask
const AMBIENT_C = 23;

export {DURATION as duration};

const device = new XRDevice(metaQuest3, {stereoEnabled: true, ipd: 0.063});
device.installRuntime({forceInstall: true});
device.primaryInputMode = 'hand';
for (const hand of Object.values(device.hands)) hand.poseId = 'point';

const renderer = new THREE.WebGLRenderer({antialias: false});
renderer.setPixelRatio(1);
renderer.setSize(innerWidth, innerHeight);
renderer.toneMapping = THREE.NeutralToneMapping;
renderer.shadowMap.enabled = true;
renderer.shadowMap.autoUpdate = false; // once per frame, not once per pass
renderer.xr.enabled = true;
renderer.xr.setReferenceSpaceType('local-floor');
document.body.append(renderer.domElement);

const objects = buildObjects();
const scene = buildRoom(renderer, objects);
const script = choreograph(objects);
const surfaces = objects.map((object) => new Surface(object));
const camera = new Camera(renderer, scene, objects);
const eyes = new THREE.PerspectiveCamera();
const hands = [];
let steps = 0;
let asked = null;

/** Opens the immersive session; resolves when both hands are tracked. */
export async function enter() {
  const session = await navigator.xr.requestSession('immersive-vr', {
    requiredFeatures: ['local-floor', 'hand-tracking'],
  });
  await renderer.xr.setSession(session);
  await new Promise((tracked) => {
    renderer.setAnimationLoop((_, frame) => {
      const sources = [...session.inputSources].filter((source) => source.hand);
      if (!frame || sources.length < 2) return;
      for (const source of sources) meet(source, frame);
      pose(0);
      renderer.setAnimationLoop((_now, next) => next && advance(next));
      tracked();
    });
  });
  return {mode: 'immersive-vr', blend: session.environmentBlendMode, hands: hands.length};
}

function meet(source, frame) {
  const hand = new Hand(source, frame, renderer.xr.getReferenceSpace());
  scene.add(hand.root);
  hands.push({hand, toucher: new Toucher(hand.handedness, surfaces), tip: null});
}

/** Returns the protocol `scene` message that opens the capture. */
export function sceneMessage() {
  return {t_s: 0, type: 'scene', replace: true, ambient_c: AMBIENT_C, objects: objects.map(sceneEntry)};
}

/** Advances to the next frame: {messages, jpeg, mask}, both pictures in base64. */
export function next() {
  return new Promise((resolve, reject) => {
    asked = {resolve, reject, messages: []};
  });
}

/** Returns whether a hand has been resting in contact for a while. */
function isResting(t) {
  const ahead = REST_STEPS / STEPS_PER_SECOND;
  return script.contacts.some(({from, to}) => t > from + ahead && t < to - ahead / 2);
}

/** Runs one XR frame: one step of simulated time, and a picture when one is due. */
function advance(frame) {
  if (!asked) return;
  steps++;
  const request = asked;
  try {
    const t = seconds(steps);
    for (const entry of hands) {
      entry.tip = entry.hand.follow(frame);
      request.messages.push(...entry.toucher.step(entry.tip, t, 1 / STEPS_PER_SECOND));
    }
    if (steps % (isResting(t) ? SCRIPT.still : SCRIPT.every) === 0) {
      asked = null;
      renderer.shadowMap.needsUpdate = true;
      renderer.render(scene, eyes);
      const viewer = frame.getViewerPose(renderer.xr.getReferenceSpace()).transform;
      const picture = camera.shoot(viewer);
      record(picture, t, request).catch(request.reject);
    }
    pose(seconds(steps + 1));
  } catch (error) {
    asked = null;
    request.reject(error);
  }
}

async function record(picture, t, {messages, resolve}) {
  const seen = attended(picture);
  const jpeg = await camera.encode(picture);
  messages.push({
    t_s: t,
    type: 'frame',
    captured_at: t,
    format: 'jpeg',
    width: SIDE,
    height: SIDE,
    origin: 'top',
    purpose: 'live',
    ...(seen && {object_id: seen.object.object_id, region: seen.region, truth: seen.object.truth}),
  });
  resolve({messages, jpeg: base64(jpeg), mask: seen ? base64(seen.mask) : null});
}

/** Returns the object near a hand that the picture shows, or null. */
function attended(picture) {
  const candidates = hands
    .flatMap(({toucher, tip}) => toucher.attention(tip))
    .sort((a, b) => a.rank - b.rank || a.distance - b.distance);
  for (const {object} of candidates) {
    const view = camera.find(picture, object);
    if (view && view.share >= SMALLEST_SHARE) return {object, ...view};
  }
  return null;
}

/** Moves the emulated headset and hands to their scripted poses at time t. */
function pose(t) {
  const {position, target} = script.head(t);
  const look = new THREE.Matrix4().lookAt(position, target, new THREE.Vector3(0, 1, 0));
  const turn = new THREE.Quaternion().setFromRotationMatrix(look);
  device.position.set(position.x, position.y, position.z);
  device.quaternion.set(turn.x, turn.y, turn.z, turn.w);
  for (const {hand} of hands) {
    const side = hand.handedness;
    hand.place(device.hands[side], script.tip(side, t), script.finger(side, t));
  }
}

const seconds = (step) => Math.round((step / STEPS_PER_SECOND) * 1e4) / 1e4;

function base64(bytes) {
  let text = '';
  for (let i = 0; i < bytes.length; i += 0x8000) {
    text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  }
  return btoa(text);
}
