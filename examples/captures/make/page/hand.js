/**
 * An emulated hand: its mesh, and its placement with the fingertip at a given point.
 *
 * The joints come from the XR frame. The hand is rigid, so its mesh is built once, from the joints
 * the session reports, as convex hulls around pairs of joint spheres.
 */
import * as THREE from 'three';
import {ConvexGeometry} from 'three/addons/geometries/ConvexGeometry.js';
import {mergeVertices} from 'three/addons/utils/BufferGeometryUtils.js';
import {TIP_RADIUS} from './choreography.js';

const FINGERS = ['thumb', 'index-finger', 'middle-finger', 'ring-finger', 'pinky-finger'];
const BONES = ['metacarpal', 'phalanx-proximal', 'phalanx-intermediate', 'phalanx-distal', 'tip'];
const TIP = 'index-finger-tip';
const KNUCKLE = 'index-finger-phalanx-proximal';

export class Hand {
  #source;
  #space;
  #tip;
  #toFinger;
  #root = new THREE.Group();

  /** Reads the hand's shape from its input source in this XR frame. */
  constructor(source, frame, space) {
    this.#source = source;
    this.#space = space;
    const joints = readJoints(source, frame);
    this.#tip = joints.get(TIP).point;
    const finger = this.#tip.clone().sub(joints.get(KNUCKLE).point).normalize();
    this.#toFinger = basis(finger, new THREE.Vector3(0, 1, 0)).invert();
    this.#root.add(...flesh(joints));
  }

  get handedness() {
    return this.#source.handedness;
  }

  get root() {
    return this.#root;
  }

  /** Sets the emulated device so that the index finger points along `finger` and ends at `tip`. */
  place(input, tip, finger) {
    const lift = new THREE.Vector3(0, 1, 0).addScaledVector(finger, 0.3);
    const turn = basis(finger, lift).multiply(this.#toFinger);
    const rotation = new THREE.Quaternion().setFromRotationMatrix(turn);
    const at = tip.clone().sub(this.#tip.clone().applyQuaternion(rotation));
    input.position.set(at.x, at.y, at.z);
    input.quaternion.set(rotation.x, rotation.y, rotation.z, rotation.w);
  }

  /** Moves the mesh to the hand's pose in the XR frame; returns the fingertip's centre. */
  follow(frame) {
    const pose = frame.getPose(this.#source.targetRaySpace, this.#space).transform;
    this.#root.position.copy(pose.position);
    this.#root.quaternion.copy(pose.orientation);
    const {position} = frame.getJointPose(this.#source.hand.get(TIP), this.#space).transform;
    return new THREE.Vector3().copy(position);
  }
}

/** Returns a rotation with -z along `finger` and y towards `up`. */
function basis(finger, up) {
  return new THREE.Matrix4().lookAt(new THREE.Vector3(), finger, up);
}

/** Returns joint centres and radii in the hand's space. */
function readJoints(source, frame) {
  const joints = new Map();
  for (const [name, joint] of source.hand) {
    const pose = frame.getJointPose(joint, source.targetRaySpace);
    joints.set(name, {point: new THREE.Vector3().copy(pose.transform.position), radius: pose.radius});
  }
  joints.get(TIP).radius = TIP_RADIUS;
  return joints;
}

function flesh(joints) {
  const skin = new THREE.MeshStandardMaterial({color: 0x59667a, roughness: 0.62});
  const parts = [];
  const palm = [joints.get('wrist')];
  for (const finger of FINGERS) {
    const chain = BONES.map((bone) => joints.get(`${finger}-${bone}`)).filter(Boolean);
    palm.push(chain[0]);
    if (finger !== 'thumb') palm.push(chain[1]);
    for (let i = finger === 'thumb' ? 0 : 1; i + 1 < chain.length; i++) {
      parts.push(hull([chain[i], chain[i + 1]]));
    }
  }
  parts.push(hull(palm), sleeve(joints));
  return parts.map((geometry) => {
    const mesh = new THREE.Mesh(geometry, skin);
    mesh.castShadow = mesh.receiveShadow = true;
    return mesh;
  });
}

/** Creates a forearm behind the wrist, in line with the hand. */
function sleeve(joints) {
  const {point} = joints.get('wrist');
  const back = point.clone().sub(joints.get('middle-finger-phalanx-proximal').point).setLength(0.26);
  return hull([{point, radius: 0.027}, {point: point.clone().add(back), radius: 0.036}]);
}

/** Creates the convex hull of spheres. */
function hull(spheres) {
  const points = spheres.flatMap(({point, radius}) => {
    const ball = new THREE.IcosahedronGeometry(radius, 3).getAttribute('position');
    return Array.from({length: ball.count}, (_, i) =>
      new THREE.Vector3().fromBufferAttribute(ball, i).add(point),
    );
  });
  const geometry = new ConvexGeometry(points);
  geometry.deleteAttribute('normal');
  const joined = mergeVertices(geometry, 1e-5);
  joined.computeVertexNormals();
  return joined;
}
