/** A room from a dice: things of known materials, floor, walls and light. */
import * as THREE from 'three';
import {Body} from './body.js';
import {material} from './materials.js';
import {shape} from './shapes.js';

const FOUR = ['wood', 'glass', 'fabric', 'metal'];
const CLASSES = [...FOUR, ...FOUR, ...FOUR, 'glass', 'plastic', 'plastic', 'stone', 'stone', 'ceramic', 'ceramic',
  'paper', 'paper', 'leather', 'rubber', 'foliage', 'turf', 'unknown'];
const TABLES = ['wood', 'wood', 'wood', 'glass', 'metal', 'plastic', 'stone'];
const LABELS = {turf: 'foliage'}; // looks that are no class of the material table
const SMALL = 0.55; // m, that fits on a table
const REACH = [0.15, 1.1]; // m, longest side of a prop

/** Brightness of surroundings, ambient light, sun and lamp, [from, to] each: sunny, an engine's, soft, a lamp. */
const LIGHTS = [[[0.6, 1.3], [0, 0.4], [0, 3], [0, 2]], [[0.25, 0.7], [0.5, 2], [1, 3.5], [0, 1]],
  [[0.9, 1.5], [0, 0.4], [0, 0.5], [0, 1]], [[0.1, 0.4], [0, 0.3], [0, 0.4], [4, 14]]];
const PLAIN = 0.6; // share of rooms of a game

/** scene; meshes, userData.id = number of their thing; things [{id, label, group, box}]; table. */
export class Room {
  scene = new THREE.Scene();
  meshes = [];
  things = [];
  #dice;
  #maps;
  #isPlain; // its ground and walls have one colour each

  /** `props`: objects to put into a room of a game in place of bodies, [{label, object}]. */
  constructor(dice, maps, skies, props = null) {
    this.#dice = dice;
    this.#maps = maps;
    this.#isPlain = props !== null && dice.chance(PLAIN);
    this.#light(skies);
    this.#shell();
    this.#furnish(props?.map((prop) => this.#prop(prop)));
  }

