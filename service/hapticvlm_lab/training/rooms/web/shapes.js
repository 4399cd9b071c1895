/** What things are made into: a shape is a function of a dice to a Body. */
import * as THREE from 'three';
import {Body, O, dents, reshaped} from './body.js';

const FLAT = [Math.PI / 2, 0, 0];
const smooth = (points, count = 22) => new THREE.SplineCurve(
  points.map(([x, y]) => new THREE.Vector2(x, y))).getPoints(count).map(({x, y}) => [x, y]);

/** A body to which something was added `count` times. */
function repeated(count, add, body = new Body()) {
  for (let i = 0; i < count; i++) add(body, i);
  return body;
}

/** Vessels: range of heights in metres, and outline [radius, height] over it, foot to lip. */
const VESSELS = {
  bottle: [[0.2, 0.33], (d) => {
    const r = d.uniform(0.13, 0.2), s = d.uniform(0.5, 0.7), neck = r * d.uniform(0.25, 0.5);
    return [[0.9 * r, 0], [r, 0.02], ...smooth([[r, s], [0.9 * r, s + 0.07], [neck, s + 0.22],
      [neck, 0.97]]), [1.25 * neck, 0.98], [1.25 * neck, 1]];
  }],
  goblet: [[0.14, 0.24], (d) => {
    const r = d.uniform(0.18, 0.3), s = d.uniform(0.4, 0.55), rest = 1 - s;
    return [[0.85 * r, 0], [0.8 * r, 0.02], [0.1 * r, 0.06], ...smooth([[0.1 * r, s],
      [0.75 * r, s + 0.2 * rest], [r, s + 0.55 * rest], [r * d.uniform(0.65, 1.1), 1]])];
  }],
  bowl: [[0.05, 0.12], (d) => smooth([[0.6, 0], [0.65, 0.08], [d.uniform(1, 1.4), 0.5], [1.45, 1]])],
  plate: [[0.015, 0.025], (d) => smooth([[3, 0], [4, 0.2], [d.uniform(5, 7), 1]])],
  vase: [[0.15, 0.5], (d) => smooth([0, 0.25, 0.6, 0.85, 1].map((y) => [d.uniform(0.08, 0.32), y]))],
  mug: [[0.07, 0.12], (d) => smooth([[0.42, 0], [d.uniform(0.38, 0.5), 0.5], [d.uniform(0.38, 0.5), 1]])],
  pot: [[0.1, 0.4], (d) => [[0.35, 0], [d.uniform(0.4, 0.6), 0.86], [0.62, 0.86], [0.64, 1]]],
};

/** A vessel with walls, at times filled, capped or with a handle. */
const vessel = (...kinds) => (d) => {
  const kind = d.pick(kinds), [heights, outlined] = VESSELS[kind], h = d.uniform(...heights);
  const outline = outlined(d).map(([x, y]) => [x * h, y * h]), [lip] = outline.at(-1);
  const wide = Math.max(...outline.map(([x]) => x)), thick = wide * d.uniform(0.03, 0.1);
  const floor = kind === 'goblet' ? outline[3][1] : h * d.uniform(0.03, 0.1);
  const inner = outline.filter(([, y]) => y > floor).map(([x, y]) => [x - thick, y]);
  const body = new Body().turned([[0, 0], ...outline, ...inner.toReversed(), [0, floor]]);
  const level = floor + (h - floor) * d.uniform(0.3, 0.8);
  const filled = inner.filter(([, y]) => y < level).map(([x, y]) => [0.97 * x, y]);
  if (kind !== 'plate' && d.chance(0.35) && filled.length > 1) {
    body.turned([[0, filled[0][1]], ...filled, [0, filled.at(-1)[1]]], O, {role: 'liquid'});
  }
  if (kind === 'mug') body.ring(0.28 * h, 0.07 * h, [wide, h / 2, 0], [0, 0, -1.7], 3.4);
  if (kind === 'bottle' && d.chance(0.4)) body.rod([0, h, 0], [0, h + 0.03, 0], lip, lip, {role: 'accent'});
  return body;
};

function table(d) {
  const w = d.uniform(0.6, 1.6), z = d.uniform(0.5, 0.9), h = d.uniform(0.4, 0.8);
  return new Body().box([w, d.uniform(0.02, 0.06), z], [0, h, 0], O, {round: 0.008})
    .legs(0.9 * w, 0.85 * z, h, d.uniform(0.02, 0.045), d.uniform(-0.1, 0.1)).projected();
}

