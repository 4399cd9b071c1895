/** Frames on demand: a picture of an object from the head when a hand is at one that nobody has decided yet. */
import * as THREE from 'three';
import {Camera, SIDE} from '../captures/make/page/picture.js';
import {makeGlass} from './objects.js';

const LEAST_WAIT = 500; // ms between pictures
const LEAST_SHARE = 0.02; // of the picture; an object that shows less is not worth a frame
const REACH = 0.2; // m: of larger things only what lies so far round the hand is in the frame
const ROOM = 1.1; // the picture's half width over the object's radius
const WIDEST = 80; // degrees

export class FrameCamera {
  #camera;
  #objects;
  #excluded = []; // what pictures leave out
  #send;
  #wanted = null; // {object, point}
  #shotAt = -LEAST_WAIT;

  /** `send` receives the fields of a protocol frame. */
  constructor(renderer, scene, objects, send) {
    this.#camera = new Camera(renderer, scene, objects);
    this.#objects = objects;
    this.#send = send;
  }

  /** Leaves things out of the pictures that are not of the scene: hands before an object, the board. */
  exclude(...things) {
    this.#excluded.push(...things);
  }

  /** Asks for a picture of this object, touched at `point`, at the next chance. */
  want(object, point) {
    this.#wanted = {object, point: new THREE.Vector3().copy(point)};
  }

  /** Takes the picture that is wanted, seen from `position`; `now` in ms. */
  async step(position, now) {
    if (!this.#wanted || now - this.#shotAt < LEAST_WAIT) return;
    const {object, point} = this.#wanted;
    this.#wanted = null;
    this.#shotAt = now;
    const fields = await this.frame(object, position, point);
    if (fields) this.#send(fields);
  }

  /**
   * The fields of a frame of one object as seen from `position`: the camera turns to the object and zooms until it
   * fills the picture, for small objects show little. Null when it is hidden.
   */
  async frame(object, position, point = null) {
    const pose = aim(object.root, position, point);
    const picture = this.#shoot(pose);
    const seen = this.#camera.find(picture, object);
    if (!seen || seen.share < LEAST_SHARE) return null;
    const [image, mask] = await Promise.all([this.#camera.encode(picture), encodeMask(seen.mask)]);
    const {object_id} = object;
    return {format: 'jpeg', width: SIDE, height: SIDE, origin: 'top', image, mask, object_id};
  }

  #shoot(pose) {
    const refracts = this.#refracts();
    const shown = this.#excluded.filter(({visible}) => visible);
    if (!refracts) makeGlass(this.#objects, {refracts: true}); // one picture may cost what 90 a second may not
    for (const thing of shown) thing.visible = false;
    const picture = this.#camera.shoot(pose);
    for (const thing of shown) thing.visible = true;
    if (!refracts) makeGlass(this.#objects, {refracts: false});
    return picture;
  }

  #refracts() {
    let found = true;
    for (const {root} of this.#objects) {
      root.traverse(({material}) => (found &&= !material?.isMeshPhysicalMaterial || material.transmission > 0));
    }
    return found;
  }
}

/** Where the picture is taken from and how wide it is: the whole object, or the part of a large one round `point`. */
function aim(root, from, point) {
  const position = new THREE.Vector3().copy(from);
  const ball = new THREE.Box3().setFromObject(root).getBoundingSphere(new THREE.Sphere());
  if (point && ball.radius > REACH) ball.set(point, REACH);
  const lens = new THREE.PerspectiveCamera();
  lens.position.copy(position);
  lens.lookAt(ball.center);
  const half = Math.asin(Math.min(1, (ROOM * ball.radius) / position.distanceTo(ball.center)));
  const fieldOfView = Math.min(WIDEST, 2 * THREE.MathUtils.radToDeg(half));
  return {position, orientation: lens.quaternion, fieldOfView};
}

async function encodeMask(mask) {
  const white = new ImageData(SIDE, SIDE);
  for (let i = 0; i < mask.length; i++) white.data.set([mask[i], mask[i], mask[i], 255], 4 * i);
  const canvas = new OffscreenCanvas(SIDE, SIDE);
  canvas.getContext('2d').putImageData(white, 0, 0);
  const blob = await canvas.convertToBlob({type: 'image/png'});
  return new Uint8Array(await blob.arrayBuffer());
}
