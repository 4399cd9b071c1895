/** The room round the objects: light, floor, walls. */
import * as THREE from 'three';
import {RoomEnvironment} from 'three/addons/environments/RoomEnvironment.js';
import {TABLE_TOP} from './objects.js';

const WALL = 0xc9c1b2;
const FLOOR = 0x6f5a48;

/** A scene with the objects in it, lit; metal and glass mirror the room. */
export function buildScene(renderer, objects) {
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(WALL);
  const generator = new THREE.PMREMGenerator(renderer);
  scene.environment = generator.fromScene(new RoomEnvironment(), 0.03).texture;
  scene.environmentIntensity = 0.6;
  generator.dispose();
  const ground = new THREE.PlaneGeometry(8, 8).rotateX(-Math.PI / 2);
  const floor = new THREE.Mesh(ground, new THREE.MeshStandardMaterial({color: FLOOR, roughness: 0.9}));
  floor.receiveShadow = true;
  scene.add(floor, sun(), ...objects.map(({root}) => root));
  return scene;
}

function sun() {
  const light = new THREE.DirectionalLight(0xfff0dc, 2.4);
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
