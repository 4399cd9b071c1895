/** Prints what the npm client names each map of raw RGBA: FILE WIDTH HEIGHT ... Its canvas is replaced by one that only keeps pixels. */
import {readFileSync} from 'node:fs';
import {Textures} from '../../examples/webxr/client/textures.js';

globalThis.ImageData = class {
  constructor(data, width) {
    Object.assign(this, {data, width, height: data.length / 4 / width});
  }
};
globalThis.OffscreenCanvas = class {
  constructor(width, height) {
    Object.assign(this, {width, height, data: new Uint8ClampedArray(4 * width * height)});
  }

  getContext() {
    const canvas = this;
    return {
      fillRect() {},
      putImageData: ({data}) => canvas.data.set(data),
      drawImage: (source) => canvas.data.set(source.data),
      getImageData: () => ({data: canvas.data}),
    };
  }
};
const [, , ...words] = process.argv;
const textures = new Textures();
for (let at = 0; at < words.length; at += 3) {
  const [width, height] = [Number(words[at + 1]), Number(words[at + 2])];
  console.log(textures.name({data: readFileSync(words[at]), width, height}));
}
