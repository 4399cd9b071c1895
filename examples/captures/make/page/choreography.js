/**
 * The motion of hands and head as smooth functions of simulated time.
 *
 * A touch is a ray: it starts off the object, runs `toward` it, and the object's surface determines
 * the contact point and the path of the slide. Between touches the fingertip moves
 * on cubic Hermite segments. Touch messages are computed elsewhere.
 */
import * as THREE from 'three';
import {smooth, step} from './noise.js';
import {SCRIPT} from './scripts.js';

const TOUCHES = SCRIPT.touches;

export const TIP_RADIUS = 0.009;

const FIRST_CONTACT = 33.5 / 60; // between two steps, so that rounding does not affect contacts
const SPACING = 0.9;
const HOVER_TIME = 0.36;
const HOVER_DISTANCE = 0.135;
const SETTLE_TIME = 0.05;
const PRESS_DEPTH = 0.004;
const HOVER_SPEED = 0.42;
const LIFT_SPEED = 0.75;
const HEAD_HEIGHT = 1.44;
const REST = {right: new THREE.Vector3(0.3, 0.92, 0.3), left: new THREE.Vector3(-0.4, 0.92, 0.3)};

const CONTACTS = TOUCHES.map((_, index) =>
  TOUCHES.slice(0, index + 1).reduce((at, {lead = 0}) => at + lead, FIRST_CONTACT + SPACING * index),
);

/** Returns the simulated seconds from the first pose until the hands are at rest again. */
export const DURATION = CONTACTS.at(-1) + Math.max(0.8, (TOUCHES.at(-1).hold ?? 0) + 0.6);

/** Computes the script for these objects: {tip(hand, t), finger(hand, t), head(t), contacts}. */
export function choreograph(objects) {
  const touches = TOUCHES.map((touch, index) => plan(touch, CONTACTS[index], objects));
  const tracks = {};
  for (const hand of ['right', 'left']) {
    tracks[hand] = track(hand, touches.filter((touch) => touch.hand === hand));
  }
  return {
    tip: (hand, t) => position(tracks[hand].keys, t),
    finger: (hand, t) => direction(tracks[hand].aims, t),
    head: (t) => headPose(touches, t),
    contacts: touches.map(({contactAt, releaseAt}) => ({from: contactAt, to: releaseAt})),
  };
}

/** Returns one touch with its surface points, found by casting rays at the object. */
function plan(touch, contactAt, objects) {
  const {root} = objects.find(({name}) => name === touch.name);
  root.updateWorldMatrix(true, true);
  const toward = new THREE.Vector3(...touch.toward).normalize();
  const slide = new THREE.Vector3(...touch.slide);
  const rub = Array.from({length: 7}, (_, i) => {
    const probe = new THREE.Vector3(...touch.probe).addScaledVector(slide, i / 6);
    return landing(root, probe, toward, touch.name);
  });
  const {hold: holdTime = 0.3, stay = 0} = touch;
  return {...touch, toward, rub, contactAt, holdTime, stay, releaseAt: contactAt + SETTLE_TIME + holdTime + stay};
}

/** Returns the centre of a fingertip that just touches the object, and the surface normal there. */
function landing(root, probe, toward, name) {
  const origin = probe.clone().addScaledVector(toward, -0.25);
  const [hit] = new THREE.Raycaster(origin, toward, 0, 0.6).intersectObject(root, true);
  if (!hit) throw new Error(`the finger misses ${name}`);
  const normal = hit.face.normal.clone().transformDirection(hit.object.matrixWorld);
  if (normal.dot(toward) > 0) normal.negate();
  return {point: hit.point.addScaledVector(normal, TIP_RADIUS), normal};
}

/** Returns position keys {t, at, velocity} and aim keys {t, finger} of one hand. */
function track(hand, touches) {
  const still = new THREE.Vector3();
  const forward = new THREE.Vector3(0, -0.25, -1).normalize();
  const keys = [];
  const aims = [];
  const rest = (t) => {
    keys.push({t, at: REST[hand], velocity: still});
    aims.push({t, finger: forward});
  };
  touches.forEach((touch, index) => {
    const before = touches[index - 1];
    const hoverAt = touch.contactAt - HOVER_TIME;
    if (!before || hoverAt - before.releaseAt > 1.6) {
      if (before) rest(before.releaseAt + 0.7);
      rest(Math.max(hoverAt - 0.7, before ? before.releaseAt + 0.7 : -1));
    }
    keys.push(...touchKeys(touch));
    const finger = aim(touch);
    aims.push({t: touch.contactAt - 0.2, finger}, {t: touch.releaseAt, finger});
  });
  rest(touches.at(-1).releaseAt + 0.6);
  return {keys, aims};
}

