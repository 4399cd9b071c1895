/** Meshes of hands: tracked joints as a glove, a controller, and the pointing hand of the mouse. */
import * as THREE from 'three';
import {ConvexGeometry} from 'three/addons/geometries/ConvexGeometry.js';
import {mergeVertices} from 'three/addons/utils/BufferGeometryUtils.js';

const FINGERS = ['thumb', 'index-finger', 'middle-finger', 'ring-finger', 'pinky-finger'];
const BONES = ['metacarpal', 'phalanx-proximal', 'phalanx-intermediate', 'phalanx-distal', 'tip'];
const VIBRATION = 0x2fd8c3;
/** A right hand that points along -z with its index finger's tip at the origin: joint centres in m, y up. */
const POINTING = {
  'wrist': [0.012, 0.05, 0.165, 0.026],
  'index-finger': [[0, 0.047, 0.125, 0.014], [0, 0.05, 0.078, 0.0115], [0, 0.036, 0.04, 0.0095], [0, 0.016, 0.016, 0.0085], [0, 0, 0, 0.0078]],
  'middle-finger': [[0.018, 0.05, 0.127, 0.014], [0.021, 0.053, 0.08, 0.0115], [0.022, 0.04, 0.05, 0.0098], [0.022, 0.015, 0.056, 0.0088], [0.022, 0.004, 0.07, 0.008]],
  'ring-finger': [[0.035, 0.047, 0.13, 0.0135], [0.04, 0.05, 0.086, 0.011], [0.041, 0.036, 0.06, 0.0094], [0.04, 0.013, 0.067, 0.0084], [0.04, 0.004, 0.081, 0.0076]],
  'pinky-finger': [[0.05, 0.042, 0.134, 0.0125], [0.057, 0.043, 0.096, 0.0098], [0.057, 0.03, 0.074, 0.0084], [0.056, 0.012, 0.08, 0.0076], [0.055, 0.005, 0.092, 0.007]],
  'thumb': [[-0.008, 0.038, 0.142, 0.0145], [-0.024, 0.028, 0.11, 0.0115], [-0.022, 0.016, 0.082, 0.0102], [-0.008, 0.008, 0.064, 0.0088]],
};

const skin = () => new THREE.MeshStandardMaterial({color: 0x93a7b5, roughness: 0.6, metalness: 0, envMapIntensity: 0.75});

/** The hand of the mouse or of a finger on the screen; `root` is placed at the touched point. */
export function pointingHand() {
  const root = new THREE.Group();
  const material = skin();
  for (const [name, joints] of Object.entries(POINTING)) {
    if (name === 'wrist') continue;
    const chain = [POINTING.wrist, ...joints].map(([x, y, z, radius]) => ({point: new THREE.Vector3(x, y, z), radius}));
    for (let i = 1; i < chain.length; i++) root.add(new THREE.Mesh(hull([chain[i - 1], chain[i]]), material));
  }
  const knuckles = FINGERS.slice(1).flatMap((name) => POINTING[name].slice(0, 2)).concat([POINTING.wrist, POINTING.thumb[0]]);
  root.add(new THREE.Mesh(hull(knuckles.map(([x, y, z, radius]) => ({point: new THREE.Vector3(x, y, z), radius: 0.8 * radius}))), material));
  root.traverse((node) => (node.castShadow = node.isMesh));
  return root;
}

/** A tracked hand: a rigid bone from each joint to the next, built when the joints are first reported. */
export class Glove {
  root = new THREE.Group();
  #bones = []; // {joint, mesh}

