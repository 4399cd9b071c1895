/**
 * The objects on the table: their appearance and their true material.
 *
 * Their descriptions for the service are in scene.json, in the same order. `truth` is only for the panel and for grading.
 * The hammer and the sewing box consist of several objects, one per material. The case is one mesh of two materials:
 * `truths` has that of each surface, the largest first.
 */
import * as THREE from 'three';
import * as shapes from './room/shapes.js';
import * as textures from './room/textures.js';
import * as surfaces from './surfaces.js';

export const TABLE_TOP = 0.74; // m

const {group, solid} = shapes;

/** Creates all touchable objects: {key, truth, truths?, root}. Computing their textures takes seconds. */
export function buildObjects() {
  const looks = cover();
  return [
    {key: 'table', truth: 'wood', root: table(looks)},
    {key: 'bowl', truth: 'wood', root: at(-0.42, 0.02, bowl(looks))},
    {key: 'vase', truth: 'glass', root: at(-0.44, -0.36, vase())},
    {key: 'bottle', truth: 'glass', root: at(0.2, -0.4, bottle())},
    {key: 'linen', truth: 'fabric', root: at(0.46, -0.02, folded(looks), -0.2)},
    {key: 'kettle', truth: 'metal', root: at(-0.12, -0.36, kettle(looks), 0.5)},
    {key: 'pan', truth: 'metal', root: at(0.47, -0.38, pan(looks))},
    {key: 'hammer head', truth: 'metal', root: hammer(hammerHead(looks))},
    {key: 'hammer handle', truth: 'wood', root: hammer(hammerHandle(looks))},
    {key: 'sewing box', truth: 'wood', root: box(sewingBox(looks))},
    {key: 'pin cushion', truth: 'fabric', root: box(pinCushion(looks))},
    {key: 'case', truth: 'wood', truths: ['wood', 'fabric'], root: at(0.46, 0.19, linedCase(looks), -0.15)},
  ];
}

const hammer = (root) => at(-0.02, 0.06, root, 0.5);
const box = (root) => at(0.2, -0.1, root, 0.2);