function touchKeys({toward, rub, contactAt, holdTime, stay, speed, releaseAt}) {
  const away = (point, distance) => point.clone().addScaledVector(toward, -distance);
  const pressed = rub.map(({point, normal}) => point.clone().addScaledVector(normal, -PRESS_DEPTH));
  const end = pressed.length - 1;
  const rubbing = pressed.map((at, i) => {
    const [before, after] = [Math.max(i - 1, 0), Math.min(i + 1, end)];
    const span = (after - before) * (holdTime / end);
    const velocity = pressed[after].clone().sub(pressed[before]).divideScalar(span);
    return {t: contactAt + SETTLE_TIME + (i / end) * holdTime, at, velocity};
  });
  if (stay) rubbing.push(...resting(rubbing.at(-1), releaseAt));
  rubbing.at(-1).velocity.addScaledVector(toward, -LIFT_SPEED);
  const inward = (pace) => toward.clone().multiplyScalar(pace);
  return [
    {t: contactAt - HOVER_TIME, at: away(rub[0].point, HOVER_DISTANCE), velocity: inward(HOVER_SPEED)},
    {t: contactAt, at: rub[0].point, velocity: inward(speed)},
    ...rubbing,
  ];
}

/** Rests the finger where the stroke ended, until just before it lifts. */
function resting(last, releaseAt) {
  const still = {...last, velocity: new THREE.Vector3()};
  last.velocity.set(0, 0, 0);
  return [{...still, t: releaseAt - SETTLE_TIME}, {...still, velocity: new THREE.Vector3(), t: releaseAt}];
}

/** Returns the direction of a finger whose elbow is behind and beside it and which leans into the surface. */
function aim({hand, toward}) {
  const elbow = new THREE.Vector3(hand === 'right' ? 0.16 : -0.16, 0.12, 0.36);
  return elbow.negate().normalize().addScaledVector(toward, 0.3).normalize();
}

/** Interpolates the keys by cubic Hermite splines. */
function position(keys, t) {
  const next = keys.findIndex((key) => key.t > t);
  if (next <= 0) return (next === 0 ? keys[0] : keys.at(-1)).at.clone();
  const [a, b] = [keys[next - 1], keys[next]];
  const span = b.t - a.t;
  const s = (t - a.t) / span;
  return new THREE.Vector3()
    .addScaledVector(a.at, (1 + 2 * s) * (1 - s) ** 2)
    .addScaledVector(a.velocity, s * (1 - s) ** 2 * span)
    .addScaledVector(b.at, s * s * (3 - 2 * s))
    .addScaledVector(b.velocity, s * s * (s - 1) * span);
}

function direction(aims, t) {
  const next = aims.findIndex((key) => key.t > t);
  if (next <= 0) return (next === 0 ? aims[0] : aims.at(-1)).finger;
  const [a, b] = [aims[next - 1], aims[next]];
  return a.finger.clone().lerp(b.finger, smooth((t - a.t) / (b.t - a.t))).normalize();
}

/** Returns the pose of the head, which leans towards each touch in turn: {position, target}. */
function headPose(touches, t) {
  const poses = touches.map(gaze);
  const pose = {position: poses[0].position.clone(), target: poses[0].target.clone()};
  for (let i = 1; i < touches.length; i++) {
    const turn = step(touches[i].contactAt - 0.55, touches[i].contactAt - 0.08, t);
    pose.position.lerp(poses[i].position, turn);
    pose.target.lerp(poses[i].target, turn);
  }
  pose.position.x += 0.004 * Math.sin(t * 2.1);
  pose.position.y += 0.003 * Math.sin(t * 3.3 + 1);
  return pose;
}

function gaze({rub, gaze: distance = 0.43}) {
  const target = rub[0].point.clone().lerp(rub.at(-1).point, 0.5);
  const seat = new THREE.Vector3(target.x * 0.75, HEAD_HEIGHT, 0.62);
  const line = seat.sub(target).normalize();
  return {target, position: target.clone().addScaledVector(line, distance)};
}
