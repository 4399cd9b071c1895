/** The card at the touched object with its material, warmth and vibration; one picture for page and headset. */
import * as THREE from 'three';
import {materialColour, warmthColour, warmthWord} from '../../feel.js';

const SIZE = {width: 264, height: 124}; // CSS px
const SCALE = 2;
const METRES = 0.19; // wide, in the headset
const ABOVE = 0.13; // m above the touched point
const AWAY = {x: 58, y: -150}; // px from the point, on the page
const EDGE = 12;
const HISTORY = 90; // values of the vibration's history
const STAYS = 2500; // ms after the touch

export class Readout {
  #canvas = Object.assign(document.createElement('canvas'), {width: SIZE.width * SCALE, height: SIZE.height * SCALE});
  #line = document.createElement('i');
  #history = new Float32Array(HISTORY);
  #texture = new THREE.CanvasTexture(this.#canvas);
  #shown = null; // {object, surface, decision, point}
  #until = 0;
  #painted = []; // the values on the card
  #paintedAt = -Infinity;
  #wait;

  /** `place` is the element over the canvas that contains the card; it is painted at most every `wait` ms. */
  constructor(place, wait) {
    this.#wait = wait;
    this.#canvas.className = 'readout';
    this.#canvas.setAttribute('aria-hidden', 'true'); // the page contains the same text
    this.#line.className = 'leader';
    place.append(this.#line, this.#canvas);
    this.#texture.colorSpace = THREE.SRGBColorSpace;
    const material = new THREE.MeshBasicMaterial({map: this.#texture, transparent: true, toneMapped: false, depthTest: false});
    this.mesh = new THREE.Mesh(new THREE.PlaneGeometry(METRES, (METRES * SIZE.height) / SIZE.width), material);
    this.mesh.renderOrder = 10;
    this.mesh.visible = false;
  }

  /** Shows this surface of an object, touched at `point`, with its newest decision (or null). */
  show(object, surface, decision, point, now) {
    this.#shown = {object, surface, decision, point: point.clone()};
    this.#until = now + STAYS;
  }

  /** Whether an object has been touched yet. */
  get hasShown() {
    return this.#shown !== null;
  }

  update(decision) {
    const {object, surface} = this.#shown ?? {};
    if (object?.object_id === decision.object_id && surface === (decision.surface ?? 0)) this.#shown.decision = decision;
  }

  /** Updates the card; `level` 0..1 is the current vibration. Returns whether it is shown. */
  step(now, level) {
    this.#history.copyWithin(0, 1);
    this.#history[HISTORY - 1] = level;
    const isShown = this.#shown !== null && now < this.#until;
    if (isShown && now - this.#paintedAt >= this.#wait && this.#isOld()) this.#paint(now);
    return isShown;
  }

  /** Returns whether the card is out of date, since painting it costs the page a redraw. */
  #isOld() {
    const {object, decision} = this.#shown;
    const before = this.#painted;
    this.#painted = [object, decision, this.#history.some((level) => level > 0)];
    return this.#painted[2] || this.#painted.some((part, index) => part !== before[index]);
  }

  /** Positions the card on the page. */
  onPage(isShown, camera, {clientWidth: width, clientHeight: height}) {
    this.mesh.visible = false;
    this.#canvas.hidden = this.#line.hidden = !isShown;
    if (!isShown) return;
    const at = this.#shown.point.clone().project(camera);
    const [x, y] = [((at.x + 1) / 2) * width, ((1 - at.y) / 2) * height];
    const left = clamp(x + (x > width * 0.62 ? -AWAY.x - SIZE.width : AWAY.x), EDGE, width - SIZE.width - EDGE);
    const top = clamp(y + AWAY.y, EDGE + 56, height - SIZE.height - EDGE);
    this.#canvas.style.transform = `translate(${left}px, ${top}px)`;
    const [toX, toY] = [left > x ? left : left + SIZE.width, top + SIZE.height / 2];
    const length = Math.hypot(toX - x, toY - y);
    this.#line.style.width = `${length}px`;
    this.#line.style.transform = `translate(${x}px, ${y}px) rotate(${Math.atan2(toY - y, toX - x)}rad)`;
  }

  /** Positions the card in the headset, above the hand and facing the head. */
  inHeadset(isShown, head) {
    this.#canvas.hidden = this.#line.hidden = true;
    this.mesh.visible = isShown;
    if (!isShown) return;
    this.mesh.position.copy(this.#shown.point).add({x: 0, y: ABOVE, z: 0});
    this.mesh.lookAt(head.x, head.y, head.z);
    this.#texture.needsUpdate = true;
  }

  #paint(now) {
    this.#paintedAt = now;
    const pen = this.#canvas.getContext('2d');
    pen.setTransform(SCALE, 0, 0, SCALE, 0, 0);
    pen.clearRect(0, 0, SIZE.width, SIZE.height);
    pen.fillStyle = 'rgb(14 20 25 / 0.86)';
    pen.beginPath();
    pen.roundRect(0, 0, SIZE.width, SIZE.height, 14);
    pen.fill();
    const {object, decision} = this.#shown;
    const source = decision ? why(decision) : '';
    const taken = text(pen, source, SIZE.width - 16, 23, '500 12px', '#b9c6cf', 'right');
    text(pen, clipped(pen, object.says.name ?? object.key, SIZE.width - 44 - taken), 16, 23, '500 12px', '#b9c6cf');
    const material = decision?.material ?? 'deciding';
    pen.fillStyle = materialColour(decision?.material);
    pen.beginPath();
    pen.arc(22, 43, 6, 0, 7);
    pen.fill();
    text(pen, material, 35, 52, '700 27px', '#fff');
    this.#warmth(pen, decision);
    this.#ribbon(pen);
  }

  #warmth(pen, decision) {
    const warmth_c = decision?.thermal_cue ? decision.setpoint_c : null;
    pen.fillStyle = warmth_c === null ? '#55636d' : warmthColour(warmth_c);
    pen.beginPath();
    pen.arc(22, 72, 6, 0, 7);
    pen.fill();
    const words = !decision ? 'warmth unknown' : decision.isBaked ? 'warmth needs a service and a plate' : warmth_c === null ? 'no noticeable warmth or cold' : `${warmthWord(warmth_c)}, the plate goes to ${warmth_c.toFixed(1)} °C`;
    text(pen, words, 35, 76, '500 12.5px', '#e9eff3');
  }

  /** Draws the mirrored envelope of the vibration, the newest on the right. */
  #ribbon(pen) {
    const [left, width, middle] = [16, SIZE.width - 32, 101];
    pen.fillStyle = 'rgb(255 255 255 / 0.16)';
    pen.fillRect(left, middle, width, 1);
    pen.fillStyle = '#45d3bf';
    const step = width / HISTORY;
    this.#history.forEach((level, index) => {
      const half = 14 * Math.sqrt(level);
      if (half > 0.5) pen.fillRect(left + index * step, middle - half, Math.max(1, step - 0.6), 2 * half);
    });
  }
}

const SOURCES = {scene: 'stated by the scene', name: 'by its name', shader: 'by its shader', texture: 'by its texture', encoder: 'by its picture', vlm: 'by the model', hand: 'stated by hand', unknown: 'not sure'};

function why({source, confidence, material, runner_up: next}) {
  if (material === 'unknown') return next ? `perhaps ${next}` : SOURCES.unknown;
  return `${Math.round(100 * confidence)} %, ${SOURCES[source] ?? source}`;
}

/** Truncates a name to a width, in the font of `pen`. */
function clipped(pen, name, width) {
  if (pen.measureText(name).width <= width) return name;
  let letters = name.length;
  while (letters > 1 && pen.measureText(`${name.slice(0, letters)}…`).width > width) letters--;
  return `${name.slice(0, letters)}…`;
}

/** Draws text and returns its width, px. */
function text(pen, words, x, y, font, colour, align = 'left') {
  pen.font = `${font} system-ui, sans-serif`;
  pen.fillStyle = colour;
  pen.textAlign = align;
  pen.fillText(words, x, y);
  return pen.measureText(words).width;
}

const clamp = (value, low, high) => Math.max(low, Math.min(high, value));
