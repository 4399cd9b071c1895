/** What two hands are told of the touches of several input sources; as one JSON object. */
import {Hands} from '../../examples/webxr/client/hands.js';

const [right, other, left, none] = ['right', 'right', 'left', 'none'].map((handedness) => ({handedness}));
const [contact, slide, release] = ['contact', 'slide', 'release'].map((phase) => ({phase, speed_mps: 0.3, force_n: 1.5}));

/** Plays pictures, each a list of [source, touches]. */
function play(...pictures) {
  const told = [];
  const hands = new Hands(({phase, hand}) => told.push(`${phase} ${hand}`));
  for (const picture of pictures) hands.step(picture.map(([source, ...touches]) => ({source, touches})));
  return told;
}

console.log(JSON.stringify({
  'two sources': play([[right, contact], [other, contact]], [[other, contact], [right, slide]], [[right, release], [other]]),
  'a vanished source': play([[left, contact]], [[right]], [[right]]),
  'both hands': play([[left, contact], [right, contact]]),
  'of no hand': play([[none, contact]]),
}));