  #light(skies) {
    const {scene} = this, d = this.#dice;
    const [around, ambient, sunny, lit] = d.pick(LIGHTS).map((range) => d.uniform(...range));
    const tint = (hue, most) => new THREE.Color().setHSL(hue, d.uniform(0, most), 0.8);
    scene.environment = d.pick(skies);
    scene.environmentIntensity = around;
    scene.environmentRotation.y = scene.backgroundRotation.y = d.uniform(0, 6.28);
    const plain = new THREE.Color().setHSL(d.next(), d.uniform(0, 0.5), d.uniform(0.05, 0.9));
    scene.background = d.chance(0.75) ? scene.environment : plain;
    scene.backgroundBlurriness = d.chance(0.5) ? d.uniform(0, 0.5) : 0;
    const sun = new THREE.DirectionalLight(tint(d.pick([0.1, 0.6]), 0.5), sunny);
    const lamp = new THREE.PointLight(tint(0.1, 0.8), lit), {shadow} = sun;
    sun.position.set(d.uniform(-4, 4), d.uniform(2.5, 6), d.uniform(-3, 4));
    lamp.position.set(d.uniform(-1.5, 1.5), d.uniform(1.2, 2.4), d.uniform(-1.5, 1.5));
    sun.castShadow = true;
    Object.assign(shadow, {bias: -0.002, normalBias: 0.02, radius: d.uniform(1, 5)});
    Object.assign(shadow.camera, {left: -3, right: 3, top: 3, bottom: -3, near: 0.5, far: 14});
    scene.add(new THREE.HemisphereLight(tint(0.6, 0.5), tint(0.1, 0.5), ambient), sun, lamp);
  }

  #mesh(geometry, look, parent = this.scene) {
    const mesh = new THREE.Mesh(geometry, look), isClear = look.transparent || look.transmission > 0;
    const castShadow = !isClear && parent !== this.scene;
    Object.assign(mesh, {castShadow, receiveShadow: true, renderOrder: isClear ? 1 : 0});
    this.meshes.push(mesh);
    parent.add(mesh);
    return mesh;
  }

  #look(name) {
    const d = this.#dice, color = new THREE.Color();
    if (!this.#isPlain) return material(name, d, this.#maps);
    return new THREE.MeshStandardMaterial({roughness: d.uniform(0.5, 1),
      color: color.setHSL(d.next(), d.uniform(0, 0.7), d.uniform(0.1, 0.85))});
  }

  /** Floor and, indoors, walls with panels that stand for pictures, windows or doors. */
  #shell() {
    const d = this.#dice, look = (name) => this.#look(name);
    const w = d.uniform(4, 9), h = d.uniform(2.3, 3.2), plane = () => new THREE.PlaneGeometry(w, w);
    this.#mesh(plane(), look('ground')).rotation.x = -Math.PI / 2;
    if (!d.chance(0.7)) return; // outdoors
    const ceiling = this.#mesh(plane(), new THREE.MeshLambertMaterial({color: 0xd8d4cc, emissive: 0x333333}));
    ceiling.rotation.x = Math.PI / 2;
    ceiling.position.y = h;
    const paint = look('wall'), other = look('wall');
    for (let i = 0; i < 4; i++) {
      const wall = this.#mesh(new THREE.PlaneGeometry(w, h), i && d.chance(0.8) ? paint : other);
      const turn = (i * Math.PI) / 2;
      wall.position.set((-w / 2) * Math.sin(turn), h / 2, (-w / 2) * Math.cos(turn));
      wall.rotation.y = turn;
      const panel = new THREE.BoxGeometry(d.uniform(0.4, 1.6), d.uniform(0.4, 1.6), 0.05);
      if (d.chance(0.5)) this.#mesh(panel, look(d.pick(['wood', 'unknown'])), wall).position.x = d.uniform(-1, 1);
    }
  }

  /** A thing: all of its parts carry its number; its label is that of its main part. */
  #thing(name, body) {
    const d = this.#dice, group = new THREE.Group(), id = this.things.length + 1;
    for (const {role, geometry} of body.parts()) {
      const dress = {main: name, accent: d.pick(['wood', 'metal', 'plastic'])}[role] ?? role;
      this.#mesh(geometry, material(dress, d, this.#maps), group).userData.id = id;
    }
    return this.#add(LABELS[name] ?? name, group);
  }

  #add(label, group) {
    this.scene.add(group);
    group.rotation.y = this.#dice.uniform(0, 6.28);
    const box = new THREE.Box3().setFromObject(group), thing = {id: this.things.length + 1, label, group, box};
    this.things.push(thing);
    return thing;
  }

  /** A thing that has a look of its own, at a size that a thing in reach has: kits differ in their units. */
  #prop({label, object}) {
    const group = new THREE.Group().add(object), id = this.things.length + 1;
    const size = new THREE.Box3().setFromObject(object).getSize(new THREE.Vector3());
    object.scale.multiplyScalar(this.#dice.spread(...REACH) / Math.max(...size.toArray()));
    object.traverse((mesh) => {
      if (!mesh.isMesh) return;
      Object.assign(mesh, {castShadow: !mesh.material.transparent, receiveShadow: true});
      Object.assign(mesh.userData, {id, isProp: true});
      this.meshes.push(mesh);
    });
    return this.#add(label, group);
  }

  #bodies() {
    const d = this.#dice;
    return Array.from({length: d.integer(6, 12)}, () => d.pick(CLASSES))
      .map((name) => this.#thing(name, shape(name, d)));
  }

  /** Things on the floor; often a table, and what is small on it. */
  #furnish(things = this.#bodies()) {
    const d = this.#dice, size = ({box}) => Math.max(...box.getSize(new THREE.Vector3()).toArray());
    if (d.chance(0.45)) return this.#lay(things, 0, []);
    const h = d.uniform(0.4, 0.95), w = d.uniform(1.4, 2.2), z = w * d.uniform(0.6, 1);
    const body = new Body().box([w, 0.05, z], [0, h - 0.025, 0]).legs(0.9 * w, 0.9 * z, h - 0.05, 0.04);
    this.table = this.#thing(d.pick(TABLES), body.projected(3));
    this.#lay(things.filter((thing) => size(thing) < SMALL), h, []);
    this.#lay(things.filter((thing) => size(thing) >= SMALL), 0, [this.table.box]);
  }

  /** Put things on a plane at height y, as near to its middle as what is there allows. */
  #lay(things, y, taken) {
    const d = this.#dice;
    for (const {group, box} of things) {
      group.position.y = y - box.min.y;
      for (let reach = 0.02; ; reach += 0.02) {
        Object.assign(group.position, {x: d.uniform(-reach, reach), z: d.uniform(-reach, reach)});
        box.setFromObject(group);
        if (!taken.some((other) => other.intersectsBox(box))) break;
      }
      taken.push(box);
    }
  }

  /** Props are kept, since another room shows them too. */
  dispose() {
    const own = this.meshes.filter((mesh) => !mesh.userData.isProp);
    for (const {geometry, material: {map, bumpMap}} of own) {
      [geometry, map, bumpMap].forEach((part) => part?.dispose());
    }
    new Set(own.map((mesh) => mesh.material)).forEach((look) => look.dispose());
    this.scene.traverse((object) => object.shadow?.dispose());
  }
}
