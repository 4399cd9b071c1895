/**
 * The objects of the scene: their description for the service, their true material, and their shape.
 *
 * Ids deliberately carry no meaning. `states` is the description sent to HapticVLM; `truth` is for grading.
 */
import * as THREE from 'three';
import * as shapes from './shapes.js';
import * as textures from './textures.js';

export const TABLE_TOP = 0.74;
/** Position and height of the plant's pot. */
export const PLANT = {x: -1.04, z: -0.36, height: 0.1};

const {group, solid} = shapes;

/** Creates and places all touchable objects: {object_id, name, truth, states, root}. */
export function buildObjects() {
  return [
    {name: 'Oak_Table_02', truth: 'wood', root: table()},
    {name: 'Cube.003', truth: 'wood', root: at(0.0, -0.46, casket(), 0.25)},
    {name: 'GlassVase', truth: 'glass', root: at(-0.26, -0.42, vase())},
    {name: 'Object_07', truth: 'glass', states: {shader: true}, root: at(0.5, -0.44, decanter())},
    {name: 'Curtain.001', truth: 'fabric', root: curtain()},
    {name: 'Mesh_12', truth: 'fabric', states: {shader: true}, root: at(-0.5, -0.07, linen(), 0.15)},
    {name: 'M_BrushedSteel_Kettle', truth: 'metal', root: at(-0.53, -0.45, kettle(), 0.7)},
    {name: 'Object_19', truth: 'metal', states: {shader: true}, root: at(0.76, -0.07, bowl())},
    {name: 'Prop_Crate', truth: 'plastic', states: {material: 'plastic'}, root: at(-0.8, -0.45, crate(), 0.2)},
    {name: 'Mesh_31', truth: 'stone', root: at(0.25, -0.44, mortar(), -0.5)},
    {name: 'TeaMug_01', truth: 'ceramic', states: {temperature_c: 45}, root: at(-0.24, -0.06, mug(), -0.5)},
    {name: 'Newspaper_A3', truth: 'paper', states: {thickness_m: 0.004}, root: at(0.26, -0.06, newspaper(), -0.12)},
    {name: 'LeatherJournal', truth: 'leather', root: at(0.52, -0.06, journal(), -0.25)},
    {name: 'Torus.002', truth: 'rubber', root: at(-0.77, -0.06, tyre())},
    {name: 'Sphere.021', truth: 'unknown', root: at(0.8, -0.44, plasma())},
    {name: 'Plant_Monstera', truth: 'foliage', root: at(PLANT.x, PLANT.z, plant())},
  ].map((object, index) => ({
    object_id: `o${String(index + 1).padStart(2, '0')}`,
    states: {},
    ...object,
  }));
}

/** Returns the object's entry in a protocol `scene` message. */
export function sceneEntry({object_id, name, states, root}) {
  const {shader, ...stated} = states;
  return {object_id, name, ...stated, ...(shader && {shader: shaderOf(root)})};
}

/** Returns the shader parameters known without a picture: factors times the mean of the maps. */
function shaderOf(root) {
  let material = null;
  root.traverse((node) => (material ??= node.material));
  const tint = material.map?.userData.mean ?? [1, 1, 1];
  const round = (x) => Math.round(x * 1000) / 1000;
  return {
    metallic: material.metalness,
    roughness: round(material.roughness * (material.roughnessMap?.userData.mean ?? 1)),
    transmission: material.transmission ?? 0,
    base_color: material.color.toArray().map((part, i) => round(part * tint[i])),
  };
}

function at(x, z, root, turn = 0) {
  root.position.set(x, TABLE_TOP, z);
  root.rotation.y = turn;
  return root;
}

/** Creates a standard material with the maps of a surface, repeated over the mesh. */
function matte(surface, {repeat = [1, 1], bump = 1, ...rest} = {}) {
  const maps = {};
  for (const [slot, map] of Object.entries(surface)) {
    maps[slot] = map.clone();
    maps[slot].repeat.set(...repeat);
  }
  return new THREE.MeshStandardMaterial({...maps, roughness: 1, bumpScale: bump, ...rest});
}

function clearGlass(options) {
  return new THREE.MeshPhysicalMaterial({
    roughness: 0.03, transmission: 1, ior: 1.5, thickness: 0.006, attenuationDistance: 0.12,
    specularIntensity: 1, envMapIntensity: 1.5, side: THREE.DoubleSide, ...options,
  });
}

function table() {
  const light = [0.76, 0.57, 0.36];
  const oak = textures.timber({light, dark: [0.5, 0.32, 0.17], planks: 5, rings: 16, seed: 1});
  const top = solid(shapes.slab(2.3, 0.045, 0.92, 0.008), matte(oak, {repeat: [2.2, 1], bump: 1.4}));
  top.position.set(0, TABLE_TOP - 0.045, -0.28);
  const legs = [[-1.05, -0.66], [1.05, -0.66], [-1.05, 0.1], [1.05, 0.1]].map(([x, z]) =>
    solid(shapes.slab(0.08, TABLE_TOP - 0.045, 0.08), matte(oak, {repeat: [0.3, 0.3]}), [x, 0, z]),
  );
  return group(top, ...legs);
}

