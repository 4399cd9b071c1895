/** The room around the objects: walls, floor, window with a garden behind it, lamp light. */
import * as THREE from 'three';
import {RoomEnvironment} from 'three/addons/environments/RoomEnvironment.js';
import {PLANT, TABLE_TOP} from './objects.js';
import {fractal} from './noise.js';
import {slab, solid, turned} from './shapes.js';
import {moulded, timber} from './textures.js';

/** Creates a scene with the room, its light and the objects. */
export function buildRoom(renderer, objects) {
  const scene = new THREE.Scene();
  const generator = new THREE.PMREMGenerator(renderer);
  scene.environment = generator.fromScene(new RoomEnvironment(), 0.03, 0.1, 100, {size: 64}).texture;
  scene.environmentIntensity = 0.55;
  scene.add(...walls(), ...windowParts(), ...lamps(), pictureFrame(), flowerPot());
  // Metal and glass mirror this room instead of a generic studio.
  const mirrored = generator.fromScene(scene, 0, 0.05, 20, {size: 128, position: new THREE.Vector3(0, 1.05, 0)});
  for (const {root} of objects) {
    root.traverse((node) => {
      if (node.material?.metalness === 1 || node.material?.transmission) {
        node.material.envMap = mirrored.texture;
      }
    });
    scene.add(root);
  }
  generator.dispose();
  return scene;
}

function walls() {
  const plaster = moulded({color: [0.78, 0.76, 0.7], grain: 0.05, roughness: 0.95});
  for (const map of Object.values(plaster)) map.repeat.set(6, 5);
  const wall = new THREE.MeshStandardMaterial({...plaster, bumpScale: 0.25});
  const boards = timber({light: [0.45, 0.3, 0.19], dark: [0.28, 0.17, 0.1], planks: 6, seed: 51});
  for (const map of Object.values(boards)) map.repeat.set(3, 3);
  const ground = new THREE.PlaneGeometry(8, 8).rotateX(-Math.PI / 2);
  const floor = solid(ground, new THREE.MeshStandardMaterial(boards));
  const panel = (width, height, x, y, z, turn) => {
    const mesh = solid(new THREE.PlaneGeometry(width, height), wall, [x, y, z]);
    mesh.rotation.y = turn;
    return mesh;
  };
  return [
    floor,
    panel(8, 0.95, 0, 0.475, -0.95, 0),
    panel(8, 0.8, 0, 2.5, -0.95, 0),
    panel(3.35, 1.15, -2.325, 1.525, -0.95, 0),
    panel(3.35, 1.15, 2.325, 1.525, -0.95, 0),
    panel(8, 3, -3, 1.5, 0, Math.PI / 2),
    panel(8, 3, 3, 1.5, 0, -Math.PI / 2),
    panel(8, 3, 0, 1.5, 3, Math.PI),
  ];
}

function windowParts() {
  const paint = new THREE.MeshStandardMaterial({color: 0xf1efe8, roughness: 0.45});
  const bar = (width, height, depth, x, y) => solid(slab(width, height, depth, 0.006), paint, [x, y, -0.95]);
  const view = new THREE.MeshBasicMaterial({map: garden(), toneMapped: false});
  const outside = new THREE.Mesh(new THREE.PlaneGeometry(4.4, 2.5), view);
  outside.position.set(0, 1.6, -2.4);
  const sky = new THREE.Mesh(
    new THREE.PlaneGeometry(1.25, 1.1),
    new THREE.MeshBasicMaterial({color: new THREE.Color(2.4, 2.7, 3.2)}),
  );
  sky.position.set(-1.2, 2.2, 2.9);
  sky.rotation.y = Math.PI;
  return [
    bar(1.5, 0.06, 0.09, 0, 0.93), bar(1.5, 0.06, 0.07, 0, 2.08), bar(0.06, 1.2, 0.07, -0.68, 0.93),
    bar(0.06, 1.2, 0.07, 0.68, 0.93), bar(0.045, 1.2, 0.05, 0, 0.93), bar(1.4, 0.04, 0.04, 0, 1.5),
    bar(1.7, 0.03, 0.2, 0, 0.92), outside, sky,
  ];
}

/** Draws sky, hills and hedges, slightly blurred as at a distance. */
function garden() {
  const canvas = new OffscreenCanvas(512, 320);
  const pen = canvas.getContext('2d');
  const sky = pen.createLinearGradient(0, 0, 0, 200);
  sky.addColorStop(0, '#a9cdec');
  sky.addColorStop(1, '#eef4f4');
  pen.fillStyle = sky;
  pen.fillRect(0, 0, 512, 320);
  pen.filter = 'blur(2px)';
  [[150, 46, '#9db6b4'], [185, 36, '#7d9d72'], [225, 60, '#5b8148'], [268, 50, '#44682f']].forEach(
    ([base, swing, color], layer) => {
      pen.fillStyle = color;
      for (let x = 0; x < 512; x += 4) {
        const top = base - swing * fractal(x / (90 - layer * 18), layer, 4, 61);
        pen.fillRect(x, top, 5, 320 - top);
      }
    },
  );
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  return map;
}

function lamps() {
  const sun = new THREE.DirectionalLight(0xfff0dc, 2.3);
  sun.position.set(-1.3, 2.9, 1.1);
  sun.target.position.set(0.05, TABLE_TOP, -0.3);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.radius = 5;
  sun.shadow.bias = -0.0004;
  sun.shadow.normalBias = 0.004;
  Object.assign(sun.shadow.camera, {left: -1.4, right: 1.4, top: 1.2, bottom: -1, near: 0.5, far: 5});
  const window = new THREE.DirectionalLight(0xd6e6ff, 0.9);
  window.position.set(0.3, 1.9, -2);
  window.target = sun.target;
  return [sun, sun.target, window];
}

function pictureFrame() {
  const canvas = new OffscreenCanvas(128, 128);
  const pen = canvas.getContext('2d');
  ['#d8cbb3', '#c0563b', '#274b5a', '#e3a84a'].forEach((color, i) => {
    pen.fillStyle = color;
    pen.beginPath();
    pen.arc(64 + (i ? 22 * Math.cos(i * 2.1) : 0), 64 + (i ? 20 * Math.sin(i * 2.1) : 0), i ? 30 : 128, 0, 7);
    pen.fill();
  });
  const art = new THREE.CanvasTexture(canvas);
  art.colorSpace = THREE.SRGBColorSpace;
  const frame = new THREE.MeshStandardMaterial({color: 0x2b2622, roughness: 0.5});
  const print = new THREE.MeshStandardMaterial({map: art, roughness: 0.9});
  const mesh = solid(new THREE.BoxGeometry(0.46, 0.46, 0.03), [frame, frame, frame, frame, print, frame]);
  mesh.position.set(-1.25, 1.45, -0.93);
  return mesh;
}

function flowerPot() {
  const terracotta = new THREE.MeshStandardMaterial({color: 0xa9573a, roughness: 0.85});
  const outline = [[0.0, 0.0], [0.05, 0.0], [0.066, 0.09], [0.072, 0.092], [0.073, 0.108], [0.06, 0.108],
    [0.0, 0.1]];
  return solid(turned(outline, {sharp: true}), terracotta, [PLANT.x, TABLE_TOP, PLANT.z]);
}
