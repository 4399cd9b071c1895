/**
 * Turns the mouse or a finger on the screen into the right hand: hover is approach, press is contact (gentle with
 * Shift), drag is slide, button up is release.
 */
import * as THREE from 'three';
import {surfaceAt} from 'hapticvlm';
import {playMoment} from './moments.js';

const STRIKE = {speed_mps: 0.6, force_n: 4, interaction: 'strike'};
const TAP = {speed_mps: 0.25, force_n: 1.5, interaction: 'tap'};
const HELD = 2; // N, force of a resting or sliding fingertip
const RENEWAL = 50; // ms between messages of a held phase; a lease lasts 250
const STILL = 0.02; // m/s along the surface; slower is not sliding
const HOVER = 0.028; // m, height of the hand over an object it does not touch
const PLACES = 13; // in a row, of the grid on an object in which a place is searched
const OLD = 100; // ms without events after which the pointer has no speed

export class Pointer {
  #camera;
  #objects;
  #send;
  #ray = new THREE.Raycaster();
  #at = null; // {object, surface, point, time} under the pointer
  #where = null; // the last point hit
  #speed = 0;
  #place = ''; // of the last event
  #met = null; // the hit at that place
  #isDown = false;
  #isPlaying = false; // a moment
  #endPlay = null; // ends it
  #target = null; // the object approached or held
  #sentAt = 0;

