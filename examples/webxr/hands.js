/** Controllers and tracked hands of an XR session: fingertip positions, meshes and touches. */
import * as THREE from 'three';
import {Hands as Merged, surfaceAt} from 'hapticvlm';
import {Controller, Glove} from './bodies.js';
import {Toucher} from './room/touch.js';

const FINGERTIP = 'index-finger-tip';
const TIP_RADIUS = 0.009; // m, as drawn
const NEAR = 0.05; // m, around a tip that touches

export class Hands {
  #surfaces;
  #send;
  #pulses;
  #merged = new Merged((touch, source) => this.#sendOf(source, touch)); // of several sources of one hand one is felt
  #touched = {}; // the object touched last by each hand, which a vanished source released
  #known = new Map(); // input source -> {toucher, ball, body}

  /** Contains the meshes of the hands. */
  root = new THREE.Group();

  /** `send` receives each touch with its object and point; `pulses` drive the controllers' motors. */
  constructor(surfaces, send, pulses) {
    this.#pulses = pulses;
    this.#surfaces = surfaces;
    this.#send = send;
  }

  /** Updates the hands in one XR frame; `now` and `elapsed` in s. */
  step(frame, space, now, elapsed) {
    const sources = [...frame.session.inputSources].filter(({handedness}) => handedness !== 'none');
    for (const source of this.#known.keys()) if (!sources.includes(source)) this.#forget(source);
    const touches = sources.map((source) => {
      const tip = tipOf(source, frame, space);
      this.#known.get(source)?.body.follow(source, frame, space);
      const amplitude = this.#pulses.play(source);
      if (!source.hand && this.#known.has(source)) this.#known.get(source).body.vibration = amplitude;
      return {source, touches: tip ? this.#follow(source, tip, now, elapsed) : []};
    });
    this.#merged.step(touches);
  }

  /** Removes all hands when a session ends; the service's leases end their touches. */
  clear() {
    for (const source of this.#known.keys()) this.#forget(source);
  }

  #follow(source, tip, now, elapsed) {
    const {toucher, ball} = this.#known.get(source) ?? this.#meet(source);
    ball.position.copy(tip);
    return toucher.step(tip, now, elapsed).map(({t_s: _time, truth: _truth, type: _type, ...fields}) => fields);
  }

  #sendOf(source, touch) {
    const tip = this.#known.get(source)?.ball.position.clone() ?? null;
    const near = this.#surfaces.find(({object}) => object.object_id === touch.object_id);
    const object = near?.object ?? this.#touched[touch.hand];
    this.#touched[touch.hand] = object;
    if (object) this.#send({...touch, surface: near && tip ? surfaceUnder(tip, near) : 0}, object, tip);
  }

  #meet(source) {
    const shape = new THREE.SphereGeometry(TIP_RADIUS, 24, 16);
    const ball = new THREE.Mesh(shape, new THREE.MeshBasicMaterial({color: 0x45ffe0, transparent: true, opacity: 0.55}));
    ball.visible = !source.hand; // a tracked finger shows its own tip
    const body = source.hand ? new Glove() : new Controller();
    this.root.add(ball, body.root);
    const known = {toucher: new Toucher(source.handedness, this.#surfaces), ball, body};
    this.#known.set(source, known);
    return known;
  }

  #forget(source) {
    const {ball, body} = this.#known.get(source);
    this.root.remove(ball, body.root);
    this.#known.delete(source);
  }
}

/** Returns the index of the object's surface that is nearest to a tip; 0, the largest, where the object has one only. */
function surfaceUnder(tip, collision) {
  const {root, truths} = collision.object;
  const near = truths && collision.nearest(tip, NEAR);
  if (!near) return 0;
  const [hit] = new THREE.Raycaster(tip, near.normal.clone().negate()).intersectObject(root, true);
  return hit ? surfaceAt(root, hit) : 0;
}

/** Returns the fingertip of a tracked hand, or the front of a controller; null while not tracked. */
function tipOf(source, frame, space) {
  const joint = source.hand?.get(FINGERTIP);
  const pose = joint ? frame.getJointPose(joint, space) : frame.getPose(source.targetRaySpace, space);
  return pose && new THREE.Vector3().copy(pose.transform.position);
}
