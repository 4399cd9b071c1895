/** How richly the page draws: with less where WebGL runs on the processor, so that a touch is seen at once. */

const SOFTWARE = /llvmpipe|softpipe|swiftshader|basic render|software/i;
const MOST_PIXELS = 200_000; // of a picture that the processor draws

/** Whether to leave out refraction, smooth edges and pixels; never where the address says `?quality=full`. */
export const isPlain = new URLSearchParams(location.search).get('quality') !== 'full' && drawsOnProcessor();

/** Pixels of the picture for each pixel of a page of this size. */
export function pixelRatio(width, height) {
  const finest = Math.min(2, devicePixelRatio);
  return isPlain ? Math.min(finest, Math.sqrt(MOST_PIXELS / (width * height))) : finest;
}

function drawsOnProcessor() {
  const gl = document.createElement('canvas').getContext('webgl2');
  const names = gl?.getExtension('WEBGL_debug_renderer_info');
  const isSoftware = Boolean(names) && SOFTWARE.test(gl.getParameter(names.UNMASKED_RENDERER_WEBGL));
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return isSoftware;
}