  /** `send` receives each touch with its surface, and its object and point. */
  constructor(canvas, camera, objects, send) {
    this.#camera = camera;
    this.#objects = objects;
    this.#send = send;
    canvas.addEventListener('pointermove', (event) => this.#move(event));
    canvas.addEventListener('pointerdown', (event) => this.#press(event));
    for (const end of ['pointerup', 'pointercancel', 'pointerleave']) {
      canvas.addEventListener(end, () => this.#lift());
    }
    canvas.addEventListener('pointerleave', () => this.#isPlaying || (this.#at = null));
  }

  /** The fingertip of the hand: {point, normal}; null when the pointer is off the canvas or on no object. */
  get tip() {
    if (!this.#at) return null;
    const {point, normal} = this.#at;
    return {point: point.clone().addScaledVector(normal, this.#isDown ? 0.004 : HOVER), normal, isDown: this.#isDown};
  }

  /** Returns the place of an object's surface that is seen nearest to the middle of the object, or null if it is hidden. */
  find(object, surface) {
    const {min, max} = boundsOf(object.root, this.#camera);
    const steps = Array.from({length: PLACES}, (_, index) => (index + 0.5) / PLACES);
    const share = (at) => Math.abs(at - 0.5);
    const places = steps.flatMap((x) => steps.map((y) => ({x, y, away: Math.hypot(share(x), share(y))})));
    for (const {x, y} of places.sort((a, b) => a.away - b.away)) {
      const met = this.#hit(min.x + x * (max.x - min.x), min.y + y * (max.y - min.y), performance.now());
      if (met?.object === object && met.surface === surface) return met;
    }
    return null;
  }

  /** Puts the hand over a place, as the mouse would. */
  hover(place) {
    this.#at = place;
    this.#where = place.point;
    this.#aim(place);
  }

  /** Plays a moment at a place; a press of the mouse ends it. */
  play(moment, place) {
    this.stop();
    this.hover(place);
    this.#isPlaying = true;
    this.#isDown = moment.kind !== 'swing';
    const send = ({phase, ...fields}) => this.#touch(phase, fields, performance.now());
    this.#endPlay = playMoment(moment, send, () => {
      this.#isPlaying = false;
      this.#isDown = false;
      this.#target = null; // the moment has released it
    });
  }

  get isPlaying() {
    return this.#isPlaying;
  }

  /** Ends the moment that is played. */
  stop() {
    if (this.#isPlaying) this.#endPlay();
  }

  /** Renews the current touch or approach; call it in every animation frame. */
  step(now) {
    if (!this.#target || this.#isPlaying || now - this.#sentAt < RENEWAL) return;
    if (!this.#isDown) {
      this.#touch('approach', {speed_mps: this.#speed, force_n: 0}, now);
      return;
    }
    const speed = now - this.#at.time > OLD ? 0 : this.#speed;
    this.#touch(speed > STILL ? 'slide' : 'contact', {speed_mps: speed, force_n: HELD}, now);
  }

  #move(event) {
    if (this.#isPlaying) return;
    const met = this.#meet(event);
    this.#speed = met && this.#at ? speedBetween(this.#at, met) : 0;
    this.#at = met;
    this.#where = met?.point ?? this.#where;
    if (met?.object === this.#target) return;
    if (!met) this.#lift();
    else if (this.#isDown) this.#target = met.object; // slides on to the next object
    else this.#aim(met);
  }

  #aim({object, time}) {
    this.#release(time);
    this.#target = object;
    this.#touch('approach', {speed_mps: this.#speed, force_n: 0}, time);
  }

  #press(event) {
    this.stop();
    const met = this.#meet(event);
    if (!met) return;
    this.#at = met;
    this.#where = met.point;
    this.#speed = 0;
    if (this.#target !== met.object) this.#aim(met);
    this.#isDown = true;
    this.#touch('contact', event.shiftKey ? TAP : STRIKE, met.time);
  }

  #lift() {
    if (this.#isPlaying) return;
    this.#isDown = false;
    this.#release(performance.now());
  }

  #release(now) {
    if (this.#target) this.#touch('release', {speed_mps: 0, force_n: 0}, now);
    this.#target = null;
  }

  #touch(phase, fields, now) {
    this.#sentAt = now;
    const surface = this.#at?.object === this.#target ? this.#at.surface : 0;
    this.#send({phase, hand: 'right', surface, ...fields}, this.#target, this.#where);
  }

  /** Returns the hit under the pointer, cached while it does not move. */
  #meet({offsetX, offsetY, target, timeStamp}) {
    const place = `${offsetX} ${offsetY} ${target.clientWidth}`;
    if (place === this.#place && this.#met) return {...this.#met, time: timeStamp};
    this.#place = place;
    this.#met = this.#under(offsetX, offsetY, target, timeStamp);
    return this.#met;
  }

  #under(offsetX, offsetY, target, timeStamp) {
    const across = (2 * offsetX) / target.clientWidth - 1;
    const up = 1 - (2 * offsetY) / target.clientHeight;
    return this.#hit(across, up, timeStamp);
  }

  /** Returns the nearest object at a place of the picture, -1..1 across and up, or null. */
  #hit(across, up, timeStamp) {
    this.#ray.setFromCamera(new THREE.Vector2(across, up), this.#camera);
    const hits = this.#objects.flatMap((object) => {
      const [hit] = this.#ray.intersectObject(object.root, true);
      return hit ? [{object, surface: surfaceAt(object.root, hit), point: hit.point, normal: normalOf(hit, this.#ray), distance: hit.distance, time: timeStamp}] : [];
    });
    return hits.sort((a, b) => a.distance - b.distance)[0] ?? null;
  }
}

/** Returns the surface normal there, on the visible side. */
function normalOf({face, object}, {ray}) {
  const normal = face.normal.clone().transformDirection(object.matrixWorld);
  return normal.dot(ray.direction) > 0 ? normal.negate() : normal;
}

/** Returns where the camera sees an object: the least and the most x and y of the corners of its box, -1..1. */
function boundsOf(root, camera) {
  const {min, max} = new THREE.Box3().setFromObject(root);
  const seen = new THREE.Box2();
  for (const x of [min.x, max.x]) {
    for (const y of [min.y, max.y]) {
      for (const z of [min.z, max.z]) seen.expandByPoint(new THREE.Vector3(x, y, z).project(camera));
    }
  }
  return seen;
}

function speedBetween(before, after) {
  const elapsed = (after.time - before.time) / 1000;
  return elapsed > 0 ? before.point.distanceTo(after.point) / elapsed : 0;
}
