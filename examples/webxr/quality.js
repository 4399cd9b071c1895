/** Chooses the drawing quality: reduced when WebGL runs on the CPU, so that a touch is visible at once. */

const SOFTWARE = /llvmpipe|softpipe|swiftshader|basic render|software/i;
const MAX_PIXELS = 200_000; // of a picture drawn by the CPU

/** Whether to omit refraction, smooth edges and full resolution; never with `?quality=full` in the address. */
export const isPlain = new URLSearchParams(location.search).get('quality') !== 'full' && drawsOnProcessor();

/** Returns the pixels of the picture per pixel of a page of this size. */
export function pixelRatio(width, height) {
  const finest = Math.min(2, devicePixelRatio);
  return isPlain ? Math.min(finest, Math.sqrt(MAX_PIXELS / (width * height))) : finest;
}

function drawsOnProcessor() {
  const gl = document.createElement('canvas').getContext('webgl2');
  const names = gl?.getExtension('WEBGL_debug_renderer_info');
  const isSoftware = Boolean(names) && SOFTWARE.test(gl.getParameter(names.UNMASKED_RENDERER_WEBGL));
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return isSoftware;
}
