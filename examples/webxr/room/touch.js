/**
 * Converts the fingertip positions of one hand to protocol `touch` messages.
 *
 * Contact is geometry: the fingertip sphere meets a surface. Force is a Kelvin-Voigt fingertip,
 * F = k * depth + c * closing speed.
 */
import * as THREE from 'three';

const TIP_RADIUS = 0.009; // m, of the sphere at a fingertip
const APPROACH_RANGE = 0.12; // m
const APPROACH_SPEED = 0.05; // m/s, slower is not an approach
const RELEASE_GAP = 0.002; // m beyond the fingertip, so that contact does not chatter
const SLIDE_SPEED = 0.02; // m/s along the surface
const STRIKE_SPEED = 0.42; // m/s just before contact; below it a contact is a tap
const RENEWAL = 0.05; // s between messages of a held phase
const STIFFNESS = 380; // N/m, fingertip pulp
const DAMPING = 6; // N s/m
const NEAR = 0.15; // m, an object this close gets a mask

export class Toucher {
  #hand;
  #surfaces;
  #previous = null;
  #velocity = new THREE.Vector3();
  #phase = 'idle';
  #target = null;
  #sentAt = -1;

  constructor(hand, surfaces) {
    this.#hand = hand;
    this.#surfaces = surfaces;
  }

  /** The objects near this hand, closest relation first: in contact, approached, near. */
  attention(tip) {
    const rank = {contact: 0, approach: 1};
    return this.#surfaces
      .map((surface) => ({surface, near: surface.nearest(tip, NEAR)}))
      .filter(({near}) => near)
      .map(({surface, near}) => ({
        object: surface.object,
        rank: surface === this.#target ? rank[this.#phase] : 2,
        distance: near.distance,
      }));
  }

  /** Returns the messages of this step: the fingertip is at `tip` at time `t`, `dt` after the last. */
  step(tip, t, dt) {
    const velocity = this.#previous ? tip.clone().sub(this.#previous).divideScalar(dt) : new THREE.Vector3();
    const impact = this.#velocity.length();
    this.#previous = tip.clone();
    this.#velocity = velocity;
    const held = this.#phase === 'contact';
    const meeting = this.#meeting(tip, held ? TIP_RADIUS + RELEASE_GAP : TIP_RADIUS);
    if (meeting) return this.#touching({...meeting, impact}, velocity, t);
    if (held) return [this.#release(velocity, t)];
    return this.#approaching(tip, velocity, t);
  }

  #meeting(tip, reach) {
    const met = this.#surfaces
      .map((surface) => ({surface, ...surface.nearest(tip, reach)}))
      .filter(({distance}) => distance !== undefined);
    const kept = met.find(({surface}) => this.#phase === 'contact' && surface === this.#target);
    return kept ?? met.sort((a, b) => a.distance - b.distance)[0];
  }

  #touching({surface, distance, normal, impact}, velocity, t) {
    const into = -velocity.dot(normal);
    const along = velocity.clone().addScaledVector(normal, into).length();
    const depth = Math.max(0, TIP_RADIUS - distance);
    const force = Math.max(0.2, STIFFNESS * depth + DAMPING * Math.max(0, into));
    if (this.#phase !== 'contact' || surface !== this.#target) {
      this.#enter('contact', surface);
      const interaction = impact > STRIKE_SPEED ? 'strike' : 'tap';
      return [this.#message('contact', {speed: impact, force, interaction}, t)];
    }
    if (!this.#due(t)) return [];
    const phase = along > SLIDE_SPEED ? 'slide' : 'contact';
    return [this.#message(phase, {speed: along, force}, t)];
  }

  #approaching(tip, velocity, t) {
    const ahead = this.#ahead(tip, velocity);
    const messages = [];
    if (this.#phase === 'approach' && ahead !== this.#target) messages.push(this.#release(velocity, t));
    if (!ahead) return messages;
    const entered = this.#phase === 'idle';
    if (entered) this.#enter('approach', ahead);
    if (entered || this.#due(t)) {
      messages.push(this.#message('approach', {speed: velocity.length(), force: 0}, t));
    }
    return messages;
  }

  /** Returns the surface that the fingertip will reach within the approach range, if any. */
  #ahead(tip, velocity) {
    if (velocity.length() < APPROACH_SPEED) return null;
    const ray = new THREE.Raycaster(tip, velocity.clone().normalize(), 0, APPROACH_RANGE + TIP_RADIUS);
    const hits = this.#surfaces.flatMap((surface) => {
      const [hit] = ray.intersectObject(surface.object.root, true);
      return hit ? [{surface, distance: hit.distance}] : [];
    });
    return hits.sort((a, b) => a.distance - b.distance)[0]?.surface ?? null;
  }

  #enter(phase, surface) {
    this.#phase = phase;
    this.#target = surface;
  }

  #release(velocity, t) {
    const message = this.#message('release', {speed: velocity.length(), force: 0}, t);
    this.#enter('idle', null);
    return message;
  }

  #due(t) {
    return t - this.#sentAt >= RENEWAL - 1e-6;
  }

  #message(phase, {speed, force, interaction}, t) {
    this.#sentAt = t;
    const {object_id, truth} = this.#target.object;
    return {
      t_s: t,
      type: 'touch',
      phase,
      object_id,
      hand: this.#hand,
      speed_mps: rounded(speed),
      force_n: rounded(force),
      captured_at: t,
      ...(interaction && {interaction}),
      truth,
    };
  }
}

const rounded = (x) => Math.round(x * 1000) / 1000;
