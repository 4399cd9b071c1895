/** Computes the distance from a point to the objects' surfaces, triangle by triangle. */
import * as THREE from 'three';

/** The surface of one object in world space; objects do not move. */
export class Surface {
  #triangles = [];
  #bounds = new THREE.Box3();

  constructor(object) {
    this.object = object;
    object.root.updateWorldMatrix(true, true);
    object.root.traverse((node) => node.isMesh && this.#add(node));
  }

  /** Returns the surface's nearest point within `limit` of `point`: {distance, normal}, or null. */
  nearest(point, limit) {
    if (this.#bounds.distanceToPoint(point) > limit) return null;
    const candidate = new THREE.Vector3();
    const closest = new THREE.Vector3();
    let best = limit * limit;
    let found = false;
    for (const {triangle, box} of this.#triangles) {
      if (boxDistanceSquared(box, point) > best) continue;
      triangle.closestPointToPoint(point, candidate);
      const squared = candidate.distanceToSquared(point);
      if (squared > best) continue;
      best = squared;
      found = true;
      closest.copy(candidate);
    }
    if (!found) return null;
    return {distance: Math.sqrt(best), normal: point.clone().sub(closest).normalize()};
  }

  #add(mesh) {
    const {index} = mesh.geometry;
    const position = mesh.geometry.getAttribute('position');
    const corner = (i) =>
      new THREE.Vector3()
        .fromBufferAttribute(position, index ? index.getX(i) : i)
        .applyMatrix4(mesh.matrixWorld);
    for (let i = 0; i < (index ?? position).count; i += 3) {
      const triangle = new THREE.Triangle(corner(i), corner(i + 1), corner(i + 2));
      const box = new THREE.Box3().setFromPoints([triangle.a, triangle.b, triangle.c]);
      this.#triangles.push({triangle, box});
      this.#bounds.union(box);
    }
  }
}

function boxDistanceSquared({min, max}, {x, y, z}) {
  const dx = Math.max(min.x - x, 0, x - max.x);
  const dy = Math.max(min.y - y, 0, y - max.y);
  const dz = Math.max(min.z - z, 0, z - max.z);
  return dx * dx + dy * dy + dz * dz;
}