function casket() {
  const cherry = {light: [0.62, 0.33, 0.17], dark: [0.33, 0.13, 0.06], planks: 1, rings: 7};
  const wood = matte(textures.timber({...cherry, seed: 21}), {repeat: [0.7, 0.7], bump: 1.2});
  const brass = new THREE.MeshStandardMaterial({color: 0xc9a24a, metalness: 1, roughness: 0.3});
  return group(
    solid(shapes.slab(0.21, 0.085, 0.15), wood),
    solid(shapes.slab(0.222, 0.042, 0.162, 0.009), wood, [0, 0.088, 0]),
    solid(shapes.slab(0.026, 0.034, 0.008, 0.003), brass, [0, 0.07, 0.08]),
  );
}

function vase() {
  const outline = [[0.0, 0.0], [0.045, 0.0], [0.066, 0.03], [0.074, 0.085], [0.058, 0.15], [0.042, 0.195],
    [0.046, 0.225], [0.06, 0.245]];
  const glass = clearGlass({color: 0xf2fffb, attenuationColor: new THREE.Color(0xa8e6d4)});
  return group(solid(shapes.turned(outline), glass));
}

function decanter() {
  const body = [[0.0, 0.0], [0.06, 0.0], [0.075, 0.02], [0.078, 0.07], [0.066, 0.12], [0.028, 0.155],
    [0.021, 0.175], [0.022, 0.2], [0.031, 0.21]];
  const glass = clearGlass({attenuationColor: new THREE.Color(0xa8c8e8)});
  return group(
    solid(shapes.turned(body), glass),
    solid(new THREE.IcosahedronGeometry(0.031, 1), glass, [0, 0.238, 0]),
  );
}

function curtain() {
  const cloth = textures.weave({warp: [0.5, 0.13, 0.14], weft: [0.62, 0.2, 0.18], threads: 60, seed: 31});
  const material = matte(cloth, {repeat: [3.2, 5], bump: 2, side: THREE.DoubleSide});
  const mesh = solid(shapes.drape(0.62, 1.75), material);
  mesh.position.set(0.84, 0.66, -0.78);
  return group(mesh);
}

function linen() {
  const blue = {warp: [0.42, 0.55, 0.68], weft: [0.86, 0.87, 0.84], threads: 56, stripe: [0.16, 0.25, 0.42]};
  const cream = {warp: [0.9, 0.85, 0.72], weft: [0.8, 0.72, 0.58], threads: 56, seed: 42};
  const soft = (cloth) => matte(textures.weave(cloth), {repeat: [1, 0.85], bump: 3});
  const [upper, lower] = [soft(blue), soft(cream)];
  return group(
    solid(shapes.fold(0.235, 0.03, 0.19, 3), upper, [0.002, 0.073, 0.003]),
    solid(shapes.fold(0.24, 0.03, 0.195, 5), upper, [-0.003, 0.048, 0]),
    solid(shapes.fold(0.245, 0.03, 0.2, 7), lower, [0.003, 0.024, -0.002]),
    solid(shapes.fold(0.25, 0.03, 0.2, 9), lower),
  );
}

function kettle() {
  const steel = textures.brushed({color: [0.8, 0.81, 0.83]});
  const metal = matte(steel, {repeat: [1, 2], bump: 0.35, metalness: 1, envMapIntensity: 1.2});
  const grip = new THREE.MeshStandardMaterial({color: 0x17181a, roughness: 0.5});
  const spout = [[0.08, 0.06, 0], [0.125, 0.085, 0], [0.142, 0.13, 0], [0.17, 0.152, 0]];
  const handle = [[-0.07, 0.14, 0], [-0.075, 0.21, 0], [0, 0.245, 0], [0.075, 0.21, 0], [0.07, 0.14, 0]];
  const outline = [[0.0, 0.0], [0.096, 0.0], [0.106, 0.012], [0.105, 0.05], [0.092, 0.11], [0.066, 0.15],
    [0.05, 0.158], [0.0, 0.172]];
  return group(
    solid(shapes.turned(outline), metal),
    solid(shapes.tube(spout, 0.014), metal),
    solid(shapes.tube(handle, 0.009), grip),
    solid(new THREE.SphereGeometry(0.015, 24, 16), grip, [0, 0.182, 0]),
  );
}

function bowl() {
  const copper = textures.hammered({color: [0.97, 0.68, 0.56]});
  const outline = [[0.0, 0.004], [0.045, 0.0], [0.05, 0.006], [0.092, 0.04], [0.112, 0.085], [0.118, 0.098],
    [0.113, 0.098], [0.086, 0.046], [0.04, 0.014], [0.0, 0.012]];
  const metal = matte(copper, {bump: 1.1, metalness: 1, envMapIntensity: 1.3, side: THREE.DoubleSide});
  return group(solid(shapes.turned(outline), metal));
}

function crate() {
  const yellow = textures.moulded({color: [0.95, 0.66, 0.06], roughness: 0.34});
  return shapes.crate(0.25, 0.15, 0.19, matte(yellow, {bump: 0.15}));
}

