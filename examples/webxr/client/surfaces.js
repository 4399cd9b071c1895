/**
 * The surfaces of an object of three.js or A-Frame: one for each material of all meshes in it, the largest first.
 *
 * A mesh has several materials where its geometry has groups. GLTFLoader makes a mesh of several primitives a group of
 * meshes instead, and a whole model is a group as well; both are one object here, so that one id serves all of it.
 * Needs nothing of three.js but the meshes that it is given.
 */
const MOST = 64; // surfaces of an object, the protocol's limit
const LONGEST = 256; // characters of a name

const orders = new WeakMap(); // root -> its materials, in the order of its surfaces

/**
 * Returns the surfaces of everything in `root`, for `surfaces` of an object; call it again when materials change.
 * With `textures`, those of base-colour maps state them, too.
 */
export function surfacesOf(root, textures) {
  const areas = new Map(); // by material
  root.updateWorldMatrix(true, true);
  root.traverse((mesh) => mesh.isMesh && measure(mesh, areas));
  const materials = [...areas.keys()].sort((one, other) => areas.get(other) - areas.get(one));
  if (materials.length > MOST) console.warn(`hapticvlm: ${materials.length - MOST} small surfaces of ${root.name || 'an object'} are felt as its largest`);
  orders.set(root, new Map(materials.slice(0, MOST).map((material, index) => [material, index])));
  return materials.slice(0, MOST).map((material) => describe(material, textures));
}

/** Returns the index of the surface that a ray hit, for `surface` of a touch; `hit` is an intersection of a Raycaster. */
export function surfaceAt(root, {object, face}) {
  const {material} = object;
  const touched = Array.isArray(material) ? material[face?.materialIndex ?? 0] : material;
  return orders.get(root)?.get(touched) ?? 0;
}

/** Adds the area of a mesh's triangles, as they stand in the scene, to that of their materials. */
function measure({geometry, material, matrixWorld, count = 1}, areas) {
  const positions = geometry.attributes.position;
  if (!positions) return;
  const {index} = geometry;
  const end = index ? index.count : positions.count;
  const parts = Array.isArray(material) ? geometry.groups : [{start: 0, count: end, materialIndex: 0}];
  const materials = [material].flat();
  for (const part of parts) {
    const own = materials[part.materialIndex ?? 0];
    if (!own) continue;
    let area = 0;
    for (let at = part.start; at + 2 < Math.min(part.start + part.count, end); at += 3) {
      if (index) area += triangle(positions, index.getX(at), index.getX(at + 1), index.getX(at + 2), matrixWorld.elements);
      else area += triangle(positions, at, at + 1, at + 2, matrixWorld.elements);
    }
    areas.set(own, (areas.get(own) ?? 0) + count * area);
  }
}

/** Returns the area of a triangle. There may be a million of them, so nothing is made on the way. */
function triangle(positions, a, b, c, m) {
  const [x, y, z] = [positions.getX(a), positions.getY(a), positions.getZ(a)];
  const [ux, uy, uz] = [positions.getX(b) - x, positions.getY(b) - y, positions.getZ(b) - z];
  const [vx, vy, vz] = [positions.getX(c) - x, positions.getY(c) - y, positions.getZ(c) - z];
  const px = m[0] * ux + m[4] * uy + m[8] * uz;
  const py = m[1] * ux + m[5] * uy + m[9] * uz;
  const pz = m[2] * ux + m[6] * uy + m[10] * uz;
  const qx = m[0] * vx + m[4] * vy + m[8] * vz;
  const qy = m[1] * vx + m[5] * vy + m[9] * vz;
  const qz = m[2] * vx + m[6] * vy + m[10] * vz;
  return Math.sqrt((py * qz - pz * qy) ** 2 + (pz * qx - px * qz) ** 2 + (px * qy - py * qx) ** 2) / 2;
}

/** Returns what a material says of itself: its name, after that of its texture's file, its shader parameters, its map. */
function describe(material, textures) {
  const file = material.map?.name.split('/').at(-1);
  const name = [file, material.name].filter(Boolean).join('/').slice(-LONGEST);
  const texture = material.map?.image ? textures?.name(material.map.image) : undefined;
  return {name: name || undefined, shader: shaderOf(material), texture};
}

/** Returns the parameters that hold for the whole surface: where a map gives one, its factor says nothing. */
function shaderOf(material) {
  const {metalness, metalnessMap, roughness, roughnessMap, transmission, transparent, opacity, color, map} = material;
  if (!material.isMeshStandardMaterial) return undefined;
  return {
    metallic: metalnessMap ? undefined : share(metalness),
    roughness: roughnessMap ? undefined : share(roughness),
    transmission: share(transmission),
    opacity: transparent ? share(opacity) : undefined, // else it has no effect
    base_color: map || !color ? undefined : [color.r, color.g, color.b].map(share),
  };
}

function share(value) {
  return Number.isFinite(value) ? Math.min(1, Math.max(0, value)) : undefined;
}
