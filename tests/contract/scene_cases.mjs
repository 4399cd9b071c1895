/**
 * Describes each scene of a file through the package and touches its objects: `node scene_cases.mjs URL FILE`.
 *
 * Prints of each scene the materials felt, the parts left out, the warnings and the silence, as one JSON list.
 */
import {readFileSync} from 'node:fs';
import WebSocket from 'ws';
import {Haptics} from '../../examples/webxr/client/haptics.js';

const [url, file] = process.argv.slice(2);
const told = [];
const isLate = (text) => text.includes('captured_at'); // of a touch on a slow machine

async function feel({objects, touch}) {
  const warnings = [];
  const leftOut = [];
  const felt = {};
  console.warn = (text) => isLate(text) || warnings.push(text);
  const haptics = new Haptics(url, {WebSocket});
  const next = (type) => new Promise((resolve) => haptics.addEventListener(type, ({detail}) => resolve(detail), {once: true}));
  haptics.addEventListener('left_out', ({detail}) => isLate(detail.path) || leftOut.push(detail.path));
  haptics.scene(objects);
  const {owner} = await next('welcome');
  if (!owner) throw new Error('another scene owns the outputs');
  for (const object_id of touch) {
    const decision = next('decision');
    haptics.touch({phase: 'contact', hand: 'right', object_id, speed_mps: 0.3, force_n: 1.5});
    felt[object_id] = (await decision).material;
    haptics.touch({phase: 'release', hand: 'right', speed_mps: 0, force_n: 0});
  }
  const {silence} = haptics;
  haptics.close();
  return {felt, left_out: leftOut, warnings, silence};
}

for (const scene of JSON.parse(readFileSync(file))) told.push(await feel(scene));
console.log(JSON.stringify(told));