function chair(d) {
  const w = d.uniform(0.38, 0.5), h = d.uniform(0.4, 0.48), back = h + d.uniform(0.35, 0.55);
  const body = new Body().box([w, 0.035, w], [0, h, 0], O, {round: 0.012});
  body.legs(0.86 * w, 0.86 * w, h, d.uniform(0.015, 0.025), 0.04);
  if (d.chance(0.25)) return body.projected(3); // a stool
  const count = d.integer(2, 6), x = (i) => 0.86 * w * (i / (count - 1) - 0.5);
  repeated(count, (_, i) => body.rod([x(i), h, -0.44 * w], [x(i), back, -0.48 * w], 0.013));
  return body.box([w, d.uniform(0.05, 0.2), 0.022], [0, back, -0.48 * w]).projected(3);
}

function sofa(d) {
  const w = d.uniform(0.8, 2), n = d.integer(1, 3), body = new Body();
  const soft = (size, at) => body.box(size, at, O, {round: 0.07});
  soft([w, 0.25, 0.7], [0, 0.25, 0]);
  soft([w, 0.5, 0.2], [0, 0.55, -0.3]);
  for (const x of [-w / 2, w / 2]) soft([0.18, 0.42, 0.7], [x, 0.42, 0]);
  repeated(n, (_, i) => soft([(0.84 * w) / n, 0.16, 0.5], [0.84 * w * ((i + 0.5) / n - 0.5), 0.43, 0.06]));
  return body.projected().legs(0.9 * w, 0.55, 0.12, 0.025, 0, {role: 'accent'});
}

/** Cloth over a box or a ball, by formula: flat on top, falling in folds beyond its edge. */
function draped(d) {
  const size = d.uniform(0.4, 1), a = size * d.uniform(0.2, 0.33), b = a * d.uniform(0.5, 1);
  const h = d.uniform(0.15, 0.4), folds = d.integer(5, 14), deep = d.uniform(0.1, 0.2), isRound = d.chance(0.4);
  return new Body().sheet([size, size], [44, 44], (x, z) => {
    const far = Math.hypot(x, z), wave = Math.sin(folds * Math.atan2(z, x));
    const out = isRound ? Math.max(0, far - a)
      : Math.hypot(Math.max(0, Math.abs(x) - a), Math.max(0, Math.abs(z) - b));
    const fall = Math.min(out, h), inward = 0.92 * out * (1 - (deep * wave * fall) / h);
    const keep = Math.max(0.02, (far - inward + 0.6 * Math.max(0, out - h)) / Math.max(far, 1e-6));
    return [x * keep, h - fall + 0.004 * wave + 0.012, -z * keep];
  });
}

/** A dented ball pulled out to four corners and flattened. */
function cushion(d) {
  const w = d.uniform(0.12, 0.3), stretch = [w, w * d.uniform(0.25, 0.5), w * d.uniform(0.6, 1)];
  const dent = dents(d, 0.05, 3), ball = reshaped(new THREE.SphereGeometry(1, 40, 24), (x, y, z) => {
    const corner = 1 + 0.8 * (x * z) ** 2;
    return dent(x * corner, y, z * corner);
  });
  return new Body().add(ball, O, d.pick([O, [1.2, 0, 0]]), {stretch});
}

/** Leaves round a stem: rosettes, bushes and grass. */
function plant(d) {
  const [count, long, wide, tilt] = d.pick([[16, 0.28, 0.06, 0.7], [70, 0.1, 0.05, 3], [60, 0.35, 0.018, 0.3]]);
  const size = d.uniform(0.7, 1.3), bend = d.uniform(0.3, 1.4), isBush = tilt === 3;
  const leaf = (x, y) => {
    const v = y + 0.5, blade = Math.sin(Math.PI * Math.min(0.99, 0.08 + 0.9 * v)) ** 0.8;
    return [x * wide * size * blade, long * size * v * (1 - 0.25 * bend * v),
      0.5 * wide * Math.abs(x) - 0.5 * long * bend * v * v];
  };
  const body = repeated(count, (all) => {
    const at = isBush ? [d.uniform(-0.13, 0.13), d.uniform(0.12, 0.38), d.uniform(-0.13, 0.13)] : O;
    const turn = [d.uniform(-1, 1) * tilt, d.uniform(0, 6.28), (d.uniform(-1, 1) * tilt) / 2];
    all.sheet([1, 1], [2, 6], leaf, at, turn);
  });
  return isBush ? body.rod(O, [0, 0.25, 0], 0.02, 0.012, {role: 'wood'}) : body;
}

function page(d) {
  const w = d.uniform(0.15, 0.33), k = d.uniform(-2.5, 2.5), m = d.uniform(-1.5, 1.5);
  const bend = (x, y) => [x, y, k * x * x + m * y * y + 0.4 * k * x * y];
  return new Body().sheet([w, 1.4 * w], [16, 20], bend, O, [d.pick([-1.4, -0.4]), 0, 0.1]);
}

