/**
 * Draws the page's picture when something in it has changed. Where the processor draws, it draws only the part
 * that has: a canvas that keeps its pixels is drawn again inside a rectangle, with a camera that sees no more.
 */
import * as THREE from 'three';

const LASTS = 3; // pictures in which a change is drawn: what ends is drawn once more without it
const EDGE = 2; // px round a part
const ALL = new THREE.Box2(new THREE.Vector2(-Infinity, -Infinity), new THREE.Vector2(Infinity, Infinity));

export class Drawing {
  /** Pictures drawn. */
  count = 0;
  /** When the newest was given to WebGL, ms. */
  at = 0;
  /** How much of the canvas the newest covered, 0..1. */
  share = 1;
  #renderer;
  #scene;
  #camera;
  #inParts;
  #now = new THREE.Box2(); // px from the lower left: what has changed since the newest picture
  #before = Array.from({length: LASTS - 1}, () => new THREE.Box2()); // what each earlier one drew anew

  /** `inParts`: the canvas keeps its pixels, so a picture may be of a part. */
  constructor(renderer, scene, camera, {inParts}) {
    [this.#renderer, this.#scene, this.#camera, this.#inParts] = [renderer, scene, camera, inParts];
  }

  /** What lies in this THREE.Box3 or Sphere of the world (m) looks other than before; without one, all may. */
  change(where = null) {
    const part = this.#inParts && where ? partOf(where, this.#camera, this.#renderer.getSize(new THREE.Vector2())) : null;
    this.#now.union(part ?? ALL);
  }

  /** Draws what has changed, if anything has. */
  step() {
    const part = this.#before.reduce((sum, one) => sum.union(one), this.#now.clone());
    this.#before = [this.#now, ...this.#before.slice(0, -1)];
    this.#now = new THREE.Box2();
    const canvas = new THREE.Box2(new THREE.Vector2(), this.#renderer.getSize(new THREE.Vector2()));
    part.intersect(canvas);
    if (part.equals(canvas)) this.all();
    else if (part.min.x < part.max.x && part.min.y < part.max.y) this.#draw(part);
  }

  /** Draws all of it: the page, or what a headset shows. */
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

/** Where a box or ball of the world is in a picture of this size: whole px from the lower left; null where it reaches behind the camera. */
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

/** As the camera sees them. */
function cornersOfBox({min, max}, camera) {
  return CORNERS.map((corner) => corner.clone().multiply(max.clone().sub(min)).add(min).applyMatrix4(camera.matrixWorldInverse));
}

/** Of the cube round the ball that faces the camera. */
function cornersOfBall({center, radius}, camera) {
  const middle = center.clone().applyMatrix4(camera.matrixWorldInverse);
  return CORNERS.map((corner) => corner.clone().multiplyScalar(2).subScalar(1).multiplyScalar(radius).add(middle));
}