function mortar() {
  const stone = matte(textures.granite(), {repeat: [2, 1], bump: 1.2});
  const outline = [[0.0, 0.0], [0.066, 0.0], [0.07, 0.014], [0.062, 0.03], [0.086, 0.07], [0.1, 0.13],
    [0.094, 0.137], [0.08, 0.13], [0.06, 0.07], [0.0, 0.045]];
  const pestle = solid(new THREE.CapsuleGeometry(0.021, 0.15, 8, 24), stone, [0.035, 0.15, 0.01]);
  pestle.rotation.z = -0.55;
  return group(solid(shapes.turned(outline), stone), pestle);
}

function mug() {
  const glaze = matte(textures.glaze(), {bump: 0.2, envMapIntensity: 1.2});
  const tea = new THREE.MeshStandardMaterial({color: 0x5a2a0c, roughness: 0.08});
  const outline = [[0.0, 0.0], [0.04, 0.0], [0.047, 0.006], [0.05, 0.05], [0.052, 0.108], [0.05, 0.112],
    [0.047, 0.108], [0.045, 0.05], [0.0, 0.012]];
  const surface = solid(new THREE.CircleGeometry(0.046, 40).rotateX(-Math.PI / 2), tea, [0, 0.094, 0]);
  const handle = [[0.046, 0.09, 0], [0.078, 0.092, 0], [0.088, 0.062, 0], [0.075, 0.032, 0], [0.046, 0.026, 0]];
  const plain = matte(textures.moulded({color: [0.92, 0.9, 0.85], roughness: 0.12}), {bump: 0.05});
  return group(solid(shapes.turned(outline), glaze), solid(shapes.tube(handle, 0.0075), plain), surface);
}

function newspaper() {
  const front = new THREE.MeshStandardMaterial({map: textures.newsprint(), roughness: 0.9});
  const edge = new THREE.MeshStandardMaterial({color: 0xd8d2c2, roughness: 0.95});
  const sheet = new THREE.BoxGeometry(0.27, 0.012, 0.34).translate(0, 0.006, 0);
  const under = new THREE.BoxGeometry(0.272, 0.006, 0.335).translate(0.006, 0.003, 0.004);
  return group(solid(sheet, [edge, edge, front, edge, edge, edge], [0, 0.006, 0]), solid(under, edge));
}

function journal() {
  const tan = matte(textures.hide({color: [0.55, 0.29, 0.14]}), {bump: 2.4});
  const paper = new THREE.MeshStandardMaterial({color: 0xe9dfc6, roughness: 0.95});
  const strap = matte(textures.hide({color: [0.3, 0.14, 0.07], seed: 71}), {repeat: [0.1, 1], bump: 1});
  return group(
    solid(shapes.slab(0.19, 0.007, 0.25, 0.003), tan, [0, 0.034, 0]),
    solid(shapes.slab(0.19, 0.007, 0.25, 0.003), tan),
    solid(shapes.slab(0.18, 0.028, 0.238, 0.002), paper, [0.002, 0.007, 0]),
    solid(shapes.slab(0.01, 0.041, 0.25, 0.0045), tan, [-0.093, 0, 0]),
    solid(shapes.slab(0.014, 0.044, 0.254, 0.003), strap, [0.062, -0.001, 0]),
  );
}

function tyre() {
  const rubber = textures.moulded({color: [0.115, 0.115, 0.12], grain: 0.5, roughness: 0.78});
  const hub = new THREE.MeshStandardMaterial({color: 0xc8452c, roughness: 0.4});
  const disc = solid(new THREE.CylinderGeometry(0.06, 0.06, 0.03, 48), hub, [0, 0.032, 0]);
  const cap = solid(new THREE.CylinderGeometry(0.018, 0.022, 0.02, 32), hub, [0, 0.055, 0]);
  return group(solid(shapes.tyre(0.125, 0.058, 0.07), matte(rubber, {repeat: [6, 2], bump: 0.8})), disc, cap);
}

function plasma() {
  const {map} = textures.filaments();
  const glow = new THREE.MeshBasicMaterial({map, color: new THREE.Color(1.9, 1.5, 2.1)});
  const blob = solid(shapes.lump(0.085, 5), glow, [0, 0.02, 0]);
  blob.castShadow = false;
  const light = new THREE.PointLight(0xb050ff, 0.3, 0.8);
  light.position.y = 0.12;
  return group(blob, light);
}

/** Creates the leaves only; their pot is part of the room. */
function plant() {
  const green = matte(textures.leaf(), {bump: 1, side: THREE.DoubleSide});
  const root = group();
  for (let i = 0; i < 15; i++) {
    const length = 0.2 + 0.06 * ((i * 7) % 3);
    const blade = solid(shapes.leafBlade(length, 0.085, 0.5 + (0.85 * ((i * 5) % 15)) / 15), green);
    blade.position.y = PLANT.height;
    blade.rotation.y = i * 2.4;
    root.add(blade);
  }
  return root;
}
