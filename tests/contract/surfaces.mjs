/**
 * What the web client sends of an object of several materials to a service of each minor version of the protocol, and
 * which surfaces it finds in meshes of three.js; as one JSON object.
 */
import {decode, encode} from '../../examples/webxr/node_modules/@msgpack/msgpack/dist.esm/index.mjs';
import * as THREE from '../../examples/webxr/node_modules/three/build/three.module.js';
const {Haptics, surfaceAt, surfacesOf} = await import('../../examples/webxr/client/index.js');

/** Connects to a service of this minor version, states a room and touches its third surface; what was sent. */
async function sent(minor, room) {
  const messages = [];
  class Service {
    constructor() {
      setTimeout(() => this.onopen());
    }

    send(data) {
      const message = decode(data);
      messages.push(message);
      const welcome = {type: 'welcome', id: message.id, protocol: {major: 1, minor}, owner: true, materials: ['wood']};
      if (message.type === 'hello') setTimeout(() => this.onmessage({data: encode(welcome)}));
    }

    close() {}
  }
  const haptics = new Haptics('ws://service/', {WebSocket: Service});
  haptics.scene([room]);
  await new Promise((resolve) => haptics.addEventListener('welcome', resolve));
  haptics.touch({phase: 'contact', hand: 'left', object_id: 'room', surface: 2, speed_mps: 1, force_n: 1});
  haptics.frame({format: 'jpeg', width: 1, height: 1, origin: 'top', image: new Uint8Array(1), object_id: 'room', surface: 2});
  haptics.close();
  const last = (type) => messages.findLast((message) => message.type === type);
  return {objects: last('scene').objects, touch: last('touch').surface ?? null, frame: last('frame').surface ?? null};
}

const material = (name, fields = {}) => Object.assign(new THREE.MeshStandardMaterial(fields), {name});
const plane = (side, own) => new THREE.Mesh(new THREE.PlaneGeometry(side, side), own);
const down = new THREE.Raycaster(new THREE.Vector3(0, 0, 9), new THREE.Vector3(0, 0, -1));

/** Two small oak planes are together larger than one of glass, and a scaled one of steel is the largest. */
function shared() {
  const oak = material('Oak');
  const steel = plane(1, material('Steel', {metalness: 1, roughness: 0.25}));
  steel.scale.setScalar(4);
  const root = new THREE.Group().add(plane(2, oak), plane(2, oak), plane(2.5, material('Glass')), steel);
  steel.position.z = 1;
  const names = surfacesOf(root).map(({name}) => name);
  root.updateMatrixWorld(true);
  const [hit] = down.intersectObject(root, true);
  return {names, hit: surfaceAt(root, hit), shader: surfacesOf(root)[0].shader};
}

/** A map gives what its factor does not, so the factor is not sent; the file of the map is named. */
function mapped() {
  const map = Object.assign(new THREE.Texture(), {name: 'textures/T_Planks_D.png'});
  return surfacesOf(plane(1, material('mat3', {map, metalnessMap: map, roughnessMap: map, metalness: 1})))[0];
}

function many(count) {
  const planes = Array.from({length: count}, (_, i) => plane(1 + i, material(`m${i}`)));
  const root = new THREE.Group().add(...planes);
  const told = [];
  console.warn = (text) => told.push(text);
  const surfaces = surfacesOf(root);
  const at = (i) => surfaceAt(root, {object: planes[i], face: {materialIndex: 0}});
  return {length: surfaces.length, told, largest: at(count - 1), smallest: at(0)};
}

const opacityOf = (fields) => surfacesOf(plane(1, material('m', {opacity: 0.25, ...fields})))[0].shader.opacity ?? null;

const room = {object_id: 'room', surfaces: [{name: 'Oak', shader: {metallic: 0, opacity: 0.4}}, {name: 'Glass'}, {name: 'Steel'}]};
console.log(JSON.stringify({
  1: await sent(1, room),
  2: await sent(2, room),
  shared: shared(),
  opacity: {blended: opacityOf({transparent: true}), masked: opacityOf({alphaTest: 0.5})},
  mapped: mapped(),
  many: many(70),
}));
process.exit(0);
