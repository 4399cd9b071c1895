/**
 * Finds an object of a page in a bake (`materials.json`), and tells how its surfaces feel.
 *
 * A thing is found by its id, else by the path of its names, else by its material's name. The bake has the paths as
 * glTF, three.js, Babylon.js and Godot spell them; an index decides only between surfaces of which nothing else is known.
 */
import {checkFile} from './feel.js';
import {isObject, textOf} from './fitting.js';
import SCHEMA from './materials.schema.js';

const AS_THE_SCENE = 'scene'; // the spelling of engines that keep names
const originals = new WeakMap(); // geometry -> object of the loaded model that has it
const DEEPEST = 32; // copies of copies
const HIGHEST = 1000; // parents

export class Bake {
  #objects; // [id, surfaces]
  #named = new Map(); // by an object's own name: {names of its path, id, isOf(engine)}
  #ofMaterial = new Map(); // by a material's name: {object_id, surface}
  #parts = new WeakMap(); // object of the page -> material -> answer

  /** `file` is the parsed contents of `materials.json`. Throws an Error that names the first field that is wrong. */
  constructor(file) {
    checkFile(file, SCHEMA);
    this.#objects = new Map(Object.entries(file.objects).map(([id, {surfaces}]) => [id, surfaces]));
    for (const [id, {paths = {}, surfaces}] of Object.entries(file.objects)) {
      for (const [speller, spelled] of Object.entries(paths)) {
        const isOf = (engine) => engine === speller || (speller === AS_THE_SCENE && !Object.hasOwn(paths, engine));
        for (const names of spelled.map((path) => path.split('/'))) {
          if (!this.#named.has(names.at(-1))) this.#named.set(names.at(-1), []);
          this.#named.get(names.at(-1)).push({names, id, isOf});
        }
      }
      surfaces.forEach(({name}, surface) => {
        for (const each of namesOf(name)) if (!this.#ofMaterial.has(each)) this.#ofMaterial.set(each, {object_id: id, surface});
      });
    }
  }

  /**
   * Returns {object_id, surface} of an object of three.js, A-Frame or Babylon.js, for a touch; undefined: the bake has
   * nothing of it. `hit` is the intersection of a Raycaster, which tells the surface.
   */
  bakedOf(object, hit) {
    if (!isObject(object)) return undefined; // of a ray that hit nothing
    const material = [object.material].flat()[hit?.face?.materialIndex ?? 0] ?? [object.material].flat()[0];
    let known = this.#parts.get(object);
    if (!known) this.#parts.set(object, (known = new Map()));
    if (!known.has(material)) known.set(material, this.#partOf(object, material?.name));
    const {object_id, surface} = known.get(material) ?? {};
    return object_id === undefined ? undefined : {object_id, surface};
  }

  /** Remembers whose geometry is whose in a loaded model, for pages that make nameless meshes of them (react-three-fiber). */
  static learn(model) {
    (model?.scene ?? model)?.traverse?.((object) => object.geometry && originals.set(object, object).set(object.geometry, object));
  }

  /** Returns {object_id, surface, by} of what is known of a thing, by id, path or material; undefined: nothing is. */
  find(query) {
    const {object_id: id, paths, material, primitive, surface = 0, engine} = query ?? {};
    let found = this.#byId(textOf(id));
    const by = found === undefined ? 'path' : 'id';
    found ??= this.#byPath([paths].flat().map(textOf), material, textOf(engine) ?? AS_THE_SCENE);
    if (found !== undefined) return {object_id: found, surface: surfaceOf(this.#objects.get(found), material, primitive, surface), by};
    const named = namesOf(material).find((name) => this.#ofMaterial.has(name));
    return named === undefined ? undefined : {...this.#ofMaterial.get(named), by: 'material'};
  }

  /** Returns a surface: its material and what else the file says of it. */
  surface(part) {
    return this.#objects.get(part?.object_id)?.[part.surface];
  }

  /** Returns the id that shares most pairs of letters with a name. */
  nearest(name) {
    const pairs = pairsOf(name);
    const shares = [...this.#objects.keys()].map((id) => [alike(pairs, pairsOf(id)), id]);
    return shares.reduce((best, each) => (best?.[0] >= each[0] ? best : each), undefined)?.[1];
  }

  /** Looks an object of a page up by its names, then by those of its parents: a part of a mesh has none in the file. */
  #partOf(object, material) {
    let original = originals.get(object) ?? originals.get(object.geometry) ?? object; // a clone of Babylon.js knows its source, too
    for (let depth = 0; depth < DEEPEST && (original.sourceMesh ?? original.source); depth++) original = original.sourceMesh ?? original.source;
    const ask = {material, primitive: primitiveOf(original)};
    const found = (at) => {
      const {own, raw} = pathsOf(at);
      const spellings = [{paths: own, engine: object.isObject3D ? 'three' : AS_THE_SCENE}, {paths: raw}];
      return spellings.map((each) => this.find({...ask, ...each})).find((answer) => answer?.by === 'path');
    };
    const wholeOf = ({parent, userData}) => { // a Group has the parts of its mesh first, then other nodes
      const whole = parent?.isGroup && !userData?.name ? found(parent) : undefined;
      const parts = this.#objects.get(whole?.object_id)?.flatMap(({primitives = []}) => primitives);
      return ask.primitive < parts?.length ? whole : undefined;
    };
    for (const at of [object, ...upwards(original), ...upwards(object.parent)]) {
      const answer = wholeOf(at) ?? found(at);
      if (answer) return answer;
    }
    return this.find({material});
  }

  #byId(id) {
    const original = /^(.*)~/s.exec(id ?? '')?.[1]; // a copy's id is `original~copy`
    return [id, original].find((each) => this.#objects.has(each));
  }

  /** Returns the object whose names agree farthest, from its own up to its parents'. */
  #byPath(paths, material, engine) {
    for (const path of paths.map((each = '') => each.split('/'))) {
      const candidates = this.#named.get(path.at(-1));
      if (!candidates) continue;
      const ranks = candidates.map(({names, isOf}) => 2 * shared(path, names) + isOf(engine));
      const most = ranks.reduce((one, other) => Math.max(one, other));
      const best = candidates.filter((_, at) => ranks[at] === most).map(({id}) => id);
      const wanted = namesOf(material);
      const has = (id) => this.#objects.get(id).some(({name}) => namesOf(name).some((each) => wanted.includes(each)));
      return best.find(has) ?? best[0];
    }
    return undefined;
  }
}

/** Returns the surface with this material's name, else this primitive, else this index, else 0. */
function surfaceOf(surfaces, material, primitive, index) {
  const all = surfaces.map((_, at) => at);
  const named = namesOf(material).map((wanted) => all.filter((at) => namesOf(surfaces[at].name).includes(wanted)));
  const candidates = named.find((each) => each.length) ?? all;
  return candidates.find((at) => surfaces[at].primitives?.includes(primitive)) ?? (candidates.includes(index) ? index : candidates[0]);
}

/** Returns an object and its parents. */
function upwards(object) {
  const all = [];
  for (let at = object; at && all.length < HIGHEST; at = at.parent) all.push(at);
  return all;
}

/** Returns the path of an object as its engine spells it, and as the file does: three.js keeps that in `userData`. */
function pathsOf(object) {
  const path = (nameOf) => (nameOf(object) ? [upwards(object).map(nameOf).filter(Boolean).reverse().join('/')] : []);
  const own = ({name}) => textOf(name);
  const copied = ({name}) => textOf(name)?.replace(/^(Clone of )+|_instance_\d+$/g, '');
  return {own: [...path(own), ...path(copied)], raw: path(({name, userData}) => textOf(userData?.name ?? name))};
}

/** Returns the index of a part in its mesh: the number that Babylon.js gives it, or its place in the Group of three.js. */
function primitiveOf(object) {
  const number = /_primitive(\d+)$/.exec(textOf(object.name))?.[1];
  const place = object.parent?.isGroup ? [object.parent.children].flat().indexOf(object) : -1;
  return number !== undefined ? Number(number) : place < 0 ? undefined : place;
}

/** Returns a material's name as a whole, and without that of its texture's file before it. */
function namesOf(name) {
  const whole = textOf(name);
  if (!whole) return [];
  const last = whole.split('/').at(-1);
  return last && last !== whole ? [whole, last] : [whole];
}

function shared(names, others) {
  const differs = [...names].reverse().findIndex((name, at) => name !== others.at(-1 - at));
  return differs < 0 ? names.length : differs;
}

function pairsOf(name) {
  const low = (textOf(name) ?? '').toLowerCase();
  return new Set(Array.from({length: Math.max(0, low.length - 1)}, (_, at) => low.slice(at, at + 2)));
}

const alike = (pairs, others) => (2 * [...pairs].filter((pair) => others.has(pair)).length) / Math.max(1, pairs.size + others.size);