  follow(source, frame, space) {
    if (!this.#bones.length) this.#build(source, frame, space);
    for (const {joint, mesh} of this.#bones) {
      const pose = frame.getJointPose(source.hand.get(joint), space);
      mesh.visible = Boolean(pose);
      if (!pose) continue;
      mesh.position.copy(pose.transform.position);
      mesh.quaternion.copy(pose.transform.orientation);
    }
  }

  #build(source, frame, space) {
    const material = skin();
    for (const finger of FINGERS) {
      const names = ['wrist', ...BONES.map((part) => `${finger}-${part}`)].filter((name) => source.hand.get(name));
      for (let i = 1; i < names.length; i++) this.#add(names[i - 1], names[i], {source, frame, space, material});
    }
  }

  #add(from, to, {source, frame, space, material}) {
    const [a, b] = [from, to].map((name) => frame.getJointPose(source.hand.get(name), space));
    if (!a || !b) return;
    const inverse = new THREE.Matrix4().fromArray(a.transform.matrix).invert();
    const end = new THREE.Vector3().copy(b.transform.position).applyMatrix4(inverse);
    const mesh = new THREE.Mesh(hull([{point: new THREE.Vector3(), radius: a.radius}, {point: end, radius: b.radius}]), material);
    this.#bones.push({joint: from, mesh});
    this.root.add(mesh);
  }
}

/** A simple controller: grip, face, stick, trigger, and a ring that lights up when it vibrates. */
export class Controller {
  root = new THREE.Group();
  #ring;

  constructor() {
    const dark = new THREE.MeshStandardMaterial({color: 0x2b3136, roughness: 0.5});
    const pale = new THREE.MeshStandardMaterial({color: 0xe6eaec, roughness: 0.35});
    const part = (geometry, material, [x, y, z], tilt = 0) => {
      const mesh = new THREE.Mesh(geometry, material);
      mesh.position.set(x, y, z);
      mesh.rotation.x = tilt;
      mesh.castShadow = true;
      this.root.add(mesh);
      return mesh;
    };
    part(new THREE.CapsuleGeometry(0.0165, 0.075, 8, 24), pale, [0, -0.012, 0.03], 1.15);
    part(new THREE.SphereGeometry(0.026, 32, 20).scale(1, 0.62, 1.15), pale, [0, 0.004, -0.018], 0.25);
    part(new THREE.CylinderGeometry(0.0075, 0.0065, 0.009, 24), dark, [0, 0.024, -0.02], 0.25);
    part(new THREE.CylinderGeometry(0.0042, 0.0042, 0.004, 20), dark, [0.012, 0.0185, -0.008], 0.25);
    part(new THREE.CylinderGeometry(0.0042, 0.0042, 0.004, 20), dark, [0.013, 0.0185, -0.02], 0.25);
    part(new THREE.CapsuleGeometry(0.007, 0.012, 6, 16), dark, [0, -0.012, -0.042], 0.9);
    this.#ring = part(new THREE.TorusGeometry(0.0265, 0.0016, 10, 48), new THREE.MeshBasicMaterial({color: VIBRATION, transparent: true}), [0, 0.006, -0.018], 1.82);
  }

  follow(source, frame, space) {
    const pose = source.gripSpace && frame.getPose(source.gripSpace, space);
    this.root.visible = Boolean(pose);
    if (!pose) return;
    this.root.position.copy(pose.transform.position);
    this.root.quaternion.copy(pose.transform.orientation);
  }

  /** Shows the current amplitude of vibration, 0..1. */
  set vibration(amplitude) {
    this.#ring.material.opacity = 0.25 + 0.75 * amplitude;
    this.#ring.scale.setScalar(1 + 0.12 * amplitude);
  }
}

/** Returns the smooth hull around spheres. */
function hull(spheres) {
  const points = spheres.flatMap(({point, radius}) => {
    const ball = new THREE.IcosahedronGeometry(radius, 3).getAttribute('position');
    return Array.from({length: ball.count}, (_, i) => new THREE.Vector3().fromBufferAttribute(ball, i).add(point));
  });
  const geometry = new ConvexGeometry(points);
  geometry.deleteAttribute('normal');
  const joined = mergeVertices(geometry, 1e-5);
  joined.computeVertexNormals();
  return joined;
}
