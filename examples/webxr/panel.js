/** Explains a decision as text, beside the page's canvas and on a board in VR. */
import * as THREE from 'three';

const BOARD = {width: 0.62, height: 0.43, at: [-0.86, 1.12, -0.34], turn: 0.85}; // m, rad: beside the table, not over it
const PIXELS = {width: 1008, height: 700, line: 52, margin: 34};

/** Returns a decision of the service or of the bake as [label, text] pairs; `plate` is the newest telemetry, or null. */
export function explain(decision, plate) {
  if (!decision) return [['decision', 'none yet']];
  if (decision.isBaked) return [['material', `${decision.material}, ${percent(decision.confidence)} sure`], ['decided by', `${decision.source}, before this page was made`]];
  return [
    ['material', `${decision.material}, ${percent(decision.confidence)} sure`],
    ['decided by', decision.source + (decision.cached ? ' (cached)' : '')],
    ['evidence', decision.evidence.map(evidence).join('; ') || 'none'],
    ['ambient', `${range('ambient', decision)} (${decision.ambient_source})`],
    ['surface', `${range('surface', decision)} (${decision.surface_source}: ${decision.surface_why})`],
    ['felt as', decision.felt ?? (decision.basis === 'expectation' ? 'a mean of materials' : 'nothing')],
    ['setpoint', setpoint(decision)],
    ['plate', plate ? `${celsius(plate.plate_c)}, setpoint ${celsius(plate.setpoint_c)}` : 'no telemetry yet'],
    ['vibration', decision.pattern ?? 'none'],
  ];
}

/** Shows the rows in the page's list. */
export function write(list, rows) {
  list.replaceChildren(
    ...rows.flatMap(([label, text]) => [
      Object.assign(document.createElement('dt'), {textContent: label}),
      Object.assign(document.createElement('dd'), {textContent: text}),
    ]),
  );
}

/** Shows the same rows on a board in VR, where the page is not visible. */
export class Board {
  #canvas = new OffscreenCanvas(PIXELS.width, PIXELS.height);
  #shown = '';
  #texture = new THREE.CanvasTexture(this.#canvas);

  constructor(scene) {
    this.#texture.colorSpace = THREE.SRGBColorSpace;
    this.#texture.generateMipmaps = false;
    this.#texture.minFilter = THREE.LinearFilter;
    const paper = new THREE.MeshBasicMaterial({map: this.#texture, toneMapped: false});
    this.mesh = new THREE.Mesh(new THREE.PlaneGeometry(BOARD.width, BOARD.height), paper);
    this.mesh.position.set(...BOARD.at);
    this.mesh.rotation.y = BOARD.turn;
    this.mesh.visible = false;
    scene.add(this.mesh);
  }

  write(title, rows) {
    const text = JSON.stringify([title, rows]);
    if (text === this.#shown) return;
    this.#shown = text;
    const pen = this.#canvas.getContext('2d');
    pen.fillStyle = '#1b1f24';
    pen.fillRect(0, 0, PIXELS.width, PIXELS.height);
    pen.fillStyle = '#e8ebef';
    let y = PIXELS.margin + PIXELS.line / 2;
    pen.font = 'bold 44px system-ui, sans-serif';
    pen.fillText(title, PIXELS.margin, y);
    pen.font = '31px system-ui, sans-serif';
    for (const [label, text] of rows) {
      for (const [i, part] of wrapped(pen, text, PIXELS.width - 250 - PIXELS.margin).entries()) {
        y += i ? PIXELS.line * 0.72 : PIXELS.line;
        if (i === 0) pen.fillText(label, PIXELS.margin, y);
        pen.fillText(part, 250, y);
      }
    }
    this.#texture.needsUpdate = true;
  }
}

function wrapped(pen, text, width) {
  const lines = [''];
  for (const word of text.split(' ')) {
    const longer = `${lines.at(-1)} ${word}`.trim();
    if (pen.measureText(longer).width <= width) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}

function setpoint({setpoint_c, unlimited_c, limited_by, thermal_cue}) {
  const limited = limited_by ? `, ${limited_by} limit (physics: ${celsius(unlimited_c)})` : '';
  return `${celsius(setpoint_c)}${limited}${thermal_cue ? '' : ', too close to skin temperature to feel'}`;
}

function range(name, decision) {
  const [low, high] = [decision[`${name}_low_c`], decision[`${name}_high_c`]];
  return `${celsius(decision[`${name}_c`])} [${low.toFixed(0)}, ${high.toFixed(0)}]`;
}

const evidence = ({rung, material, confidence}) => `${rung}: ${material} ${percent(confidence)}`;
const percent = (share) => `${Math.round(100 * share)} %`;
const celsius = (value) => (value === null ? 'unknown' : `${value.toFixed(1)} °C`);
