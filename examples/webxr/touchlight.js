/**
 * Shows a touch on the objects themselves: a glow at the fingertip, the warmth around it, a ripple on a
 * strike, and a rim round what the hand is at. Every material of the objects is given these lights once.
 */
import * as THREE from 'three';
import {warmthRgb} from '../../feel.js';

const HANDS = 2;
const RIPPLES = 4;
const RIPPLE_S = 0.9;
const WARMS_S = 0.7; // until the tint is complete
const COOLS_S = 1.6; // until it has faded after a release
const FADES_S = 0.12; // fading time of the glow
const ADDED = 0.14; // share of the light on each wall of glass
const VIBRATION = new THREE.Color(0x45ffe0);
/** Speed (m/s), width (m) and decay (1/s) of a ripple: stiff materials ring, soft ones thud. */
const WAVES = {
  glass: [0.75, 0.01, 2.2], metal: [0.8, 0.012, 1.8], ceramic: [0.7, 0.011, 2.6], wood: [0.5, 0.018, 4.5],
  stone: [0.6, 0.014, 5], plastic: [0.45, 0.018, 4.5], fabric: [0.22, 0.03, 6], unknown: [0.4, 0.02, 5],
};
const SHADER = /* glsl */ `
uniform float feelShown;
uniform float feelRim;
uniform float feelShare;
uniform vec4 feelAt[${HANDS}];
uniform float feelSize[${HANDS}];
uniform vec4 feelWarmth[${HANDS}];
uniform vec4 feelRipple[${RIPPLES}];
uniform vec4 feelWave[${RIPPLES}];
varying vec3 vFeelAt;

vec3 feelLight(vec3 lit, vec3 normal, vec3 view) {
  vec3 sum = lit;
  for (int i = 0; i < ${HANDS}; i++) {
    float away = distance(vFeelAt, feelAt[i].xyz);
    float tint = feelWarmth[i].a * exp(-away * away / 0.0072);
    sum = mix(sum, feelWarmth[i].rgb * (0.35 + 0.9 * dot(sum, vec3(0.3, 0.5, 0.2))), min(0.85, tint));
    float spot = exp(-away * away / (2.0 * feelSize[i] * feelSize[i]));
    float edge = (away - 2.2 * feelSize[i]) / 0.0035;
    float rim = exp(-edge * edge);
    sum += feelAt[i].w * (1.1 * spot + 0.8 * rim) * vec3(${VIBRATION.r}, ${VIBRATION.g}, ${VIBRATION.b});
  }
  for (int i = 0; i < ${RIPPLES}; i++) {
    float away = distance(vFeelAt, feelRipple[i].xyz);
    float phase = (away - feelWave[i].x) / feelWave[i].y;
    sum += feelRipple[i].w * exp(-phase * phase) * (0.6 + 0.4 * cos(6.0 * phase)) * feelWave[i].z * vec3(0.8, 1.2, 1.12);
  }
  float grazing = pow(max(0.0, 1.0 - abs(dot(normal, view))), 2.5);
  sum += feelRim * (0.04 + 0.55 * grazing) * vec3(0.8, 1.0, 0.97);
  return mix(lit, sum, feelShown * feelShare);
}
`;

