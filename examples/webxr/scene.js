/** The room around the objects: light, floor, walls. */
import * as THREE from 'three';
import {RoomEnvironment} from 'three/addons/environments/RoomEnvironment.js';
import {TABLE_TOP} from './objects.js';

const WALL = 0xc9c1b2;
const FLOOR = 0x6f5a48;
const PANEL = 0x8fa09a;
const FRAME = 0xf1efe8;
const SKY = 0xe8f3ff;
const BACK = -1.3; // m, position of the wall

/** Creates a lit scene with the objects; metal and glass mirror a bright room. */
export function buildScene(renderer, objects) {
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(WALL);
  const generator = new THREE.PMREMGenerator(renderer);
  scene.environment = generator.fromScene(new RoomEnvironment(), 0.01).texture;
  scene.environmentIntensity = 0.8;
  generator.dispose();
  scene.add(...room(), sun(), ...objects.map(({root}) => root));
  return scene;
}

/** Creates floor, panelled wall and a bright window, as a background for glass. */
function room() {
  const floor = new THREE.Mesh(
    new THREE.PlaneGeometry(8, 8).rotateX(-Math.PI / 2),
    new THREE.MeshStandardMaterial({color: FLOOR, roughness: 0.9}),
  );
  floor.receiveShadow = true;
  const board = (width, height, x, y, z, color) => {
    const mesh = new THREE.Mesh(new THREE.BoxGeometry(width, height, 0.04), new THREE.MeshStandardMaterial({color}));
    mesh.position.set(x, y, z);
    return mesh;
  };
  const sky = new THREE.Mesh(new THREE.PlaneGeometry(1.4, 1), new THREE.MeshBasicMaterial({color: SKY}));
  sky.position.set(-0.5, 1.65, BACK + 0.022);
  const bars = [-1.2, -0.5, 0.2].map((x) => board(0.06, 1.06, x, 1.65, BACK + 0.03, FRAME));
  const sills = [1.12, 1.65, 2.18].map((y) => board(1.46, 0.06, -0.5, y, BACK + 0.03, FRAME));
  const panels = Array.from({length: 20}, (_, i) => board(0.385, 0.86, (i - 9.5) * 0.4, 0.43, BACK + 0.02, PANEL));
  const rail = board(8, 0.05, 0, 0.9, BACK + 0.03, FRAME);
  return [floor, board(8, 3, 0, 1.5, BACK, WALL), sky, ...bars, ...sills, ...panels, rail];
}

function sun() {
  const light = new THREE.DirectionalLight(0xfff0dc, 1.8);
  light.position.set(-1.1, 2.6, 1.1);
  light.target.position.set(0, TABLE_TOP, -0.2);
  light.castShadow = true;
  light.shadow.mapSize.set(1024, 1024);
  light.shadow.bias = -0.0004;
  light.shadow.normalBias = 0.004;
  Object.assign(light.shadow.camera, {left: -1.2, right: 1.2, top: 1, bottom: -1, near: 0.5, far: 4.5});
  light.add(light.target);
  light.target.position.sub(light.position);
  return light;
}
