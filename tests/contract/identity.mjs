/**
 * Finds things in a bake through the package. `node identity.mjs cases FILE` answers the queries of the shared cases;
 * `touch FILE ID...` touches ids and says which are silent, and why; `damaged FILE` spoils each value of a bake and tells what was not refused in words; `babylon FILE` finds copies as Babylon.js makes
 * them; `scene SCENE MATERIALS` loads a glTF scene with three.js: of each mesh and a copy, what it is and what is found.
 */
import {readFileSync} from 'node:fs';
import {Bake} from '../../examples/webxr/client/bake.js';
import {openFeel} from '../../examples/webxr/client/feel.js';
import {Felt} from '../../examples/webxr/client/felt.js';

const THREE = new URL('../../examples/webxr/node_modules/three/', import.meta.url).href;
const json = (path) => JSON.parse(readFileSync(path));

function cases(path) {
  const bake = new Bake(json(path));
  return json(path).queries.map(({ask}) => {
    const found = bake.find(ask);
    return found ? [found.object_id, found.surface, found.by] : bake.nearest(ask.object_id);
  });
}

function touch(path, ...ids) {
  const warnings = [];
  console.warn = (text) => warnings.push(text);
  const feel = openFeel(json(new URL('../../examples/webxr/client/feel.true.json', import.meta.url)));
  const felt = new Felt(null, feel, {materials: json(path), mode: 'baked'});
  const press = (id) => {
    for (const phase of ['contact', 'slide']) felt.touch({phase, hand: 'right', object_id: id, speed_mps: 0.3, force_n: 1.5});
    return felt.silence;
  };
  const silences = Object.fromEntries(ids.map((id) => [id, press(id)]));
  felt.close();
  return {silences, warnings};
}

function damaged(path) {
  const broken = [];
  const spoil = (file, part) => Object.keys(part).forEach((key) => {
    const right = part[key];
    for (const wrong of [undefined, null, NaN, 1e308, '', [], {}, [null], ['x', 1]]) {
      part[key] = wrong;
      try {
        new Bake(file).find({paths: ['floor.007'], material: 'Glaze', primitive: 0});
      } catch ({message}) {
        if (!/: .*bake it again$/.test(message)) broken.push([key, wrong, message]);
      }
    }
    part[key] = right;
    if (right !== null && typeof right === 'object') spoil(file, right);
  });
  const file = {...json(path), queries: null};
  spoil(file, file);
  return broken;
}

function babylon(path) {
  const bake = new Bake(json(path));
  const part = {name: 'Twins_primitive1', parent: {name: 'Twins', parent: {name: '__root__'}}, material: {name: 'Paint'}};
  const clone = {...part, name: 'left', parent: {name: 'Shelf'}, source: part};
  const ring = {...part, get source() { return this; }};
  return {
    'a copy of itself': bake.bakedOf(ring),
    'a clone of any name': bake.bakedOf(clone),
    'an instance of that clone': bake.bakedOf({name: 'i7', sourceMesh: clone}),
    'a spawned model': bake.bakedOf({name: 'Clone of Twins_primitive1', parent: {name: 'Clone of Twins'}}),
  };
}

async function scene(path, materials) {
  globalThis.self = globalThis;
  const {GLTFLoader} = await import(`${THREE}examples/jsm/loaders/GLTFLoader.js`);
  const {scene: root, parser} = await new GLTFLoader().parseAsync(readFileSync(path, 'utf8'), '');
  const file = json(materials);
  const bake = new Bake(file);
  const meshes = [];
  const found = (object) => {
    const part = bake.bakedOf(object, {face: {materialIndex: 0}});
    const {node: index, surfaces} = file.objects[part?.object_id] ?? {};
    return [index, surfaces?.[part.surface].primitives];
  };
  root.traverse((mesh) => {
    if (!mesh.isMesh) return;
    let node = mesh;
    while (parser.associations.get(node)?.nodes === undefined) node = node.parent;
    const is = [parser.associations.get(node).nodes, parser.associations.get(mesh).primitives ?? 0];
    meshes.push({name: mesh.name, is, found: found(mesh), copy: found(mesh.clone()), mesh});
  });
  Bake.learn(root);
  for (const each of meshes) each.made = found(Object.assign(each.mesh.clone(), {name: '', userData: {}}));
  return meshes.map(({mesh, ...told}) => told);
}

const [what, ...rest] = process.argv.slice(2);
console.log(JSON.stringify(await {cases, touch, damaged, babylon, scene}[what](...rest)));
