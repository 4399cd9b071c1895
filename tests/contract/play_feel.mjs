/** Plays cases of golden vectors with the JavaScript player: `node play_feel.mjs FEEL` reads cases and prints them with its plans. */
import {readFileSync} from 'node:fs';
import {FeelPlayer, openFeel} from '../../examples/webxr/client/feel.js';

const feel = openFeel(JSON.parse(readFileSync(process.argv[2], 'utf8')));
const cases = JSON.parse(readFileSync(0, 'utf8'));

/** Numbers that JSON lacks come as text. */
const read = (touch) => ({...touch, speed_mps: Number(touch.speed_mps), force_n: Number(touch.force_n)});

function plan({amplitude, frequency_hz, transients}) {
  return {amplitude, frequency_hz, transients: transients.map((one) => [one.amplitude, one.frequency_hz])};
}

function play({name, events}) {
  const player = new FeelPlayer(feel, ({object_id: material}) => ({material}));
  const played = events.map((event) => {
    if (event.touch) player.touch(read(event.touch), event.at_s);
    else if (event.stop) player.stop();
    else return {...event, amplitude: plan(player.plan(event.plan, 'amplitude', event.at_s)), parametric: plan(player.plan(event.plan, 'parametric', event.at_s))};
    return event;
  });
  return {name, events: played};
}

console.log(JSON.stringify(cases.map(play)));
