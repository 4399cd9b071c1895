/**
 * Draws the page's picture when something in it has changed. On the CPU it draws only the changed
 * part: a canvas that preserves its pixels is redrawn inside a rectangle, with a camera restricted to it.
 */
import * as THREE from 'three';

const LASTS = 3; // pictures in which a change is drawn, so that its end is drawn too
const EDGE = 2; // px around a part
const ALL = new THREE.Box2(new THREE.Vector2(-Infinity, -Infinity), new THREE.Vector2(Infinity, Infinity));

export class Drawing {
  /** Number of pictures drawn. */
  count = 0;
  /** Time at which the newest was passed to WebGL, ms. */
  at = 0;
  /** Share of the canvas that the newest covered, 0..1. */
  share = 1;
  #renderer;
  #scene;
  #camera;
  #inParts;
  #now = new THREE.Box2(); // px from the lower left: the part changed since the newest picture
  #before = Array.from({length: LASTS - 1}, () => new THREE.Box2()); // the part redrawn by each earlier picture

  /** `inParts`: the canvas preserves its pixels, so a picture may cover only a part. */
  constructor(renderer, scene, camera, {inParts}) {
    [this.#renderer, this.#scene, this.#camera, this.#inParts] = [renderer, scene, camera, inParts];
  }

  /** Marks the content of a THREE.Box3 or Sphere of the world (m) as changed; without one, everything. */
  change(where = null) {
    const part = this.#inParts && where ? partOf(where, this.#camera, this.#renderer.getSize(new THREE.Vector2())) : null;
    this.#now.union(part ?? ALL);
  }

  /** Draws the changed part, if there is one. */
  step() {
    const part = this.#before.reduce((sum, one) => sum.union(one), this.#now.clone());
    this.#before = [this.#now, ...this.#before.slice(0, -1)];
    this.#now = new THREE.Box2();
    const canvas = new THREE.Box2(new THREE.Vector2(), this.#renderer.getSize(new THREE.Vector2()));
    part.intersect(canvas);
    if (part.equals(canvas)) this.all();
    else if (part.min.x < part.max.x && part.min.y < part.max.y) this.#draw(part);
  }

  /** Draws everything, for the page or a headset. */
  all() {
    this.#renderer.render(this.#scene, this.#camera);
    this.#note(1);
  }

  #draw(part) {
    const [renderer, camera] = [this.#renderer, this.#camera];
    const {width, height} = renderer.getSize(new THREE.Vector2());
    const {x: wide, y: high} = part.getSize(new THREE.Vector2());
    camera.setViewOffset(width, height, part.min.x, height - part.max.y, wide, high);
    renderer.setViewport(part.min.x, part.min.y, wide, high);
    renderer.setScissor(part.min.x, part.min.y, wide, high);
    renderer.setScissorTest(true);
    renderer.render(this.#scene, camera);
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, width, height);
    camera.clearViewOffset();
    this.#note((wide * high) / (width * height));
  }

  #note(share) {
    this.count++;
    this.at = performance.now();
    this.share = share;
  }
}

/** Returns the rectangle of a box or sphere in a picture of this size, in whole px from the lower left; null if it reaches behind the camera. */
function partOf(where, camera, size) {
  const part = new THREE.Box2();
  if (where.isSphere && where.radius === 0) return part;
  for (const corner of where.isSphere ? cornersOfBall(where, camera) : cornersOfBox(where, camera)) {
    if (corner.z > -camera.near) return null;
    corner.applyMatrix4(camera.projectionMatrix);
    part.expandByPoint(new THREE.Vector2((corner.x + 1) / 2, (corner.y + 1) / 2).multiply(size));
  }
  part.min.floor().subScalar(EDGE);
  part.max.ceil().addScalar(EDGE);
  return part;
}

const CORNERS = Array.from({length: 8}, (_, i) => new THREE.Vector3(i & 1, (i >> 1) & 1, i >> 2));

/** Projects points to the camera. */
function cornersOfBox({min, max}, camera) {
  return CORNERS.map((corner) => corner.clone().multiply(max.clone().sub(min)).add(min).applyMatrix4(camera.matrixWorldInverse));
}

/** Returns the corners of the cube around the sphere that faces the camera. */
function cornersOfBall({center, radius}, camera) {
  const middle = center.clone().applyMatrix4(camera.matrixWorldInverse);
  return CORNERS.map((corner) => corner.clone().multiplyScalar(2).subScalar(1).multiplyScalar(radius).add(middle));
}