function stone(d, rate = d.spread(1.5, 5), size = d.spread(0.06, 0.35)) {
  const ball = d.pick([new THREE.SphereGeometry(1, 40, 26), new THREE.IcosahedronGeometry(1, d.integer(2, 8))]);
  const stretch = [size, size * d.uniform(0.5, 1), size * d.uniform(0.7, 1)];
  return new Body().add(reshaped(ball, dents(d, d.uniform(0.12, 0.35), rate)), O, O, {stretch}).projected();
}

const TYRE = smooth([[0.2, -0.07], [0.28, -0.09], [0.32, -0.06], [0.32, 0.06], [0.28, 0.09], [0.2, 0.07]]);
const tyre = (d) => new Body().turned(TYRE, d.pick([O, FLAT]));
const spoon = () => new Body().ball(0.03, [0, 0, 0.13], [0.8, 0.35, 1.2]).rod([0, 0, 0.1], [0, 0, -0.1], 0.005);
const slab = (low, high) => (d) => new Body().box([d.uniform(0.2, 0.8), d.uniform(low, high), d.uniform(0.15, 0.6)], O,
  [d.pick([0, 0, 1.3]), 0, 0], {round: 0.006}).projected(1);
const pile = (w, high, z, round) => (d) => repeated(d.integer(1, 6), (body, i) => body.box([w, high, z],
  [0, 1.03 * high * i, 0], [0, d.uniform(-0.2, 0.2), 0], {round})).projected();
const blob = (d) => repeated(d.integer(2, 6), (body) => body.ball(d.uniform(0.06, 0.16),
  [d.uniform(-0.12, 0.12), d.uniform(0.1, 0.35), d.uniform(-0.12, 0.12)], [1, d.uniform(0.6, 1.4), 1]));

/** The test bodies of every engine. */
function primitive(d) {
  const r = d.spread(0.06, 0.3), size = () => r * d.uniform(0.7, 2.2), tip = d.pick([0, 0, d.uniform(-1.6, 1.6)]);
  if (d.chance(0.3)) return new Body().box(O.map(size), O, [tip, 0, 0], {round: r * d.uniform(0, 0.2)}).projected(1);
  return new Body().add(d.pick([
    () => new THREE.SphereGeometry(r, 40, 28), () => new THREE.SphereGeometry(r, 40, 28),
    () => new THREE.TorusKnotGeometry(r, r * d.uniform(0.2, 0.38), 90, 14, d.integer(1, 3), d.integer(2, 5)),
    () => new THREE.TorusGeometry(r, r * d.uniform(0.15, 0.45), 18, 44),
    () => new THREE.CylinderGeometry(r * d.uniform(0, 1), r, r * d.uniform(0.4, 3), 36),
    () => new THREE.CapsuleGeometry(0.6 * r, size(), 8, 28), () => new THREE.IcosahedronGeometry(r, 0)])(), O, [tip, 0, 0]);
}

const TYPICAL = {
  wood: [table, chair, slab(0.2, 0.6), pile(0.6, 0.03, 0.14), spoon, slab(0.012, 0.03), vessel('bowl', 'vase')],
  glass: [vessel('bottle'), vessel('goblet'), vessel('mug', 'pot'), vessel('bowl', 'plate'),
    vessel('vase'), slab(0.004, 0.02), table],
  fabric: [draped, draped, cushion, cushion, pile(0.4, 0.03, 0.26, 0.014), sofa, slab(0.01, 0.02)],
  metal: [spoon, slab(0.003, 0.02), chair, table, vessel('pot', 'mug', 'bowl', 'goblet')],
  plastic: [slab(0.02, 0.2), vessel('bottle', 'pot', 'mug', 'bowl'), chair, blob],
  stone: [stone, stone, slab(0.03, 0.2), slab(0.2, 0.6), vessel('pot', 'bowl'), table],
  ceramic: [vessel('mug'), vessel('bowl', 'plate'), vessel('vase'), vessel('pot')],
  paper: [pile(0.16, 0.03, 0.23), pile(0.21, 0.004, 0.3), page, page, (d) => stone(d, d.uniform(4, 8), 0.1),
    slab(0.1, 0.4), slab(0.1, 0.4)],
  leather: [sofa, cushion, cushion, pile(0.18, 0.04, 0.25, 0.004), slab(0.01, 0.03)],
  rubber: [tyre, tyre, slab(0.005, 0.02), primitive],
  foliage: [plant], turf: [slab(0.03, 0.06)], unknown: [blob, primitive, slab(0.01, 0.3)],
};
const ALWAYS_TYPICAL = ['paper', 'foliage', 'turf'];

/** A typical body of a class, or now and then a test body. */
export const shape = (name, dice) => (dice.chance(0.28) && !ALWAYS_TYPICAL.includes(name)
  ? primitive : dice.pick(TYPICAL[name]))(dice);
