/** Pictures of a room: colours, and in the fourth channel whose number every pixel shows. */
import * as THREE from 'three';

const COARSE = 128; // px of the frame in which things are found
const LEAST = 0.004; // share of the frame below which a thing is not found
const MARGIN = 0.06; // of its box; the service keeps 0.05
const DARK = 38, BRIGHT = 205, WANTED = 105; // mean grey levels; outside, the exposure is changed

const DEVELOP = `
uniform sampler2D light, numbers;
uniform vec2 part;
uniform vec3 tint;
uniform float exposure, saturation, contrast, curve;
varying vec2 at;
void main() {
  vec3 c = texture2D(light, at * part).rgb * tint * exposure;
  if (curve > .5) c = c * (2.51 * c + .03) / (c * (2.43 * c + .59) + .14); // film: ACES after K. Narkowicz
  c = clamp(mix(vec3(dot(c, vec3(.2126, .7152, .0722))), c, saturation), 0., 1.);
  c = mix(12.92 * c, 1.055 * pow(c, vec3(1. / 2.4)) - .055, step(.0031308, c));
  gl_FragColor = vec4((c - .45) * contrast + .45, texture2D(numbers, at * part).r);
}`;
const SQUARE = 'varying vec2 at; void main() { at = uv; gl_Position = vec4(position.xy, 0., 1.); }';

const EXACT = {minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter};
const target = (side, options) => new THREE.WebGLRenderTarget(side, side, options);

/** How pictures come out: smooth edges or jagged, tone curve, exposure and colours. */
export const development = (d) => ({
  isSmooth: d.chance(0.7), curve: d.integer(0, 1),
  exposure: d.spread(0.55, 1.7), saturation: d.uniform(0.75, 1.2), contrast: d.uniform(0.95, 1.35),
  tint: new THREE.Vector3(d.uniform(0.88, 1.12), 1, d.uniform(0.85, 1.15)),
});

export class Camera {
  #renderer;
  #coarse = target(COARSE, EXACT);
  #flat = Array.from({length: 64}, (_, id) => new THREE.MeshBasicMaterial({
    color: new THREE.Color().setRGB(id / 255, 0, 0), fog: false,
    side: id ? THREE.DoubleSide : THREE.FrontSide}));
  #develop = new THREE.ShaderMaterial({fragmentShader: DEVELOP, vertexShader: SQUARE,
    blending: THREE.NoBlending, uniforms: {}});
  #square = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), this.#develop);
  #still = new THREE.Camera();

  /** Pictures of at most `side` px. */
  constructor(renderer, side) {
    this.#renderer = renderer;
    this.side = side;
    this.numbers = target(side, EXACT);
    this.lights = [0, 4].map((samples) => target(side, {type: THREE.HalfFloatType, samples}));
    this.developed = target(side, {depthBuffer: false});
    this.#square.frustumCulled = false;
  }

  /** Map of the numbers of things in a frame to the regions round them: {x, y, w, h}, 0..1, top left. */
  find(room, lens) {
    lens.clearViewOffset();
    this.#number(room, lens, this.#coarse);
    const found = new Map(), pixels = this.#read(this.#coarse, COARSE, COARSE);
    for (let i = 0; i < COARSE * COARSE; i++) {
      const id = pixels[4 * i];
      if (id) found.has(id) ? found.get(id).push(i) : found.set(id, [i]);
    }
    const large = [...found].filter(([, places]) => places.length > LEAST * COARSE ** 2);
    return new Map(large.map(([id, places]) => {
      const [x, w] = widened(places.map((i) => i % COARSE));
      const [y, h] = widened(places.map((i) => COARSE - 1 - Math.floor(i / COARSE)));
      return [id, {x, y, w, h}];
    }));
  }

  /** RGB and numbers of a region at width x height px: RGBA bytes, bottom row first. */
  shoot(room, lens, {x, y, w, h}, [width, height], look) {
    lens.setViewOffset(1, 1, x, y, w, h);
    const {numbers, developed} = this, light = this.lights[look.isSmooth ? 1 : 0];
    for (const used of [numbers, light, developed]) used.viewport.set(0, 0, width, height);
    this.#number(room, lens, numbers);
    this.#render(room.scene, lens, light);
    const part = new THREE.Vector2(width, height).divideScalar(this.side);
    const given = {...look, part, light: light.texture, numbers: numbers.texture};
    for (const [name, value] of Object.entries(given)) this.#develop.uniforms[name] = {value};
    for (let attempt = 0; ; attempt++) {
      this.#render(this.#square, this.#still, developed);
      const pixels = this.#read(developed, width, height), mean = brightness(pixels);
      if (attempt === 2 || (mean > DARK && mean < BRIGHT)) return pixels;
      const change = (WANTED / Math.max(mean, 8)) ** 1.8;
      this.#develop.uniforms.exposure.value *= Math.min(6, Math.max(0.15, change));
    }
  }

  #number({scene, meshes}, lens, numbers) {
    const looks = meshes.map((mesh) => mesh.material), {background} = scene;
    meshes.forEach((mesh) => { mesh.material = this.#flat[mesh.userData.id ?? 0]; });
    scene.background = null;
    this.#render(scene, lens, numbers);
    scene.background = background;
    meshes.forEach((mesh, i) => { mesh.material = looks[i]; });
  }

  #render(scene, lens, into) {
    this.#renderer.setRenderTarget(into);
    this.#renderer.render(scene, lens);
  }

  #read(from, width, height) {
    const pixels = new Uint8Array(4 * width * height);
    this.#renderer.readRenderTargetPixels(from, 0, 0, width, height, pixels);
    return pixels;
  }
}

/** Start and length, 0..1, of a range of pixels with a margin and a pixel of doubt. */
function widened(pixels) {
  const first = Math.min(...pixels), end = Math.max(...pixels) + 1, more = 1 + MARGIN * (end - first);
  const from = Math.max(0, first - more) / COARSE;
  return [from, Math.min(1, (end + more) / COARSE) - from];
}

function brightness(pixels) {
  let sum = 0;
  for (let k = 0; k < pixels.length; k += 4) sum += pixels[k] + 2 * pixels[k + 1] + pixels[k + 2];
  return sum / pixels.length;
}
