/** Geometry of the props; every shape stands on y = 0. */
import * as THREE from 'three';
import {RoundedBoxGeometry} from 'three/addons/geometries/RoundedBoxGeometry.js';
import {fractal} from './noise.js';

/** A mesh that casts and receives shadows. */
export function solid(geometry, material, [x, y, z] = [0, 0, 0]) {
  const mesh = new THREE.Mesh(geometry, material);
  mesh.position.set(x, y, z);
  mesh.castShadow = mesh.receiveShadow = true;
  return mesh;
}

export function group(...parts) {
  const root = new THREE.Group();
  for (const part of parts) root.add(part);
  return root;
}

/** A box of the given size with rounded edges, standing on y = 0. */
export function slab(width, height, depth, radius = 0.006) {
  return new RoundedBoxGeometry(width, height, depth, 4, radius).translate(0, height / 2, 0);
}

/** A solid of revolution through [radius, height] points, smoothed unless `sharp`. */
export function turned(outline, {segments = 64, sharp = false} = {}) {
  const points = outline.map(([radius, height]) => new THREE.Vector2(radius, height));
  const line = sharp ? points : new THREE.SplineCurve(points).getPoints(points.length * 5);
  return new THREE.LatheGeometry(line.map((p) => p.setX(Math.max(p.x, 1e-4))), segments);
}

/** A tube of the given radius through points. */
export function tube(points, radius, {segments = 32} = {}) {
  const curve = new THREE.CatmullRomCurve3(points.map((p) => new THREE.Vector3(...p)));
  return new THREE.TubeGeometry(curve, segments, radius, 12);
}

/** A folded cloth layer: a soft slab whose surface is not quite flat. */
export function fold(width, height, depth, seed) {
  const geometry = softBox(width, height, depth).translate(0, height / 2, 0);
  return bend(geometry, (p) => {
    p.y += (fractal(p.x * 14 + 9, p.z * 14 + seed, 3, seed) - 0.5) * height * 0.55 * (p.y / height);
  });
}

/** Moves every vertex by `move(point)` and recomputes the normals. */
function bend(geometry, move) {
  const position = geometry.getAttribute('position');
  const point = new THREE.Vector3();
  for (let i = 0; i < position.count; i++) {
    move(point.fromBufferAttribute(position, i));
    position.setXYZ(i, point.x, point.y, point.z);
  }
  geometry.computeVertexNormals();
  return geometry;
}

/** A box with fully rounded edges on a grid fine enough to bend. */
function softBox(width, height, depth) {
  const grid = new THREE.BoxGeometry(width, height, depth, 30, 6, 26);
  const position = grid.getAttribute('position');
  const core = new THREE.Vector3();
  const point = new THREE.Vector3();
  const radius = height * 0.49;
  for (let i = 0; i < position.count; i++) {
    point.fromBufferAttribute(position, i);
    core.set(
      THREE.MathUtils.clamp(point.x, radius - width / 2, width / 2 - radius),
      THREE.MathUtils.clamp(point.y, radius - height / 2, height / 2 - radius),
      THREE.MathUtils.clamp(point.z, radius - depth / 2, depth / 2 - radius),
    );
    point.sub(core).setLength(radius).add(core);
    position.setXYZ(i, point.x, point.y, point.z);
  }
  return grid;
}
