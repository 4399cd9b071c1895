/** What things are made of, as game engines have it: tiles, drawn maps, plain colours. */
import * as THREE from 'three';

const hsl = (h, s, l) => new THREE.Color().setHSL(((h % 1) + 1) % 1, s, l);
const grey = (level) => new THREE.Color().setScalar(level);
const BOTH = {side: THREE.DoubleSide};

/** A look with a map that repeats, turns and is bumpy or blocky by chance. */
function mapped(d, {map}, look, {repeat = [0.5, 4], bump = 1, turn = 0.3} = {}) {
  const x = d.spread(...repeat), rotation = d.chance(turn) ? d.pick([Math.PI / 2, d.uniform(0, 6.28)]) : 0;
  const own = Object.assign(map.clone(), {rotation});
  own.repeat.set(x, x * d.spread(0.8, 1.25));
  if (d.chance(0.08)) own.magFilter = THREE.NearestFilter;
  const bumpMap = bump && d.chance(0.75) ? own : null;
  return {map: own, bumpMap, bumpScale: bump * d.uniform(0.3, 4), ...look};
}

function metal(d, maps) {
  const [hue, dull, vivid, dark, light] = d.pick([[0.6, 0, 0.05, 0.6, 0.92], [0.6, 0, 0.05, 0.6, 0.92],
    [0.6, 0, 0.1, 0.1, 0.6], [0.12, 0.5, 0.9, 0.5, 0.68], [0.05, 0.4, 0.75, 0.45, 0.65]]);
  const color = hsl(hue + d.uniform(-0.02, 0.02), d.uniform(dull, vivid), d.uniform(dark, light));
  const bare = (from, to) => ({color, metalness: 1, roughness: d.uniform(from, to)});
  const worn = {metalness: d.uniform(0.2, 0.8), roughness: d.uniform(0.45, 0.95)};
  const tile = maps.tile(d, 'metal'), pale = {color: grey(d.uniform(1, 1.5))};
  const brushed = {...bare(0.15, 0.45), anisotropy: d.pick([0, 0, d.next()]), ...pale};
  return d.pick([
    () => bare(0.02, 0.18), () => bare(0.02, 0.18), () => bare(0.18, 0.5), () => bare(0.18, 0.5),
    () => mapped(d, maps.pattern(d, 'brushed'), brushed, {bump: 0.3}),
    () => mapped(d, maps.pattern(d, 'hide'), {...bare(0.08, 0.4), map: null}, {bump: 2}), // hammered
    () => mapped(d, tile, tile.name.startsWith('Rust') ? worn : {...bare(0.15, 0.5), ...pale}),
  ])();
}

/** Physical glass by transmission, or the cheap glass of games: a transparent shiny skin. */
function glass(d) {
  const isTinted = d.chance(0.45);
  const color = isTinted ? hsl(d.next(), d.uniform(0.3, 1), d.uniform(0.35, 0.85)) : grey(1);
  const physical = {transmission: 1, roughness: d.chance(0.85) ? d.uniform(0, 0.1) : d.uniform(0.2, 0.55),
    thickness: d.uniform(0.01, 0.25), ior: d.uniform(1.4, 1.6), attenuationColor: color,
    attenuationDistance: d.spread(0.05, 1), color: d.pick([color, grey(1)])};
  const cheap = {color, transparent: true, opacity: d.uniform(0.1, isTinted ? 0.6 : 0.38), depthWrite: false,
    roughness: d.uniform(0, 0.12), metalness: d.pick([0, 0, 0.3]), envMapIntensity: d.uniform(1, 2),
    clearcoat: d.pick([0, 1]), side: d.pick([THREE.DoubleSide, THREE.FrontSide])};
  return d.pick([physical, cheap]);
}

function plastic(d, maps) {
  const color = d.pick([hsl(d.next(), d.uniform(0.45, 1), d.uniform(0.25, 0.65)), grey(d.uniform(0.02, 0.9))]);
  const shiny = {color, roughness: d.uniform(0.08, 0.35), clearcoat: d.pick([0, d.next()]), clearcoatRoughness: 0.1};
  const milky = {transparent: true, opacity: d.uniform(0.75, 0.92), roughness: d.uniform(0.25, 0.5), ...BOTH};
  return d.pick([() => shiny, () => shiny, () => ({color, roughness: d.uniform(0.3, 0.7)}),
    () => ({...milky, color: color.lerp(grey(1), 0.7)}),
    () => mapped(d, maps.tile(d, 'plastic'), {roughness: d.uniform(0.15, 0.5)})])();
}

function ceramic(d, maps) {
  const glazed = {clearcoat: d.uniform(0.5, 1), clearcoatRoughness: 0.05, roughness: d.uniform(0.2, 0.6)};
  const clay = {roughness: d.uniform(0.7, 1), color: hsl(0.05, d.uniform(0.4, 0.7), d.uniform(0.4, 0.6))};
  return d.pick([
    () => ({color: hsl(0.1, d.uniform(0, 0.25), d.uniform(0.8, 0.97)), ...glazed}),
    () => ({color: hsl(d.next(), d.uniform(0.1, 0.6), d.uniform(0.2, 0.75)), ...glazed}),
    () => mapped(d, maps.pattern(d, 'glaze'), glazed, {repeat: [0.9, 2], bump: 0}),
    () => mapped(d, maps.pattern(d, 'glaze'), glazed, {repeat: [0.9, 2], bump: 0}),
    () => mapped(d, maps.tile(d, 'ceramic'), glazed, {bump: 0.3}),
    () => mapped(d, maps.pattern(d, 'plaster'), clay)])();
}

