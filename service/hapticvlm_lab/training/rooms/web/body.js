/** A body put together from solids, in metres, y up; each part has a role: main, accent or a look. */
import * as THREE from 'three';
import {RoundedBoxGeometry} from 'three/addons/geometries/RoundedBoxGeometry.js';
import {mergeGeometries} from 'three/addons/utils/BufferGeometryUtils.js';

const vector = (values) => new THREE.Vector3(...values);
export const O = [0, 0, 0];

export class Body {
  #parts = {};

  /** Add a geometry, stretched, turned and then moved. */
  add(geometry, at = O, turn = O, {stretch = [1, 1, 1], role = 'main'} = {}) {
    const turned = new THREE.Quaternion().setFromEuler(new THREE.Euler(...turn, 'ZYX'));
    const part = geometry.index ? geometry.toNonIndexed() : geometry;
    (this.#parts[role] ??= []).push(part.scale(...stretch).applyQuaternion(turned).translate(...at));
    return this;
  }

  box(size, at, turn, {round = 0, ...how} = {}) {
    const edge = Math.min(round, 0.49 * Math.min(...size));
    const solid = edge > 0 ? new RoundedBoxGeometry(...size, 2, edge) : new THREE.BoxGeometry(...size);
    return this.add(solid, at, turn, how);
  }

  rod(from, to, radius, end = radius, how = {}) {
    const along = vector(to).sub(vector(from)), middle = vector(from).addScaledVector(along, 0.5);
    const solid = new THREE.CylinderGeometry(end, radius, along.length(), 14);
    const turn = new THREE.Quaternion().setFromUnitVectors(vector([0, 1, 0]), along.normalize());
    return this.add(solid.applyQuaternion(turn), middle.toArray(), O, how);
  }

  ball(radius, at, stretch, how = {}) {
    return this.add(new THREE.SphereGeometry(radius, 26, 18), at, O, {stretch, ...how});
  }

  ring(radius, thick, at, turn, arc = 2 * Math.PI) {
    return this.add(new THREE.TorusGeometry(radius, thick, 10, 36, arc), at, turn);
  }

  /** Turn a profile of [radius, height] about the upright axis. */
  turned(profile, turn, how = {}) {
    const points = profile.map(([x, y]) => new THREE.Vector2(Math.max(0, x), y));
    return this.add(new THREE.LatheGeometry(points, 36), O, turn, how);
  }

  /** A sheet bent by a function of (x, y) to a place. */
  sheet([width, height], cells, bend, at, turn) {
    return this.add(reshaped(new THREE.PlaneGeometry(width, height, ...cells), bend), at, turn);
  }

  /** Four legs under a board of w x z at height h. */
  legs(w, z, h, radius, slant = 0, how = {}) {
    for (const [a, b] of [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]]) {
      this.rod([a * (w + slant), 0, b * (z + slant)], [a * w, h, b * z], 0.8 * radius, radius, how);
    }
    return this;
  }

  /** Lay maps on by projection along each face's normal, `scale` maps over the longest side. */
  projected(scale = 2) {
    const box = new THREE.Box3();
    for (const part of this.#parts.main) box.union(new THREE.Box3().setFromBufferAttribute(part.attributes.position));
    const k = scale / Math.max(...box.getSize(new THREE.Vector3()).toArray());
    for (const {attributes: {position, normal, uv}} of this.#parts.main) {
      for (let i = 0; i < position.count; i++) {
        const [x, y, z] = vector(O).fromBufferAttribute(normal, i - (i % 3)).toArray().map(Math.abs);
        const point = vector(O).fromBufferAttribute(position, i).multiplyScalar(k);
        uv.setXY(i, x > y && x > z ? point.z : point.x, y > z && y >= x ? point.z : point.y);
      }
    }
    return this;
  }

  /** [{role, geometry}], one of each role. */
  parts() {
    return Object.entries(this.#parts).map(([role, list]) => ({role, geometry: mergeGeometries(list)}));
  }
}

/** Move every point of a geometry by a function of its place. */
export function reshaped(geometry, place) {
  const {position} = geometry.attributes;
  for (let i = 0; i < position.count; i++) {
    position.setXYZ(i, ...place(position.getX(i), position.getY(i), position.getZ(i)));
  }
  geometry.computeVertexNormals();
  return geometry;
}

/** Smooth waves to reshape by: stones, crumpled paper, stuffing. */
export function dents(dice, amount, rate) {
  const waves = Array.from({length: 7}, () => [
    vector(O.map(() => rate * dice.uniform(-1.5, 1.5))), dice.uniform(0, 6.3)]);
  return (...place) => {
    const point = vector(place);
    const dent = waves.reduce((sum, [k, phase]) => sum + Math.sin(point.dot(k) + phase), 0);
    return point.multiplyScalar(1 + (amount * dent) / 4).toArray();
  };
}
