/** Geometry of the props; every shape stands on y = 0. */
import * as THREE from 'three';
import {RoundedBoxGeometry} from 'three/addons/geometries/RoundedBoxGeometry.js';
import {fractal, mix} from './noise.js';

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

/** A cloth hanging from y = height to 0 in deep folds. */
export function drape(width, height, {folds = 6, depth = 0.035} = {}) {
  const geometry = new THREE.PlaneGeometry(width, height, 140, 28).translate(0, height / 2, 0);
  return bend(geometry, (p) => {
    const along = (p.x / width + 0.5) * folds * 2 * Math.PI;
    const loose = mix(1.15, 0.75, p.y / height);
    p.z += Math.sin(along + Math.sin(along * 0.37) * 1.4) * depth * loose;
    p.x += Math.cos(along * 0.5 + p.y) * 0.012 * loose;
  });
}

/** A folded cloth layer: a soft slab whose surface is not quite flat. */
export function fold(width, height, depth, seed) {
  const geometry = softBox(width, height, depth).translate(0, height / 2, 0);
  return bend(geometry, (p) => {
    p.y += (fractal(p.x * 14 + 9, p.z * 14 + seed, 3, seed) - 0.5) * height * 0.55 * (p.y / height);
  });
}

/** A flat ring with a cut tread, lying on y = 0. */
export function tyre(outer, inner, height) {
  const mid = height / 2;
  const bulge = outer - 0.012;
  const outline = [
    [inner, mid * 0.5], [inner + 0.008, 0.004], [(inner + bulge) / 2, 0], [bulge, 0.006],
    [outer - 0.002, mid * 0.35], [outer, mid], [outer - 0.002, mid * 1.65],
    [bulge, height - 0.006], [(inner + bulge) / 2, height], [inner + 0.008, height - 0.004],
    [inner, mid * 1.5],
  ];
  return bend(turned(outline, {segments: 240}), (p) => {
    const radius = Math.hypot(p.x, p.z);
    const groove = Math.sin(Math.atan2(p.z, p.x) * 40 + (p.y > mid ? 1 : -1) * 0.9) > 0.35;
    if (radius > bulge - 0.004 && groove) {
      const cut = (radius - 0.006) / radius;
      p.x *= cut;
      p.z *= cut;
    }
  });
}

/** An open crate: four posts, rails between them and a floor. */
export function crate(width, height, depth, material) {
  const wall = 0.011;
  const parts = [solid(slab(width, wall, depth, 0.004), material)];
  const rails = [[0.0, 0.045], [0.062, 0.026], [0.104, height - 0.104]];
  for (const [y, rail] of rails) {
    for (const side of [-1, 1]) {
      parts.push(solid(slab(width, rail, wall, 0.004), material, [0, y, (side * (depth - wall)) / 2]));
      parts.push(solid(slab(wall, rail, depth, 0.004), material, [(side * (width - wall)) / 2, y, 0]));
    }
  }
  for (let i = 0; i <= 6; i++) {
    const x = mix(-0.5, 0.5, i / 6) * (width - 0.016);
    for (const side of [-1, 1]) {
      parts.push(solid(slab(0.016, height, wall * 1.2, 0.004), material, [x, 0, (side * (depth - wall)) / 2]));
    }
  }
  return group(...parts);
}

/** A long leaf arching out from the origin towards +z. */
export function leafBlade(length, width, droop) {
  const geometry = new THREE.PlaneGeometry(width, length, 6, 14).translate(0, length / 2, 0);
  return bend(geometry, (p) => {
    const along = p.y / length;
    const breadth = Math.sin(Math.PI * (0.08 + 0.9 * along)) ** 0.7;
    const fold = (Math.abs(p.x) / width) * 0.3 * width;
    p.x *= breadth;
    p.z = length * along * Math.sin(droop * along);
    p.y = length * along * Math.cos(droop * along) + fold * breadth;
  });
}

/** A lump: a sphere pushed in and out by noise. */
export function lump(radius, seed) {
  const geometry = new THREE.SphereGeometry(radius, 64, 40).translate(0, radius, 0);
  return bend(geometry, (p) => {
    const [x, y, z] = [p.x, p.y - radius, p.z];
    const swell = 0.78 + 0.44 * fractal(x * 11 + 20, y * 11 + z * 7 + 20, 2, seed);
    p.set(x * swell, radius * 0.98 + y * swell, z * swell);
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