export class TouchLight {
  #shared = {
    feelShown: {value: 1},
    feelAt: {value: list(HANDS)},
    feelSize: {value: [0.01, 0.01]},
    feelWarmth: {value: list(HANDS)},
    feelRipple: {value: list(RIPPLES)},
    feelWave: {value: list(RIPPLES)},
  };
  #rims = new Map(); // object -> its uniform
  #boxes = new Map(); // object -> its bounding box
  #hands = {left: hand(0), right: hand(1)};
  #ripples = Array.from({length: RIPPLES}, () => ({at: -Infinity, material: 'unknown', strength: 0}));
  #next = 0;
  #wanted = null; // the object with a rim

  constructor(objects) {
    for (const object of objects) {
      const rim = {value: 0};
      this.#rims.set(object, rim);
      this.#boxes.set(object, new THREE.Box3().setFromObject(object.root));
      const seen = new Set();
      object.root.traverse(({material = []}) => {
        for (const one of [material].flat()) {
          if (seen.has(one)) continue;
          seen.add(one);
          this.#patch(one, {...this.#shared, feelRim: rim, feelShare: shareOf(one)});
        }
      });
    }
  }

  /** Hides all of it while pictures for the recogniser are taken. */
  get visible() {
    return this.#shared.feelShown.value > 0;
  }

  set visible(shown) {
    this.#shared.feelShown.value = shown ? 1 : 0;
  }

  /** Updates a hand at `point` of `object`; `warmth_c` is the felt temperature, null for none. */
  touch({hand: name, phase, force_n: force, interaction}, object, point, {material = 'unknown', warmth_c = null} = {}) {
    const hand = this.#hands[name];
    const held = phase === 'contact' || phase === 'slide';
    if (held && !hand.held) this.#ripple(point, material, interaction === 'tap' ? 0.55 : 1);
    hand.held = held;
    hand.near = phase !== 'release';
    hand.size = 0.01 + 0.0015 * Math.min(8, force);
    if (hand.near && point) hand.point.copy(point);
    if (warmth_c !== null) hand.colour.setRGB(...warmthRgb(warmth_c).map((part) => part / 255), THREE.SRGBColorSpace);
    hand.isWarm = held && warmth_c !== null;
    this.#wanted = hand.near ? object : null;
  }

  /** Advances time; `level` (0..1) is the strength of the vibration. Returns the changed spheres and boxes (m). */
  step(now, elapsed, level) {
    const changed = Object.values(this.#hands).flatMap((hand) => this.#follow(hand, elapsed, level));
    this.#ripples.forEach((ripple, index) => changed.push(...this.#spread(ripple, index, now)));
    for (const [object, rim] of this.#rims) {
      const next = toward(rim.value, object === this.#wanted ? 1 : 0, elapsed / FADES_S);
      if (next !== rim.value) changed.push(this.#boxes.get(object));
      rim.value = next;
    }
    return changed;
  }

  #follow(hand, elapsed, level) {
    const goal = hand.held ? 1 : hand.near ? 0.3 : 0;
    hand.glow = hand.held ? goal : toward(hand.glow, goal, elapsed / FADES_S);
    hand.warmth = toward(hand.warmth, hand.isWarm ? 1 : 0, elapsed / (hand.isWarm ? WARMS_S : COOLS_S));
    const {x, y, z} = hand.point;
    const pulse = hand.held ? 0.35 + 0.9 * Math.sqrt(level) : 1;
    const {r, g, b} = hand.colour;
    const [before, lit] = [hand.lit, [x, y, z, hand.glow * pulse, r, g, b, hand.warmth, hand.size]];
    if (lit.every((value, part) => value === before[part])) return [];
    hand.lit = lit;
    this.#shared.feelAt.value[hand.index].fromArray(lit);
    this.#shared.feelWarmth.value[hand.index].fromArray(lit, 4);
    this.#shared.feelSize.value[hand.index] = hand.size;
    return [glowOf(before), glowOf(lit)];
  }

  #ripple(point, material, strength) {
    Object.assign(this.#ripples[this.#next], {at: performance.now(), material, strength});
    this.#shared.feelRipple.value[this.#next].set(point.x, point.y, point.z, 0);
    this.#next = (this.#next + 1) % RIPPLES;
  }

  #spread({at, material, strength}, index, now) {
    const age = Math.min(RIPPLE_S, Math.max(0, now - at) / 1000);
    const [speed, width, dies] = WAVES[material] ?? WAVES.unknown;
    const isAlive = age < RIPPLE_S;
    const ripple = this.#shared.feelRipple.value[index];
    if (!isAlive && ripple.w === 0) return [];
    const radius = speed * age + 0.004;
    ripple.w = isAlive ? strength : 0;
    this.#shared.feelWave.value[index].set(radius, width, isAlive ? 2.2 * Math.exp(-dies * age) * (1 - age / RIPPLE_S) : 0, 0);
    return [ball(ripple, radius + widths(2.2) * width)];
  }

  #patch(material, uniforms) {
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, uniforms);
      shader.vertexShader = shader.vertexShader
        .replace('#include <common>', '#include <common>\nvarying vec3 vFeelAt;')
        .replace('#include <project_vertex>', '#include <project_vertex>\nvFeelAt = (modelMatrix * vec4(transformed, 1.0)).xyz;');
      shader.fragmentShader = shader.fragmentShader
        .replace('#include <common>', `#include <common>\n${SHADER}`)
        .replace('#include <opaque_fragment>', 'outgoingLight = feelLight(outgoingLight, normal, normalize(vViewPosition));\n#include <opaque_fragment>');
    };
    material.customProgramCacheKey = () => 'touchlight';
  }
}

/** Reduces the light on additively drawn glass, whose two walls would otherwise turn white under a touch. */
function shareOf(material) {
  return {get value() { return material.blending === THREE.AdditiveBlending ? ADDED : 1; }};
}

function hand(index) {
  return {index, point: new THREE.Vector3(0, -9, 0), colour: new THREE.Color(), held: false, near: false, isWarm: false, glow: 0, warmth: 0, size: 0.01, lit: new Array(9).fill(0)};
}

/** Returns the visible extent of a hand's light, with the same bell curves as in the shader. */
function glowOf([x, y, z, glow, , , , warmth, size]) {
  return ball([x, y, z], Math.max(widths(2 * glow) * Math.SQRT2 * size, widths(warmth) * Math.sqrt(0.0072)));
}

/** Returns the width of a bell curve of this height down to 0.001, which is invisible. */
function widths(height) {
  return Math.sqrt(Math.max(0, Math.log(1000 * height)));
}

function ball([x, y, z], radius) {
  return new THREE.Sphere(new THREE.Vector3(x, y, z), radius);
}

function list(count) {
  return Array.from({length: count}, () => new THREE.Vector4(0, -9, 0, 0));
}

function toward(value, goal, step) {
  return value < goal ? Math.min(goal, value + step) : Math.max(goal, value - step);
}
