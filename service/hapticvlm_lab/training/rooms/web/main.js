/** After `rooms.open`: `rooms.make(seed, views)`, crops of things; after `rooms.take`, `rooms.place`. */
import * as THREE from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {HDRLoader} from 'three/addons/loaders/HDRLoader.js';
import {RoomEnvironment} from 'three/addons/environments/RoomEnvironment.js';
import {Camera, development} from './camera.js';
import {Dice} from './dice.js';
import {Room} from './room.js';
import {Maps, loadTiles} from './textures.js';

const ROOMS_A_SET = 50; // that share painted maps

const renderer = new THREE.WebGLRenderer();
Object.assign(renderer.shadowMap, {enabled: true, autoUpdate: false});
const camera = new Camera(renderer, 224);
const prefilter = new THREE.PMREMGenerator(renderer);
const studio = prefilter.fromScene(new RoomEnvironment(), 0.04).texture, skies = [studio, studio, studio];
const ALSO = 0.6; // chance of a prop beside the subject
let tiles, maps, set, props = [];

/** Load {folder: [file of the data folder]}, skies under hdri. */
async function open({hdri, ...folders}) {
  tiles = await loadTiles(folders);
  for (const file of hdri) {
    const sky = await new HDRLoader().loadAsync(`/data/${file}`);
    skies.push(prefilter.fromEquirectangular(sky).texture);
  }
}

/** A lens that sees a thing from somewhere, more or less close, seldom straight. */
function aim(d, {box}) {
  const centre = box.getCenter(new THREE.Vector3()), radius = box.getSize(new THREE.Vector3()).length() / 2;
  const lens = new THREE.PerspectiveCamera(d.uniform(38, 85), 1, 0.02, 40), share = d.spread(0.22, 1.05);
  const half = Math.tan((lens.fov * Math.PI) / 360), far = radius / half / share;
  const up = d.uniform(-0.05, 1) * d.uniform(0.2, 1.15), turn = d.uniform(0, 6.28);
  lens.position.setFromSphericalCoords(far, Math.PI / 2 - up, turn).add(centre);
  lens.position.y = Math.max(lens.position.y, 0.06);
  lens.up.set(d.uniform(-0.12, 0.12), 1, 0);
  const off = () => d.uniform(-0.5, 0.5) * Math.max(0, 1 - share) * far * half;
  lens.lookAt(centre.add(new THREE.Vector3(off(), off(), off())));
  return lens;
}

const seldom = ({table}) => (thing) => (thing === table ? 0.15 : 0.4);

/** Crops of things at the size that a frame of some px would give them: always of the subject, and of others with the
 *  chance that `also` gives them. */
function* pictures(d, room, subject = d.pick(room.things), also = seldom(room)) {
  const {things} = room, lens = aim(d, subject), look = development(d), px = d.spread(220, 1100);
  for (const [id, region] of camera.find(room, lens)) {
    const size = [region.w, region.h].map((share) => Math.round(Math.min(camera.side, share * px)));
    const thing = things[id - 1], {label} = thing;
    const isWanted = thing === subject || d.chance(also(thing));
    if (isWanted && Math.min(...size) >= 24) yield {
      size, id, label, pixels: camera.shoot(room, lens, region, size, look).toBase64()};
  }
}

/** Take the props [{file, label}] of a kit, in place of those of another. */
async function take(files) {
  const loader = new GLTFLoader();
  for (const {object} of props) object.traverse((mesh) => mesh.geometry?.dispose());
  props = await Promise.all(files.map(async ({file, label}) => (
    {label, object: (await loader.loadAsync(`/data/${file}`)).scene})));
}

/** Crops of the props `shown` (places), each the subject once, in a room of a game with those `beside`. */
function place(seed, shown, beside) {
  paint(seed);
  const d = new Dice(seed * 2654435761), chosen = [...shown, ...beside].map((at) => props[at]);
  const room = new Room(d.fork(), maps, skies, chosen), subjects = room.things.slice(0, shown.length);
  const also = (thing) => (subjects.includes(thing) ? ALSO : 0);
  renderer.shadowMap.needsUpdate = true;
  const all = subjects.map((subject) => [...pictures(d.fork(), room, subject, also)]).flat();
  finish(room);
  return all;
}

function make(seed, views) {
  paint(seed);
  const d = new Dice(seed * 2654435761), room = new Room(d.fork(), maps, skies);
  renderer.shadowMap.needsUpdate = true;
  const all = Array.from({length: views}, () => [...pictures(d.fork(), room)]).flat();
  finish(room);
  return all;
}

/** Paint the maps of a set of rooms. */
function paint(seed) {
  if (set !== (set = Math.floor(seed / ROOMS_A_SET))) {
    maps?.dispose();
    maps = new Maps(tiles, new Dice(set * 7919 + 1));
  }
}

/** Dispose of a room, and of no program: the next room needs it. */
function finish(room) {
  for (const program of renderer.info.programs) program.usedTimes = Infinity;
  room.dispose();
}

window.rooms = {open, make, take, place};