function cover() {
  return {
    oak: surfaces.timber({light: [0.78, 0.62, 0.43], dark: [0.52, 0.36, 0.21], rings: 26, planks: 5}),
    walnut: surfaces.timber({light: [0.5, 0.33, 0.2], dark: [0.2, 0.11, 0.06], rings: 12, seed: 7}),
    ash: surfaces.timber({light: [0.86, 0.72, 0.52], dark: [0.55, 0.38, 0.22], rings: 7, seed: 9}),
    pine: surfaces.timber({light: [0.87, 0.68, 0.43], dark: [0.62, 0.36, 0.16], rings: 9, pores: 0.1, seed: 5}),
    linen: surfaces.woven({ground: [0.85, 0.82, 0.74], stripe: [0.24, 0.36, 0.56], threads: 56, check: 7}),
    felt: surfaces.woven({ground: [0.72, 0.16, 0.14], stripe: [0.5, 0.1, 0.12], threads: 30, check: 5, fuzz: 0.6}),
    steel: textures.brushed({color: [0.8, 0.81, 0.83]}),
    forged: surfaces.ground({color: [0.86, 0.86, 0.88], grain: 0.2, gloss: 0.05}),
    copper: textures.hammered({color: [0.97, 0.68, 0.56]}),
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

/** Aligns the grain with x for any shape, as in sawn wood; `length` and `width` of the texture in m. */
function sawn(geometry, length, width) {
  const {position, uv} = geometry.attributes;
  for (let i = 0; i < uv.count; i++) {
    const across = position.getZ(i) + 0.6 * position.getY(i);
    uv.setXY(i, 0.5 + position.getX(i) / length, 0.5 + across / width);
  }
  return geometry;
}

function clearGlass(tint) {
  return new THREE.MeshPhysicalMaterial({
    roughness: 0.03, transmission: 1, ior: 1.5, thickness: 0.006, attenuationDistance: 0.12,
    attenuationColor: new THREE.Color(tint), envMapIntensity: 1.5, side: THREE.DoubleSide,
  });
}

/** Switches between refracting glass, which draws the scene again for each eye, and thin glass that only mirrors. */
export function makeGlass(objects, {refracts}) {
  for (const {root} of objects) {
    root.traverse(({material}) => {
      if (!material?.isMeshPhysicalMaterial) return;
      material.transmission = refracts ? 1 : 0;
      material.color.set(refracts ? 0xffffff : 0x000000);
      material.blending = refracts ? THREE.NormalBlending : THREE.AdditiveBlending; // adds mirrored light to the background
      material.transparent = !refracts;
      material.depthWrite = refracts;
      material.needsUpdate = true;
    });
  }
}

function table({oak}) {
  const top = solid(shapes.slab(1.5, 0.045, 0.86, 0.008), matte(oak, {repeat: [1.6, 1], bump: 1.4}));
  top.position.set(0, TABLE_TOP - 0.045, -0.16);
  const legs = [[-0.68, -0.52], [0.68, -0.52], [-0.68, 0.2], [0.68, 0.2]].map(([x, z]) =>
    solid(shapes.slab(0.07, TABLE_TOP - 0.045, 0.07), matte(oak, {repeat: [0.3, 0.3]}), [x, 0, z]),
  );
  return group(top, ...legs);
}

function bowl({walnut}) {
  const outline = [[0, 0.006], [0.05, 0], [0.056, 0.008], [0.1, 0.04], [0.118, 0.08], [0.113, 0.083],
    [0.09, 0.045], [0.05, 0.018], [0, 0.014]];
  return group(solid(sawn(shapes.turned(outline), 0.3, 0.34), matte(walnut, {side: THREE.DoubleSide})));
}

function vase() {
  const outline = [[0, 0], [0.045, 0], [0.066, 0.03], [0.074, 0.085], [0.058, 0.15], [0.042, 0.195],
    [0.046, 0.225], [0.06, 0.245]];
  return group(solid(shapes.turned(outline), clearGlass(0xa8e6d4)));
}

function bottle() {
  const outline = [[0, 0], [0.036, 0], [0.041, 0.01], [0.041, 0.15], [0.03, 0.19], [0.015, 0.22],
    [0.014, 0.27], [0.017, 0.285]];
  return group(solid(shapes.turned(outline), clearGlass(0x7fb069)));
}

function folded({linen}) {
  const soft = matte(linen, {repeat: [1, 0.8], bump: 3});
  return group(
    solid(shapes.fold(0.235, 0.03, 0.19, 3), soft, [0.002, 0.048, 0.003]),
    solid(shapes.fold(0.24, 0.03, 0.195, 5), soft, [-0.003, 0.024, 0]),
    solid(shapes.fold(0.25, 0.03, 0.2, 9), soft),
  );
}

function kettle({steel}) {
  const metal = matte(steel, {repeat: [1, 2], bump: 0.35, metalness: 1, envMapIntensity: 1.2});
  const spout = [[0.08, 0.06, 0], [0.125, 0.085, 0], [0.142, 0.13, 0], [0.17, 0.152, 0]];
  const handle = [[-0.07, 0.14, 0], [-0.075, 0.21, 0], [0, 0.245, 0], [0.075, 0.21, 0], [0.07, 0.14, 0]];
  const outline = [[0, 0], [0.096, 0], [0.106, 0.012], [0.105, 0.05], [0.092, 0.11], [0.066, 0.15],
    [0.05, 0.158], [0, 0.172]];
  return group(
    solid(shapes.turned(outline), metal),
    solid(shapes.tube(spout, 0.014), metal),
    solid(shapes.tube(handle, 0.008), metal),
  );
}

function pan({copper}) {
  const outline = [[0, 0.004], [0.045, 0], [0.05, 0.006], [0.092, 0.04], [0.112, 0.085], [0.118, 0.098],
    [0.113, 0.098], [0.086, 0.046], [0.04, 0.014], [0, 0.012]];
  const metal = matte(copper, {bump: 1.1, metalness: 1, envMapIntensity: 1.3, side: THREE.DoubleSide});
  return group(solid(shapes.turned(outline), metal));
}

function hammerHead({forged}) {
  const metal = matte(forged, {repeat: [0.5, 0.5], bump: 0.1, metalness: 1, envMapIntensity: 1.3});
  return group(
    solid(shapes.slab(0.04, 0.036, 0.11, 0.012), metal, [-0.13, 0, 0]),
    solid(new THREE.CylinderGeometry(0.022, 0.022, 0.014, 40).rotateX(Math.PI / 2), metal, [-0.13, 0.022, 0.06]),
  );
}

function hammerHandle({ash}) {
  const stick = new THREE.CapsuleGeometry(0.013, 0.24, 8, 24).rotateZ(Math.PI / 2);
  return group(solid(sawn(stick, 0.32, 0.08), matte(ash), [0.03, 0.018, 0]));
}

function sewingBox({pine}) {
  return group(solid(shapes.slab(0.16, 0.07, 0.12, 0.005), matte(pine, {repeat: [0.8, 0.5]})));
}

function pinCushion({felt}) {
  const red = matte(felt, {repeat: [1, 0.75], bump: 3});
  return group(solid(shapes.fold(0.145, 0.03, 0.105, 11), red, [0, 0.07, 0]));
}

/** A case as one mesh with groups, as engines export it: walnut, and a lid of cloth that only its texture map tells. */
function linedCase({walnut, linen}) {
  const wood = matte(walnut, {repeat: [0.6, 0.3], name: 'Walnut'});
  const cloth = matte(linen, {repeat: [0.7, 0.5], bump: 3, name: 'mat_7'});
  const lid = 2; // the group of the side that faces up
  return group(solid(new THREE.BoxGeometry(0.17, 0.04, 0.12), Array.from({length: 6}, (_, side) => (side === lid ? cloth : wood)), [0, 0.02, 0]));
}