function stone(d, maps) {
  const tile = maps.tile(d, 'stone', 'stone', 'stone', 'brick', 'concrete');
  const isPolished = d.chance(0.25) && !/^(Rock|Bricks|Concrete)/.test(tile.name);
  return mapped(d, tile, {roughness: isPolished ? d.uniform(0.08, 0.35) : d.uniform(0.65, 1)},
    {repeat: [0.5, 2.5], bump: isPolished ? 0.2 : 2});
}

function fabric(d, maps) {
  const source = d.chance(0.4) ? maps.tile(d, 'fabric') : maps.pattern(d, 'weave', 'print');
  const tint = hsl(d.next(), d.spread(0.1, 0.9), d.uniform(0.1, 0.85)), isVelvet = d.chance(0.15);
  const soft = {roughness: d.uniform(0.8, 1), sheenRoughness: d.uniform(0.2, 0.9), ...BOTH,
    sheen: isVelvet || d.chance(0.5) ? d.uniform(0.3, 1) : 0, specularIntensity: d.uniform(0, 0.6),
    sheenColor: tint.clone().lerp(grey(1), 0.5), color: isVelvet || d.chance(0.25) ? tint : grey(1)};
  return mapped(d, source, isVelvet ? {...soft, map: null} : soft, {repeat: [0.8, 6]});
}

function unknown(d, maps) {
  const light = {color: 0, emissive: hsl(d.next(), d.next(), d.uniform(0.2, 0.8)), emissiveIntensity: 1.5};
  return d.pick([() => light, () => ({...light, transparent: true, opacity: 0.5, wireframe: d.chance(0.5)}),
    () => mapped(d, maps.pattern(d, 'odd'), {roughness: d.uniform(0.1, 1)})])();
}

/** Parameters of a MeshPhysicalMaterial: the classes of the material table, and what else dresses. */
const LOOKS = {
  metal, glass, plastic, ceramic, stone, fabric, unknown,
  wood: (d, maps) => mapped(d, maps.tile(d, 'wood'), {roughness: d.uniform(0.3, 0.95),
    clearcoat: d.chance(0.3) ? d.uniform(0.3, 1) : 0, clearcoatRoughness: d.uniform(0.02, 0.35),
    color: d.chance(0.2) ? hsl(0.08, d.uniform(0, 0.5), d.uniform(0.5, 0.95)) : grey(1)}, {repeat: [0.4, 2.5]}),
  paper: (d, maps) => mapped(d, d.chance(0.3) ? maps.tile(d, 'paper') : maps.pattern(d, 'page'),
    {roughness: d.uniform(0.75, 1), specularIntensity: d.uniform(0.1, 0.6), ...BOTH}, {repeat: [0.7, 1.6], bump: 0.4}),
  leather: (d, maps) => mapped(d, maps.pattern(d, 'hide'), {roughness: d.uniform(0.3, 0.65),
    clearcoat: d.chance(0.4) ? d.uniform(0.1, 0.6) : 0, clearcoatRoughness: 0.3, ...BOTH}),
  rubber: (d, maps) => mapped(d, d.chance(0.3) ? maps.tile(d, 'rubber') : maps.pattern(d, 'tread'),
    {roughness: d.uniform(0.6, 1), specularIntensity: d.uniform(0.2, 0.7), ...(d.chance(0.25)
      ? {map: null, color: hsl(d.next(), d.uniform(0.3, 0.9), d.uniform(0.2, 0.5))} : {})}, {repeat: [1, 6], bump: 3}),
  foliage: (d, maps) => mapped(d, maps.pattern(d, 'leaf'), {roughness: d.uniform(0.4, 0.9), ...BOTH,
    clearcoat: d.chance(0.25) ? 0.4 : 0}, {repeat: [1, 1.01], bump: 0.4, turn: 0}),
  turf: (d, maps) => mapped(d, maps.tile(d, 'foliage'), {roughness: 1}, {repeat: [1, 3], bump: 2}),
  liquid: (d) => ({roughness: 0.05, color: hsl(d.pick([0.97, 0.1, d.next()]), 0.7, d.uniform(0.1, 0.7))}),
  wall: (d, maps) => mapped(d, d.chance(0.6) ? maps.pattern(d, 'plaster', 'plaster', 'print')
    : maps.tile(d, 'brick', 'wood', 'concrete'), {roughness: d.uniform(0.6, 1),
    color: hsl(d.next(), d.spread(0.02, 0.5), d.uniform(0.3, 0.95))}, {repeat: [2, 8], turn: 0}),
  ground: (d, maps) => mapped(d, maps.tile(d, 'wood', 'wood', 'fabric', 'ceramic', 'stone', 'concrete'),
    {roughness: d.uniform(0.25, 1)}, {repeat: [3, 14]}),
};

/** A material of a class, or of what else dresses. */
export const material = (name, dice, maps) => new THREE.MeshPhysicalMaterial(LOOKS[name](dice, maps));
