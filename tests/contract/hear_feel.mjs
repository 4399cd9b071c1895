/** Renders touches as samples: reads {rate, voice, block, touches: [{block, touch}], blocks} and prints the samples. */
import {readFileSync} from 'node:fs';
import {openFeel} from '../../examples/webxr/client/feel.js';
import {Heard} from '../../examples/webxr/client/sound.heard.js';

const feel = openFeel(JSON.parse(readFileSync(process.argv[2], 'utf8')));
const {rate, voice, block, blocks, touches} = JSON.parse(readFileSync(0, 'utf8'));
const heard = new Heard(feel, rate, voice);
const samples = [];
for (let at = 0; at < blocks; at++) {
  for (const each of touches) if (each.block === at) heard.touch({...each.touch, felt: {material: each.touch.object_id}}, (at * block) / rate);
  samples.push(...heard.render(block, (at * block) / rate));
}
console.log(JSON.stringify(samples.map((sample) => Number(sample.toFixed(6)))));
