/**
 * Plays each material of a bake as the chart's touch: a strike, then strokes without a strike. Prints a JSON object: by material
 * `strike` and `slide`, float32 samples as base64.
 *
 *     node play_bake.mjs CLIENT FEEL RATE_HZ STRIKE_S SLIDE_S SPEED_MPS
 */
import {readFileSync} from 'node:fs';
import {pathToFileURL} from 'node:url';

const [client, file, ...numbers] = process.argv.slice(2);
const [rate, strikeS, slideS, speed] = numbers.map(Number);
const [{openFeel}, {FeelPlayer}] = await Promise.all(['feel', 'player'].map((name) => import(pathToFileURL(`${client}/${name}.js`))));
const feel = openFeel(JSON.parse(readFileSync(file, 'utf8')));
const BLOCK = 128;
const RENEWED_S = 0.05;
const SETTLES_S = 0.2; // of a stroke, before it is kept
const STRIKE = {phase: 'contact', hand: 'right', interaction: 'strike', speed_mps: 1, force_n: 1};
const SLIDE = {phase: 'slide', hand: 'right', interaction: 'slide', speed_mps: speed, force_n: 0};

const playerOf = (material) => new FeelPlayer(feel, () => ({material}), {soundHz: rate});

/** Renders this long; `touch` is renewed, null: it is not. */
function render(player, from, seconds, touch) {
  const wave = new Float32Array(Math.ceil((seconds * rate) / BLOCK) * BLOCK);
  let renewed = -Infinity;
  for (let at = 0; at < wave.length; at += BLOCK) {
    const now = from + at / rate;
    if (touch && now - renewed >= RENEWED_S) {
      player.touch(touch, now);
      renewed = now;
    }
    wave.set(player.render(BLOCK, now), at);
  }
  return wave;
}

function strike(material) {
  const player = playerOf(material);
  player.touch(STRIKE, 0);
  player.touch({...STRIKE, phase: 'contact', speed_mps: 0, force_n: 0}, 0.1);
  return render(player, 0, strikeS, null);
}

function slide(material) {
  const player = playerOf(material);
  render(player, 0, SETTLES_S, SLIDE);
  return render(player, SETTLES_S, slideS, SLIDE);
}

const encoded = (wave) => Buffer.from(wave.buffer).toString('base64');
const waves = Object.fromEntries([...feel.materials.keys()].map((name) => [name, {strike: encoded(strike(name)), slide: encoded(slide(name))}]));
console.log(JSON.stringify(waves));
