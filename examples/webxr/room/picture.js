/**
 * Takes mono pictures of the scene from the head: a JPEG for the service and an id pass for the mask.
 *
 * Pictures are read back synchronously: an asynchronous read starves behind a software GPU's queue.
 */
import * as THREE from 'three';

export const SIDE = 448;
const QUALITY = 0.56; // of the JPEG
const FIELD_OF_VIEW = 62;

export class Camera {
  #renderer;
  #scene;
  #lens = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.03, 20);
  #color = new THREE.WebGLRenderTarget(SIDE, SIDE, {
    samples: 4,
    colorSpace: THREE.SRGBColorSpace,
    internalFormat: 'RGBA8',
  });
  #ids = new THREE.WebGLRenderTarget(SIDE, SIDE, {
    minFilter: THREE.NearestFilter,
    magFilter: THREE.NearestFilter,
  });
  #paint = new Map();
  #hidden = new THREE.MeshBasicMaterial({color: 0, toneMapped: false, side: THREE.DoubleSide});
  #canvas = new OffscreenCanvas(SIDE, SIDE);
  #pixels = new Uint8Array(SIDE * SIDE * 4);

  constructor(renderer, scene, objects) {
    this.#renderer = renderer;
    this.#scene = scene;
    // three.js tone-maps and encodes to sRGB only for the screen and for targets marked as XR's.
    this.#color.isXRRenderTarget = true;
    objects.forEach((object, index) => this.#label(object, index + 1));
  }

  /** Renders both passes from a pose; returns a picture to encode and to cut masks from. `fieldOfView` in degrees. */
  shoot({position, orientation, fieldOfView = FIELD_OF_VIEW}) {
    this.#lens.position.copy(position);
    this.#lens.quaternion.copy(orientation);
    this.#lens.fov = fieldOfView;
    this.#lens.updateProjectionMatrix();
    this.#lens.updateMatrixWorld();
    const renderer = this.#renderer;
    renderer.xr.enabled = false;
    const image = this.#render(this.#color);
    const ids = this.#labelled(() => this.#render(this.#ids));
    renderer.setRenderTarget(null);
    renderer.xr.enabled = true;
    return {image, ids};
  }

  /** Returns the JPEG bytes of a picture, top row first. */
  async encode({image}) {
    this.#canvas.getContext('2d').putImageData(image, 0, 0);
    const blob = await this.#canvas.convertToBlob({type: 'image/jpeg', quality: QUALITY});
    return new Uint8Array(await blob.arrayBuffer());
  }

  /** Returns the visible part of an object: {mask, share, region}, mask with one byte per pixel; or null. */
  find({ids}, object) {
    const mask = new Uint8Array(SIDE * SIDE);
    const box = {left: SIDE, top: SIDE, right: -1, bottom: -1};
    let count = 0;
    for (let i = 0; i < mask.length; i++) {
      if (ids.data[i * 4] !== object.label) continue;
      mask[i] = 255;
      count++;
      box.left = Math.min(box.left, i % SIDE);
      box.right = Math.max(box.right, i % SIDE);
      box.top = Math.min(box.top, Math.floor(i / SIDE));
      box.bottom = Math.max(box.bottom, Math.floor(i / SIDE));
    }
    return count ? {mask, share: count / mask.length, region: regionOf(box)} : null;
  }

  #render(target) {
    const renderer = this.#renderer;
    renderer.setRenderTarget(target);
    renderer.render(this.#scene, this.#lens);
    renderer.readRenderTargetPixels(target, 0, 0, SIDE, SIDE, this.#pixels);
    const image = new ImageData(SIDE, SIDE);
    const row = SIDE * 4;
    for (let y = 0; y < SIDE; y++) {
      image.data.set(this.#pixels.subarray((SIDE - 1 - y) * row, (SIDE - y) * row), y * row);
    }
    return image;
  }

  /** Paints every object in the colour of its label and everything else black while `render` runs. */
  #labelled(render) {
    const scene = this.#scene;
    const {background} = scene;
    const worn = [];
    scene.background = null;
    scene.traverse((node) => {
      if (!node.isMesh) return;
      worn.push([node, node.material]);
      node.material = this.#paint.get(node) ?? this.#hidden;
    });
    const image = render();
    for (const [node, material] of worn) node.material = material;
    scene.background = background;
    return image;
  }

  #label(object, label) {
    object.label = label;
    const color = new THREE.Color().setRGB(label / 255, 0, 0);
    const paint = new THREE.MeshBasicMaterial({color, toneMapped: false, side: THREE.DoubleSide});
    object.root.traverse((node) => node.isMesh && this.#paint.set(node, paint));
  }
}

function regionOf({left, top, right, bottom}) {
  const fraction = (pixels) => Math.round((pixels / SIDE) * 10000) / 10000;
  return {x: fraction(left), y: fraction(top), w: fraction(right + 1 - left), h: fraction(bottom + 1 - top)};
}
