/** Plays the vectors of schemas/vectors with the JavaScript player: `node play_feel.mjs plans|sounds|hostile` reads cases and prints what it played. */
import {readFileSync} from 'node:fs';
import {FeelPlayer, openFeel} from '../../examples/webxr/client/index.js';

const FORMS = ['amplitude', 'parametric'];
const RATE_HZ = 12000;
const BLOCK = 120;
const [true_, sound] = ['true', 'sound'].map((voice) => JSON.parse(readFileSync(new URL(`../../examples/webxr/client/feel.${voice}.json`, import.meta.url))));
const feels = {true: openFeel(true_), sound: openFeel(sound)};
/** Numbers that JSON lacks are {$number}. */
const read = (key, value) => (value?.$number !== undefined ? Number(value.$number) : value);

function plans({surfaces = {}, ...rest}) {
  const players = FORMS.map((form) => [form, new FeelPlayer(feels.true, ({object_id: id}) => surfaces[id] ?? {material: id})]);
  const events = rest.events.map((event) => {
    const played = {...event};
    for (const [form, player] of players) {
      if (event.touch) player.touch(event.touch, event.at_s);
      else if (event.stop) player.stop();
      else played[form] = player.plan(event.plan, form, event.at_s);
    }
    return played;
  });
  return {...rest, events};
}

/** Returns samples as base64 of doubles. */
function sounds({voice, blocks, touches, surfaces = {}}) {
  const player = new FeelPlayer(feels[voice], ({object_id: id}) => surfaces[id] ?? {material: id}, {soundHz: RATE_HZ});
  const wave = new Float64Array(blocks * BLOCK);
  for (let block = 0; block < blocks; block++) {
    const now = (block * BLOCK) / RATE_HZ;
    for (const each of touches) if (each.block === block) player.touch(each.touch, now);
    wave.set(player.render(BLOCK, now), block * BLOCK);
  }
  return Buffer.from(wave.buffer).toString('base64');
}

/** Returns the plan 20 ms after a touch, and each problem that was said. */
function felt(touch, surface = {material: 'wood'}, gain = 1) {
  const said = [];
  const player = new FeelPlayer(feels.true, () => surface, {say: (text) => said.push(text)});
  player.gain = gain;
  if (touch) player.touch(touch, 5);
  return {plan: player.plan(touch?.hand ?? 'right', 'parametric', 5.02), said};
}

function slid({times, phase = 'slide'}) {
  const said = [];
  const player = new FeelPlayer(feels.true, () => ({material: 'wood'}), {say: (text) => said.push(text)});
  const touch = {phase, hand: 'right', speed_mps: 0.4, force_n: 1.5};
  const played = times.map((now) => {
    player.touch(touch, now);
    return player.plan('right', 'parametric', now);
  });
  return {plans: played, said};
}

/** Returns the plan of a hand and form while the right hand slides. */
function asked({hand, form}) {
  const said = [];
  const player = new FeelPlayer(feels.true, () => ({material: 'wood'}), {say: (text) => said.push(text)});
  player.touch({phase: 'slide', hand: 'right'}, 5);
  return {isHeld: player.isHeld(hand), plan: player.plan(hand, form, 5.02), said};
}

/** Returns why a file with the edit of a case is refused. */
function refusal({file = structuredClone(true_), path: [...way] = [], ...edit}) {
  const last = way.pop();
  const part = way.reduce((inside, step) => inside[step], file);
  if ('value' in edit) part[last] = edit.value;
  else if (last !== undefined) delete part[last];
  try {
    openFeel(file);
    return null;
  } catch (error) {
    return error.message;
  }
}

function hostile({touches, times = [], calls = [], files = []}) {
  return {
    touches: touches.map((each) => [felt(each.touch, each.surface, each.gain), felt(each.like, each.like_surface, each.like_gain)]),
    times: times.map(slid),
    calls: calls.map(asked),
    files: files.map(refusal),
  };
}

const play = {plans: (cases) => cases.map(plans), sounds: (cases) => cases.map(sounds), hostile}[process.argv[2]];
console.log(JSON.stringify(play(JSON.parse(readFileSync(0, 'utf8'), read))));
