/** Frames on demand: a picture from the head when a hand is at an object nobody has decided yet. */
import {Camera, SIDE} from '../captures/make/page/picture.js';

const LEAST_WAIT = 500; // ms between pictures
const LEAST_SHARE = 0.002; // of the picture; less of an object is not worth a look

export class Eyes {
  #camera;
  #send;
  #wanted = null;
  #shotAt = -LEAST_WAIT;

  /** `send` takes the fields of a protocol frame. */
  constructor(renderer, scene, objects, send) {
    this.#camera = new Camera(renderer, scene, objects);
    this.#send = send;
  }

  /** Asks for a picture of this object at the next chance. */
  want(object) {
    this.#wanted = object;
  }

  /** Takes the picture that is wanted, seen from `position` and `orientation`; `now` in ms. */
  step({position, orientation}, now) {
    if (!this.#wanted || now - this.#shotAt < LEAST_WAIT) return;
    const object = this.#wanted;
    this.#wanted = null;
    this.#shotAt = now;
    const picture = this.#camera.shoot({position, orientation});
    const seen = this.#camera.find(picture, object);
    if (seen && seen.share >= LEAST_SHARE) this.#post(picture, object, seen.mask);
  }

  async #post(picture, {object_id}, mask) {
    const [image, png] = await Promise.all([this.#camera.encode(picture), encodeMask(mask)]);
    this.#send({
      format: 'jpeg', width: SIDE, height: SIDE, origin: 'top', image, mask: png, object_id,
    });
  }
}

async function encodeMask(mask) {
  const white = new ImageData(SIDE, SIDE);
  for (let i = 0; i < mask.length; i++) white.data.set([mask[i], mask[i], mask[i], 255], 4 * i);
  const canvas = new OffscreenCanvas(SIDE, SIDE);
  canvas.getContext('2d').putImageData(white, 0, 0);
  const blob = await canvas.convertToBlob({type: 'image/png'});
  return new Uint8Array(await blob.arrayBuffer());
}
