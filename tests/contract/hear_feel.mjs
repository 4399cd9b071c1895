/** Renders touches as sound: reads {rate, block, touches: [{block, touch}], blocks} and prints the samples. */
import {readFileSync} from 'node:fs';
import {FeelPlayer, openFeel} from '../../examples/webxr/client/feel.js';

const feel = openFeel(JSON.parse(readFileSync(process.argv[2], 'utf8')));
const {rate, block, blocks, touches} = JSON.parse(readFileSync(0, 'utf8'));
const player = new FeelPlayer(feel, ({object_id: material}) => ({material}), {soundHz: rate});
const samples = [];
for (let at = 0; at < blocks; at++) {
  for (const each of touches) if (each.block === at) player.touch(each.touch, (at * block) / rate);
  samples.push(...player.render(block, (at * block) / rate));
}
console.log(JSON.stringify(samples.map((sample) => Number(sample.toFixed(6)))));
