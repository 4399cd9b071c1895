/** Frames on demand: pictures of undecided objects that a hand touches, taken from the position of the head. */
import * as THREE from 'three';
import {Camera, SIDE} from './room/picture.js';
import {makeGlass} from './objects.js';

const LEAST_WAIT = 500; // ms between pictures
const LEAST_SHARE = 0.02; // of the picture; smaller objects are not sent
const REACH = 0.2; // m around the hand that the frame of a large object shows
const MARGIN = 1.1; // ratio of the picture's half width to the object's radius
const WIDEST = 80; // degrees

export class FrameCamera {
  #camera;
  #objects;
  #excluded = []; // meshes that pictures omit
  #send;
  #wanted = null; // {object, point}
  #shotAt = -LEAST_WAIT;

  /** `send` receives the fields of a protocol frame. */
  constructor(renderer, scene, objects, send) {
    this.#camera = new Camera(renderer, scene, objects);
    this.#objects = objects;
    this.#send = send;
  }

  /** Excludes meshes that are not part of the scene from pictures, such as hands and the board. */
  exclude(...things) {
    this.#excluded.push(...things);
  }

  /** Requests a picture of this object, touched at `point`, as soon as possible. */
  want(object, point) {
    this.#wanted = {object, point: new THREE.Vector3().copy(point)};
  }

  /** Takes the requested picture from `position`; `now` in ms. */
  async step(position, now) {
    if (!this.#wanted || now - this.#shotAt < LEAST_WAIT) return;
    const {object, point} = this.#wanted;
    this.#wanted = null;
    this.#shotAt = now;
    const fields = await this.frame(object, position, point);
    if (fields) this.#send(fields);
  }

  /**
   * Returns the fields of a frame of one object from `position`: the camera aims at the object and zooms until it
   * fills the picture. Null when the object is hidden.
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
    if (!refracts) makeGlass(this.#objects, {refracts: true}); // affordable for one picture, but not for 90 a second
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

/** Returns direction and field of view of the picture: the whole object, or the part of a large one around `point`. */
function aim(root, from, point) {
  const position = new THREE.Vector3().copy(from);
  const ball = new THREE.Box3().setFromObject(root).getBoundingSphere(new THREE.Sphere());
  if (point && ball.radius > REACH) ball.set(point, REACH);
  const lens = new THREE.PerspectiveCamera();
  lens.position.copy(position);
  lens.lookAt(ball.center);
  const half = Math.asin(Math.min(1, (MARGIN * ball.radius) / position.distanceTo(ball.center)));
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
