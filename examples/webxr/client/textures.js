/**
 * Texture maps of surfaces, so that the service can tell the material of what neither name nor shader tells.
 *
 * `name` gives the hash that a surface states as its `texture`. `follow` sends those maps that the service asks for,
 * one after the other and a few a second, each once. Works with any engine whose images a canvas can draw.
 */
const SIDE = 256; // px, the longest side that is sent
const PACE = 300; // ms between two maps
const GROUND = 'rgb(127, 127, 127)'; // behind what is transparent
const LANES = [0x811c9dc5, 0x9e3779b9, 0x85ebca6b, 0xc2b2ae35];

export class Textures {
  #maps = new Map(); // {image, region} by hash
  #wanted = [];
  #timer = 0;

  /** Maps that a canvas could not draw or read, such as compressed ones and those of another origin. */
  unreadable = 0;

  /**
   * Returns the hash of a map, or of the part of it that a surface uses: {x, y, w, h} in fractions from the top left.
   * `image` is a picture, bitmap, canvas, or {data, width, height} with four bytes a pixel. Undefined: it cannot be read.
   */
  name(image, region) {
    try {
      const canvas = draw(image, region);
      const hash = hashed(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data);
      this.#maps.set(hash, {image, region});
      return hash;
    } catch {
      this.unreadable++;
      return undefined;
    }
  }

  /** Sends the maps that the service of this connection asks for. */
  follow(haptics) {
    haptics.addEventListener('textures', ({detail}) => {
      this.#wanted.push(...detail.hashes.filter((hash) => this.#maps.has(hash)));
      this.#schedule(haptics);
    });
    haptics.addEventListener('state', ({detail}) => {
      if (detail === 'disconnected') this.#wanted = []; // a new session asks again
    });
  }

  /** Forgets every map, for a scene that replaces another. */
  clear() {
    this.#maps.clear();
    this.#wanted = [];
  }

  #schedule(haptics) {
    if (this.#timer || !this.#wanted.length) return;
    this.#timer = setTimeout(async () => {
      const hash = this.#wanted.shift();
      try {
        const map = this.#maps.get(hash);
        if (map) haptics.texture(hash, await encoded(draw(map.image, map.region)));
      } catch {
        this.unreadable++;
      }
      this.#timer = 0;
      this.#schedule(haptics);
    }, PACE);
  }
}

/** Draws a map, or a part of it, on a canvas of at most SIDE px a side. */
function draw(image, {x, y, w, h} = {x: 0, y: 0, w: 1, h: 1}) {
  const source = drawable(image);
  const width = w * (source.naturalWidth || source.videoWidth || source.width);
  const height = h * (source.naturalHeight || source.videoHeight || source.height);
  const scale = Math.min(1, SIDE / Math.max(width, height));
  const canvas = new OffscreenCanvas(Math.max(1, Math.round(width * scale)), Math.max(1, Math.round(height * scale)));
  const context = canvas.getContext('2d', {willReadFrequently: true});
  context.fillStyle = GROUND;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.imageSmoothingQuality = 'high';
  context.drawImage(source, (x * width) / w, (y * height) / h, width, height, 0, 0, canvas.width, canvas.height);
  return canvas;
}

/** Returns an image that a canvas can draw, also of raw pixels. */
function drawable(image) {
  if (!image?.data) return image;
  const canvas = new OffscreenCanvas(image.width, image.height);
  canvas.getContext('2d').putImageData(new ImageData(new Uint8ClampedArray(image.data), image.width), 0, 0);
  return canvas;
}

async function encoded(canvas) {
  const blob = await canvas.convertToBlob({type: 'image/jpeg', quality: 0.92});
  const image = new Uint8Array(await blob.arrayBuffer());
  return {format: 'jpeg', width: canvas.width, height: canvas.height, origin: 'top', image};
}

/** Returns 32 hex digits of pixels. It names a map within one session, so it need not resist an attacker. */
function hashed(bytes) {
  const words = new Uint32Array(bytes.buffer, bytes.byteOffset, bytes.byteLength / 4);
  const lanes = [...LANES];
  for (let i = 0; i < words.length; i++) {
    const lane = i & 3;
    const mixed = Math.imul(lanes[lane] ^ words[i], 0x01000193);
    lanes[lane] = mixed ^ (mixed >>> 15);
  }
  for (let round = 0; round < 8; round++) {
    const lane = round & 3;
    lanes[lane] = Math.imul(lanes[lane] ^ lanes[(lane + 1) & 3] ^ words.length, 0x5bd1e995);
    lanes[lane] ^= lanes[lane] >>> 13;
  }
  return lanes.map((lane) => (lane >>> 0).toString(16).padStart(8, '0')).join('');
}
